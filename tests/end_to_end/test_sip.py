"""A whole sip from the bundled recording's files, at coarse resolution: complete and believable."""

import json
from pathlib import Path

import numpy as np
import pytest

from fem2d.surface import Surface
from geometry2d.outline import Outline
from geometry2d.rigid import RigidPlacement, rotated
from scenarios.cli import main
from scenarios.drinking import Prepared, prepared
from scenarios.solution import Solution
from scenarios.spec import read_scenario

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sip") / "run"
    assert main(["replay", "A38-F", "--out", str(out), "--resolution", "coarse"]) == 0
    return out


@pytest.fixture(scope="module")
def solution(run: Path) -> Solution:
    return Solution.load(run)


@pytest.fixture(scope="module")
def ready(run: Path) -> Prepared:
    return prepared(read_scenario(str(run / "scenario.toml"), ["solver.resolution=coarse"]))


def test_the_whole_motion_was_followed_and_forces_balance(run: Path):
    summary = json.loads((run / "summary.json").read_text())
    assert summary["finished"]
    assert summary["largest_unbalanced_force_share"] <= 1e-6
    assert summary["largest_kinetic_energy_nmm"] < 0.01 * summary["largest_strain_energy_nmm"]


def test_lips_meet_the_neck_in_the_right_order_and_let_go(solution: Solution):
    upper, lower = (solution[f"{lip}_lip_window_kpa"].values > 0 for lip in ("upper", "lower"))
    first_upper, first_lower = np.argmax(upper), np.argmax(lower)
    assert 0 < first_lower < first_upper
    assert not upper[-1]
    assert not lower[-1]
    assert solution["dermis_max_log_strain"].values[-1] < 0.02


def test_strain_stress_and_pressure_are_those_of_a_plausible_sip(solution: Solution):
    """The thesis: strain about −0.5…0.25, von Mises under 160 kPa, upper lip above lower lip."""
    assert -0.6 < solution["dermis_min_log_strain"].values.min() < -0.15
    assert 0.1 < solution["dermis_max_log_strain"].values.max() < 0.4
    assert 40 < solution["dermis_max_mises_kpa"].values.max() < 200
    upper = solution["upper_lip_window_kpa"].values.max()
    lower = solution["lower_lip_window_kpa"].values.max()
    assert lower < upper < 272  # the lowest pressure pain threshold (Finocchietti 2011)
    for lip in ("upper", "lower"):
        force = np.hypot(
            solution[f"{lip}_lip_force_x_n"].values, solution[f"{lip}_lip_force_y_n"].values
        )
        assert 0.005 < force.max() < 1.0


def test_histories_do_not_jump(solution: Solution):
    for name, least in (
        ("dermis_max_log_strain", 0.03),
        ("dermis_max_mises_kpa", 15.0),
        ("upper_lip_window_kpa", 15.0),
        ("lower_lip_window_kpa", 15.0),
    ):
        values = solution[name].values
        assert np.abs(np.diff(values)).max() < max(least, 0.25 * np.ptp(values)), name


def test_no_point_of_a_lip_lies_inside_neck_or_teeth(solution: Solution, ready: Prepared):
    lips, turn = ready.lips, ready.placed.head_angle_rad
    walls = [lips.neck.upper_wall, lips.neck.lower_wall]
    teeth = [getattr(lips.head, f"{lip}_tooth") for lip in ("upper", "lower")]
    at_rest = RigidPlacement(0.0, (0.0, 0.0))
    deepest = 0.0
    for index in range(0, solution.time_s.size, 5):
        frame = solution.frame(index)
        displacement = rotated(frame.displacement, -turn)  # back into the frame of the section
        x, y = rotated(frame.placement.shift_mm, -turn)
        neck = RigidPlacement(frame.placement.angle_rad - turn, (float(x), float(y)))
        for lip in ("upper", "lower"):
            for part in ("skin", "inner"):
                points = _dense(lips.surface(f"{lip}_{part}"), displacement)
                for outlines, placement in ((walls, neck), (teeth, at_rest)):
                    deepest = max(deepest, _depth(points, outlines, placement))
    assert 0.0 < deepest < 0.02


def _dense(surface: Surface, displacement: np.ndarray) -> np.ndarray:
    return np.concatenate(
        [
            Surface(surface.edges, surface.nodes, points_per_edge=count)
            .positions(displacement)
            .reshape(-1, 2)
            for count in (2, 5, 9)
        ]
    )


def _depth(points: np.ndarray, outlines: list[Outline], placement: RigidPlacement) -> float:
    local = placement.pull_back(points)
    return max(float(-outline.project(local).distance.min()) for outline in outlines)
