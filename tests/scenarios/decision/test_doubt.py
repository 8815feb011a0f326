"""What a recording leaves open, from its standard errors to the bands of a report."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from geometry2d.foundation.errors import DrinksimError
from mocap.motion.sampling import CONSTANT_SHARE, CORRELATION_S, noise_covariance
from scenarios.campaign.engine import InProcess
from scenarios.campaign.measures import HEADLINE
from scenarios.campaign.plan import planned
from scenarios.campaign.settings import read_study
from scenarios.campaign.sip import WHOLE, SipRow, scenario_in
from scenarios.campaign.study import carried_out
from scenarios.cli.main import main
from scenarios.decision.doubt import doubt_message, doubt_study
from scenarios.results.doubt import Doubt
from scenarios.results.history_file import write_history
from scenarios.results.quantities import HISTORY
from tests.support.approach import approach, write_base

FIRST, SECOND, TURN = 10, 25, 30.0
"""Of a linear output: x at one instant less x at another, and mm per rad at a third."""


def quiet(share, text):
    pass


def linear(motion):
    return (
        motion.relative_mm[FIRST, 0] - motion.relative_mm[SECOND, 0] + TURN * motion.relative_rad[5]
    )


def linear_sip(task):
    folder = Path(task.folder)
    folder.mkdir(parents=True)
    scenario = scenario_in(folder, task.scenario_toml)
    return SipRow(WHOLE, "", 1.0, {HEADLINE: float(linear(scenario.known_motion()))})


@pytest.mark.slow
def test_sampled_motions_spread_a_linear_output_as_its_propagated_error(tmp_path):
    """Where an output is linear in the motion, its error is exactly wᵀ C w."""
    write_base(tmp_path)
    (tmp_path / "study.toml").write_text(
        'base = "base.toml"\n[meeting]\nhand = "recorded"\n[doubt]\ndraws = 80\n'
        "placement_sigma_mm = 0.0\n"
    )
    plan = planned(read_study(tmp_path / "study.toml"), tmp_path / "out", quiet)
    result = carried_out(plan, tmp_path / "out", InProcess(), solver=linear_sip, progress=quiet)
    values = np.array([row[HEADLINE] for row in result.rows])
    motion = approach()
    covariance = noise_covariance(
        motion.time_s, correlation_s=CORRELATION_S, constant_share=CONSTANT_SHARE
    )
    weights = np.zeros(motion.time_s.size)
    weights[FIRST], weights[SECOND] = 1.0, -1.0
    of_x = motion.sigma[:, 0] * weights
    variance = of_x @ covariance @ of_x + (TURN * motion.sigma[5, 2]) ** 2
    assert values.mean() == pytest.approx(linear(motion), abs=3.5 * np.sqrt(variance / 80))
    assert values.std(ddof=1) == pytest.approx(np.sqrt(variance), rel=3.5 / np.sqrt(2 * 79))


def write_samples(run, values):
    """Put histories beside a run: every column is the value at the middle of the time, else 0."""
    for number, value in enumerate(values):
        folder = run / "doubt" / "runs" / f"{number:03d}"
        folder.mkdir(parents=True)
        write_history_of(folder, value)


def write_history_of(folder, value):
    rows = [
        dict.fromkeys((quantity.name for quantity in HISTORY), value * (share == 0.5))
        | {"time_s": share, "relative_time": share}
        for share in (0.0, 0.5, 1.0)
    ]
    with (folder / "history.csv").open("w", newline="") as stream:
        write_history(stream, rows)


def test_a_band_holds_ninety_percent_of_the_samples(tmp_path):
    write_samples(tmp_path, np.arange(101.0))
    doubt = Doubt.of(tmp_path)
    assert doubt.count == 101
    low, high = doubt.band("upper_lip_window_kpa", np.array([0.0, 0.25, 0.5]))
    assert low == pytest.approx([0.0, 2.5, 5.0])
    assert high == pytest.approx([0.0, 47.5, 95.0])
    assert doubt.peak("upper_lip_window_kpa") == pytest.approx((5.0, 95.0))
    low, high = doubt.band_of_force("x", np.array([0.5]))
    assert (low[0], high[0]) == pytest.approx((10.0, 190.0))
    assert "upper lip 5 to 95 kPa" in doubt_message(tmp_path)


def test_a_run_of_a_study_has_the_doubt_of_its_other_draws(tmp_path):
    """Same neck, same person: other draws. Another neck's, and one without a history, are not."""
    sips = [("A38", 1, 10.0), ("A38", 2, 30.0), ("A38", 3, None), ("DC", 1, 90.0)]
    lines = ["neck,person,draw,status,reason,run,seconds"]
    for number, (neck, draw, value) in enumerate(sips):
        lines.append(f"{neck},woman 1,{draw},whole,,runs/{number:03d},1.0")
        if value is not None:
            place = tmp_path / "runs" / f"{number:03d}" / ("run" if neck == "A38" else "")
            place.mkdir(parents=True)
            write_history_of(place, value)
    (tmp_path / "results.csv").write_text("\n".join([*lines, ""]))
    doubt = Doubt.of(tmp_path / "runs" / "001" / "run")
    assert doubt.count == 2
    assert doubt.peak("upper_lip_window_kpa") == pytest.approx((11.0, 29.0))
    assert Doubt.of(tmp_path / "runs" / "003") is None
    (tmp_path / "results.csv").write_text("\n".join(lines).replace("draw", "sample"))
    assert Doubt.of(tmp_path / "runs" / "001" / "run") is None


def test_without_samples_there_is_no_doubt(tmp_path):
    assert Doubt.of(tmp_path) is None
    assert Doubt.of(None) is None
    assert "no sampled motion" in doubt_message(tmp_path)


@pytest.mark.slow
def test_a_report_shows_the_bands_of_the_run_that_has_them(run_directory, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(run_directory, run)
    plain, banded = tmp_path / "plain.html", tmp_path / "banded.html"
    assert main(["report", str(run), "--out", str(plain)]) == 0
    write_samples(run, np.linspace(40.0, 80.0, 21))
    assert main(["report", str(run), "--out", str(banded)]) == 0
    assert "Bands hold 90 % of what comes out" in banded.read_text(encoding="utf-8")
    assert "Bands hold" not in plain.read_text(encoding="utf-8")
    assert "21 for made up" in banded.read_text(encoding="utf-8")
    held = re.search(r'"bands":(\{.*?\]\]\})', banded.read_text(encoding="utf-8"))
    assert held is not None
    low, high = json.loads(held[1])["upper_lip_window_kpa"]
    assert max(low) == pytest.approx(42.0)
    assert max(high) == pytest.approx(78.0)


def test_a_band_of_one_sample_is_refused(run_directory):
    with pytest.raises(DrinksimError, match="--doubt 1: a band needs at least 2"):
        doubt_study(run_directory, 1)


def test_workers_without_doubt_have_no_effect(capsys, tmp_path):
    code = main(["replay", "A38-F", "--out", str(tmp_path / "run"), "--workers", "2"])
    assert code == 2
    assert "--workers has no effect without --doubt" in capsys.readouterr().err
