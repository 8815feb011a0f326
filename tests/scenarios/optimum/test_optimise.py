"""The best dimensions of a neck: what is asked, what is refused, and what is left on the disk."""

import csv
import re
from pathlib import Path

import pytest

from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.foundation.errors import DrinksimError
from scenarios.campaign.measures import HEADLINE, MEASURES
from scenarios.campaign.meeting import Meeting
from scenarios.campaign.sip import STOPPED, WHOLE, SipRow, scenario_in
from scenarios.optimum.found import optimum_message
from scenarios.optimum.optimise import optimise
from scenarios.optimum.settings import read_optimum
from scenarios.settings.scenario import load_scenario
from tests.support.approach import write_base
from tests.support.browser import laid_out
from tests.support.optional import needed_program

FILE = """
base = "base.toml"
neck = "A38"
[meeting]
hand = "recorded"
[people]
count = 2
[bounds]
rim_radius_mm = {from = 0.4, to = 0.85}
land_mm = {from = 1.0, to = 3.0}
[search]
trials = 10
"""


def formula(task):
    """A rounder rim presses less; the best land is 2 mm."""
    folder = Path(task.folder)
    folder.mkdir(parents=True, exist_ok=True)
    neck = scenario_in(folder, task.scenario_toml).package.measurements
    value = 60 - 20 * neck.rim_radius_mm + 3 * (neck.land_mm - 2.0) ** 2
    measures = dict.fromkeys(MEASURES, value)
    status = STOPPED if neck.land_mm > 2.9 else WHOLE
    row = SipRow(status, "", 1.0, measures, mesh_doubt=0.01 * value)
    row.write(folder)
    return row


@pytest.fixture
def file(tmp_path):
    write_base(tmp_path)
    (tmp_path / "optimum.toml").write_text(FILE)
    return tmp_path / "optimum.toml"


@pytest.mark.slow
def test_the_best_neck_is_a_drawing_and_a_scenario(file, tmp_path):
    out = tmp_path / "out"
    found = optimise(file, out, solver=formula)
    (best,) = found.best
    assert best.evaluation.objectives[0] == min(t.evaluation.objectives[0] for t in found.trials)
    place = out / "best" / f"trial-{best.number:03d}"
    scenario = load_scenario(place.with_suffix(".toml"))
    neck = scenario.package.measurements
    assert neck.land_mm == pytest.approx(best.values["land_mm"], rel=1e-3)
    for ending in (".svg", ".dxf"):
        drawn = drawn_neck(place.with_suffix(ending))
        away = scenario.package.section().upper_wall.project(drawn.upper_wall.sampled(0.2)).distance
        assert abs(away).max() < 1e-6
    with (out / "trials.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 10
    assert [row["best"] for row in rows].count("True") == 1
    assert HEADLINE in optimum_message(found)
    pressed = best.evaluation.objectives[0]
    assert float(rows[best.number - 1]["mesh_doubt"]) == pytest.approx(0.01 * pressed)
    said = f"too coarse for the highest pressure of neck {best.number}:"
    assert said in optimum_message(found)
    assert f"up to {pressed:.0f} %" in optimum_message(found)
    page = (out / "optimum.html").read_text(encoding="utf-8")
    assert f"Neck {best.number} is best of 10" in page
    assert said in page
    links = re.findall(r'href="(best/[^"]+)"', page)
    assert len(links) == 3
    assert all((out / link).is_file() for link in links)
    assert page.count('<tr><th scope="row">') == 10 + 3


@pytest.mark.slow
def test_the_panel_is_made_once_for_all_necks(file, tmp_path, monkeypatch):
    met = []
    placed = Meeting.met_by
    monkeypatch.setattr(Meeting, "met_by", lambda self, who: met.append(who) or placed(self, who))
    found = optimise(file, tmp_path / "out", solver=formula)
    assert len(found.trials) == 10
    assert len(met) == 2


@pytest.mark.slow
def test_a_search_goes_on(file, tmp_path):
    out = tmp_path / "out"
    first = optimise(file, out, solver=formula)
    file.write_text(FILE.replace("trials = 10", "trials = 12"))
    more = optimise(file, out, solver=formula, resume=True)
    assert more.trials[:10] == first.trials
    assert len(more.trials) == 12
    file.write_text(FILE.replace("to = 3.0", "to = 2.5"))
    with pytest.raises(DrinksimError, match="another optimisation"):
        optimise(file, out, solver=formula, resume=True)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (FILE.replace("[bounds]", "[bonds]"), "unknown key bonds"),
        (FILE.replace("land_mm", "lad_mm"), "bounds.lad_mm is no measurement of a neck"),
        (FILE.replace("from = 1.0, to = 3.0", "from = 3.0, to = 1.0"), "not less than"),
        (FILE.replace("from = 1.0", "from = -1.0"), "bounds.land_mm = -1 mm is too small"),
        (FILE.replace('neck = "A38"', 'neck = "A39"'), "did you mean 'A38'"),
        (FILE + '[objectives]\nlist = ["pressure"]', 'objectives.list holds "pressure"'),
        (FILE + '[constraints]\nclosure = "SP 38"', "SP 38-400"),
        (FILE + '[vary]\n"contact.friction" = [1.0]', r"\[vary\] has no place"),
        (
            FILE.replace("land_mm", "pitch_mm") + '[constraints]\nclosure = "SP 38-400"',
            "bounds.pitch_mm is fixed by constraints.closure",
        ),
    ],
)
def test_what_contradicts_itself_is_refused(file, text, told):
    file.write_text(text)
    with pytest.raises(DrinksimError, match=told):
        read_optimum(file)


def test_constraints_on_measurements_are_kept_before_anything_is_computed(file):
    file.write_text(FILE + "[constraints]\nleast_engagement_mm = 9.0\nleast_wall_mm = 1.5\n")
    with pytest.raises(DrinksimError, match=r"least_engagement_mm = 9 mm is missed: 8.466 mm"):
        read_optimum(file).measurements({"rim_radius_mm": 0.6})


def test_a_closure_fixes_the_thread(file):
    file.write_text(FILE + '[constraints]\nclosure = "SP 38-400"\n')
    neck = read_optimum(file).measurements({"rim_radius_mm": 0.6})
    assert (neck.thread_diameter_mm, neck.pitch_mm) == (37.2, 4.233)


@pytest.mark.slow
def test_two_objectives_leave_a_front(file, tmp_path):
    file.write_text(
        FILE.replace("trials = 10", "trials = 12")
        + '[objectives]\nlist = ["lips_window_kpa_peak", "upper_lip_contact_mm_mean"]\n'
    )
    found = optimise(file, tmp_path / "out", solver=formula)
    assert len(found.best) > 1
    assert "<svg" in (tmp_path / "out" / "search.svg").read_text(encoding="utf-8")
    assert len(list((tmp_path / "out" / "best").glob("*.dxf"))) == len(found.best)
    page = tmp_path / "out" / "optimum.html"
    assert f"{len(found.best)} of 12 necks are such that no other one" in page.read_text("utf-8")
    chromium = needed_program("chromium", "chromium-browser", "google-chrome", package="chromium")
    for width_px in (390, 1280):
        layout = laid_out(chromium, page, width_px=width_px, scratch=tmp_path)
        assert layout.width_px <= width_px
        assert (layout.pictures, layout.broken) == (1 + len(found.best), 0)
