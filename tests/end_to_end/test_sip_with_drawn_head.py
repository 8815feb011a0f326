"""The measured head drawn as SVG: replayed like the measured one, and exported as a deck."""

from pathlib import Path

import numpy as np
import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.drawings.drawn_head import HeadDrawing
from geometry2d.rigid import rotated
from scenarios.cli.main import main
from scenarios.placing.recorded_motion import recorded_motion
from scenarios.results.solution import Solution
from scenarios.settings.scenario import load_scenario

pytestmark = pytest.mark.slow
UNTIL_S = "1.5"


def test_a_drawn_head_drinks_like_the_measured_one(tmp_path: Path) -> None:
    (tmp_path / "head.svg").write_text(HeadDrawing.of(head_section()).svg())
    start = ["replay", "A38-F", "--resolution", "coarse"]
    measured, drawn = tmp_path / "measured", tmp_path / "drawn"
    shorter = ["--set", f"recording.end_s={UNTIL_S}"]
    assert main([*start, *shorter, "--out", str(measured)]) == 0
    motion = ["--motion", str(measured / "motion" / "motion.csv")]
    outline = ["--set", f"head.outline={tmp_path / 'head.svg'}"]
    assert main([*start, *motion, *outline, "--out", str(drawn)]) == 0
    one, two = Solution.load(measured), Solution.load(drawn)
    for name in ("lower_lip_force_x_n", "lower_lip_force_y_n"):
        force = one[name].values
        other = np.interp(one.time_s, two.time_s, two[name].values)
        assert np.abs(force).max() > 0.005
        # The meshes' insides differ by how rounding divides equal triangles.
        assert np.sqrt(np.mean((force - other) ** 2)) < 0.02 * np.abs(force).max()

    deck = tmp_path / "run.inp"
    assert main(["export", str(drawn), "--format", "abaqus", "--out", str(deck)]) == 0
    lines = deck.read_text().splitlines()
    nodes = lines[lines.index("*NODE, NSET=TISSUE") + 1 :][: len(two.model.nodes)]
    table = np.array([[float(x) for x in line.split(",")] for line in nodes])
    # The deck's axes are the section's own, the run's those of the recording.
    scenario = load_scenario(str(drawn / "scenario.toml"))
    turn = recorded_motion(
        scenario, scenario.package.section(), scenario.head.section()
    ).head_angle_rad
    np.testing.assert_allclose(rotated(table[:, 1:], turn), two.model.nodes, atol=1e-9)
    walls = [line for line in lines if line.startswith("*SURFACE, NAME=") and "SEGMENTS" in line]
    assert [wall.split("=")[1].split(",")[0] for wall in walls] == [
        "UPPER_WALL", "LOWER_WALL", "UPPER_TOOTH", "LOWER_TOOTH"
    ]  # fmt: skip
