"""A whole sip from the bundled recording's files, at coarse resolution: complete and believable."""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
import shapely

from fem2d.body.surface import edge_shapes
from geometry2d.rigid import RigidPlacement, rotated
from mocap.motion.motion import Motion
from scenarios.cli.main import main
from scenarios.results.increment import Increment
from scenarios.results.solution import Snapshot, Solution
from scenarios.settings.scenario import load_scenario
from scenarios.sip.replay import Prepared, prepared, replay

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sip") / "run"
    assert main(["replay", "A38-F", "--out", str(out), "--resolution", "coarse"]) == 0
    return out


@pytest.fixture(scope="module")
def solution(run: Path) -> Solution:
    return Solution.load(run)


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
    """Nothing changes by a quarter of its range in an increment, or in 0.01 s of a longer one.

    As lips are met the neck moves 0.1 mm in that time: what changes more has not been pressed.
    """
    for name, least in (
        ("dermis_max_log_strain", 0.03),
        ("dermis_max_mises_kpa", 15.0),
        ("upper_lip_window_kpa", 15.0),
        ("lower_lip_window_kpa", 15.0),
    ):
        history = solution[name]
        values, longer = history.values, np.maximum(1.0, np.diff(history.time_s) / 0.01)
        change = np.abs(np.diff(values)) / longer
        assert change.max() < max(least, 0.25 * np.ptp(values)), name


def test_no_point_of_a_lip_lies_inside_neck_or_teeth(solution: Solution):
    """Nodes not at all, to 0.005 mm; edges between them no more than their parabolas must."""
    ready = prepared(solution.scenario)
    _check_overlaps(
        (_overlaps(ready, solution.snapshot(k)) for k in range(solution.time_s.size)),
        solution.summary["largest_penetration_between_nodes_mm"],
    )


def ending(motion: Motion, end_s: float) -> Motion:
    """Return the beginning of a motion."""
    kept = motion.time_s <= end_s
    values = {field.name: getattr(motion, field.name) for field in fields(motion)}
    arrays = {name: value[kept] for name, value in values.items() if isinstance(value, np.ndarray)}
    return motion.with_(**arrays)


def test_no_point_of_a_pulled_lip_lies_inside_neck_or_teeth(library_motion: Callable[[str], Path]):
    """The upper lip is drawn up while the neck comes, let go, and closes over it from 3.2 s on."""
    pulled_once = {"tense_from_s": (0.3,), "tense_to_s": (0.9,), "relax_from_s": (2.7,)}
    coarse = load_scenario("DC-AE", ["numerics.resolution=coarse"])
    scenario = coarse.with_(muscle=pulled_once | {"relax_to_s": (3.5,)}).with_motion(
        ending(Motion.read(library_motion("DC-AE")), 4.5)
    )
    ready = prepared(scenario)
    overlaps: list[list[tuple[str, float]]] = []
    outcome = replay(scenario, on_increment=lambda it: overlaps.append(list(_overlaps(ready, it))))
    assert outcome.finished
    _check_overlaps(overlaps, outcome.about["largest_penetration_between_nodes_mm"])


def test_a_lip_driven_against_the_teeth_folds_without_passing_through_itself(
    library_motion: Callable[[str], Path],
):
    """With the neck 2 mm nearer the inner side folds between lip and jaw, within 2 mm of itself.

    The neck is nearest at 3.1 s.

    Contact is felt between nodes: one may poke a little into an edge, for an instant; edges there
    are 0.6 mm long.
    """
    nearer = ["numerics.resolution=coarse", "placement.shift_x_mm=-2"]
    scenario = load_scenario("A38-F", nearer).with_motion(
        ending(Motion.read(library_motion("A38-F")), 3.2)
    )
    ready = prepared(scenario)
    edges = ready.lips.free_edges("lower")[:, [0, 2, 1]]
    apart = np.abs(np.subtract.outer(np.arange(len(edges)), np.arange(len(edges)))) > 1
    depths = [0.0]

    def look(increment: Increment) -> None:
        turned_back = rotated(increment.displacement, -ready.placed.head_angle_rad)
        places = ready.lips.body.nodes + turned_back
        lines = shapely.linestrings(places[edges])
        for one, other in np.argwhere(shapely.intersects(lines[:, None], lines) & apart):
            nodes = shapely.points(places[edges[one]])
            depths.append(float(shapely.distance(nodes, lines[other]).min()))

    assert replay(scenario, on_increment=look).finished
    assert max(depths) < 0.05


def _check_overlaps(overlaps: Iterable[Iterable[tuple[str, float]]], told_mm: float) -> None:
    deepest = {"nodes": -np.inf, "edges": -np.inf}
    for where, excess in chain.from_iterable(overlaps):
        deepest[where] = max(deepest[where], excess)
    assert 0.0 < deepest["nodes"] < 0.005
    assert deepest["edges"] < 0.005
    assert deepest["nodes"] < told_mm < 0.1


def _overlaps(ready: Prepared, increment: Increment | Snapshot) -> Iterator[tuple[str, float]]:
    """Penetration of each lip's nodes, and of its edges beyond what rounded corners explain, mm.

    Two nodes at a distance s on a corner of radius r have the corner s²/(8r) above their chord, and
    their edge may bend the other way, by an eighth of its second difference.
    """
    lips, turn = ready.lips, ready.placed.head_angle_rad
    x, y = rotated(increment.placement.shift_mm, -turn)
    neck = RigidPlacement(increment.placement.angle_rad - turn, (float(x), float(y)))
    walls = [lips.neck.upper_wall, lips.neck.lower_wall]
    for lip in ("upper", "lower"):
        edges = lips.free_edges(lip)
        deformed = lips.body.nodes + rotated(increment.displacement, -turn)
        tooth = [getattr(lips.head, f"{lip}_tooth")]
        for outlines, placement in ((walls, neck), (tooth, RigidPlacement(0.0, (0.0, 0.0)))):
            yield "nodes", max(_depth(deformed[edges[:, k]], outlines, placement) for k in range(3))
            radius = min(1 / np.abs(o.curvature).max() for o in outlines)
            first, last, middle = (deformed[edges[:, k]] for k in range(3))
            spacing = np.maximum(*(np.linalg.norm(end - middle, axis=1) for end in (first, last)))
            bends = np.linalg.norm(first - 2 * middle + last, axis=1) / 8
            for at in (0.125, 0.25, 0.375, 0.625, 0.75, 0.875):
                shape, _ = edge_shapes(3, at)
                points = np.einsum("k,mkc->mc", shape, deformed[edges])
                allowed = spacing**2 / (8 * radius) + bends
                yield "edges", _depth(points, outlines, placement, allowed)


def _depth(points, outlines, placement, allowed=0.0) -> float:
    local = placement.pull_back(points)
    return max(float(np.max(-o.project(local).distance - allowed)) for o in outlines)
