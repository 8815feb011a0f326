"""The lip press: force, imprint, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fem2d.materials.library import configuration
from scenarios.studies.imprint import Imprint, imprint_of
from scenarios.studies.press import Press, PressError, PressOptions, force_n
from scenarios.studies.press_study import press_study

COARSE = PressOptions(edge_mm=0.6)


@pytest.fixture(scope="module")
def imprints() -> dict[str, Imprint]:
    found = {}
    for name in ("L2-Ogden", "L2-GOH"):
        press = Press(configuration(name), COARSE)
        converged = press.pressed()
        assert force_n(converged) == pytest.approx(0.3, rel=1e-3)
        found[name] = imprint_of(press, converged)
    return found


@pytest.mark.slow
def test_crests_are_touched_and_roots_are_not(imprints):
    for imprint in imprints.values():
        assert imprint.crests == ("crest_1", "crest_2")
        assert imprint.roots == ()
        assert "rim" in imprint.touched
        # From the opening to a couple of millimetres below the lowest thread.
        assert imprint.depth_mm[0] < 1.0
        assert 0.0 < imprint.depth_mm[1] - imprint.thread_end_mm < 4.0


@pytest.mark.slow
def test_ogden_lips_hug_the_neck_more_than_gasser_lips(imprints):
    assert imprints["L2-Ogden"].contact_mm > 1.2 * imprints["L2-GOH"].contact_mm
    assert imprints["L2-Ogden"].pressure_kpa.max() < imprints["L2-GOH"].pressure_kpa.max()


def test_a_light_press_touches_a_crest_only():
    press = Press(configuration("L2-Ogden"), PressOptions(edge_mm=0.6, force=0.005))
    imprint = imprint_of(press, press.pressed())
    assert set(imprint.touched) <= {"crest_1", "crest_2"}
    assert np.all(imprint.pressure_kpa > 0)


def test_study_writes_what_it_promises(tmp_path: Path):
    options = PressOptions(edge_mm=0.8, force=0.02)
    press_study("L2-Ogden", tmp_path / "out", options)
    table = json.loads((tmp_path / "out" / "press.json").read_text(encoding="utf-8"))
    assert table["force_n"] == pytest.approx(0.02, rel=1e-3)
    assert {"indentation_mm", "contact_mm", "crests_touched", "roots_touched"} <= set(table)
    assert (tmp_path / "out" / "press.png").is_file()


def test_a_force_that_the_lip_cannot_carry_is_refused(tmp_path: Path):
    options = PressOptions(edge_mm=0.8, lip_height_mm=6.0, force=50.0)
    with pytest.raises(PressError, match=r"not 50 N|cannot carry 50 N"):
        press_study("L2-Ogden", tmp_path / "out", options)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"neck": "A39"}, "did you mean 'A38'"),
        ({"lip_radius_mm": 1.0}, "does not fit around corners"),
        ({"lip_radius_mm": 9.0}, "do not fit on a lip"),
    ],
)
def test_impossible_presses_are_refused(changes, message):
    with pytest.raises(PressError, match=message):
        PressOptions(**changes)
