"""A sip that takes seconds: the first touch of A38-F, on a mesh coarser than coarse."""

from __future__ import annotations

from pathlib import Path

from scenarios.settings.files import LIBRARY
from scenarios.settings.scenario import Scenario, load_scenario
from tests.support.drawings import neck_drawing

FIRST_S, LAST_S = 0.6, 0.96
"""The part of the motion that is replayed, s."""

SETTINGS = (
    "numerics.resolution=coarse",
    "numerics.mesh.contact_mm=0.9",
    "numerics.mesh.layer_mm=2.5",
    "numerics.mesh.far_mm=8",
    "numerics.mesh.gradation=2",
    "numerics.steps.travel_mm=1",
    "numerics.steps.accuracy_mm=0.1",
)


def short_sip(folder: Path) -> Scenario:
    """Return the sip; its motion and the drawing of its neck are written into a folder."""
    text = (LIBRARY / "A38-F" / "truth_motion.csv").read_text(encoding="utf-8")
    header, *rows = text.splitlines()
    lines = [header, *(row for row in rows if _is_used(float(row.partition(",")[0])))]
    head = "# head_axis_deg = -8.3691\n# package_axis_deg = 38.0435\n"
    (folder / "motion.csv").write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    (folder / "neck.svg").write_text(neck_drawing(), encoding="utf-8")
    scenario = load_scenario("A38-F", SETTINGS)
    return scenario.with_(
        recording=None,
        motion=folder / "motion.csv",
        package={"outline": folder / "neck.svg"},
        filmed=None,
    )


def _is_used(time_s: float) -> bool:
    return FIRST_S <= time_s <= LAST_S
