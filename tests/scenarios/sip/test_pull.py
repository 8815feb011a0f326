"""The pull that is found clears the neck, nothing smaller does, and the lip alone decides."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely

from fem2d.loads.amplitude import Amplitude
from fem2d.loads.load import Load
from fem2d.solvers.march import march
from fem2d.solvers.static import StaticStatus
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion
from scenarios.recordings.script import script_of
from scenarios.settings.scenario import ScenarioError, load_scenario
from scenarios.sip.lip_model import Lips, Pull
from scenarios.sip.pull import PullResult, find_pull

pytestmark = pytest.mark.slow


def lips(*overrides: str, resolution: str = "coarse") -> Lips:
    scenario = load_scenario("DC-AE", [f"numerics.resolution={resolution}", *overrides])
    return Lips(scenario, script_of("DC-AE").face(), scenario.package.section())


def motion() -> RigidMotion:
    return script_of("DC-AE").neck_motion()


@cache
def found() -> PullResult:
    result = find_pull(lips(), motion())
    assert result is not None
    return result


def clearance_of(pull: Pull) -> float:
    """Clearance of the drawn lip from the neck, solved in one go and sampled densely."""
    alone = replace(lips(), present=("upper",))
    rising = replace(alone.load(pull), amplitude=Amplitude((0.0, 1.0), (0.0, 1.0)))
    system = alone.fem_model
    system = replace(
        system,
        contacts=[c for c in system.contacts if not c.name.endswith("_wall")],
        loads=[rising],
    )
    # Near its limit of what it can bear the drawn lip is soft, and takes a second to come to rest.
    start = system.at_rest(next_step_s=0.04)
    state = march(system, lambda time_s: Load(), start, end_s=6.0).state
    skin = alone.free_surface("upper", at_nodes=False).positions(state.displacement).reshape(-1, 2)
    neck = closed(alone.neck)
    border = shapely.boundary(neck)
    nearest = np.inf
    for held_from, held_to in zip(pull.muscle.tense_to_s, pull.muscle.relax_from_s, strict=True):
        for time in np.linspace(held_from, held_to, 150):
            points = shapely.points(motion().at(float(time)).pull_back(skin))
            distance = shapely.distance(border, points)
            inside = shapely.contains(neck, points)
            nearest = min(nearest, float(np.where(inside, -distance, distance).min()))
    return nearest


def closed(neck: NeckSection) -> shapely.Geometry:
    """The neck with its opening closed at the rim."""
    walls = [shapely.Polygon(w.sampled(0.02)) for w in (neck.lower_wall, neck.upper_wall)]
    (left, low, right, _), (_, _, _, high) = (wall.bounds for wall in walls)
    thread_to_bore = 0.5 * (walls[0].bounds[3] - low)
    between = shapely.box(left, low + thread_to_bore, right, high - thread_to_bore)
    return shapely.union_all([*walls, between])


def test_the_pull_that_is_found_clears_the_neck_as_asked():
    pull = found().pull
    assert 0.5 < pull.traction_kpa < 4.0
    assert clearance_of(pull) == pytest.approx(0.5, abs=0.05)
    assert 0.5 <= found().clearance_mm <= 0.505


def test_nothing_smaller_and_no_other_direction_does():
    pull = found().pull
    assert clearance_of(replace(pull, traction_kpa=0.9 * pull.traction_kpa)) < 0.45
    for turn in (-20.0, 20.0):
        other = find_pull(lips(f"muscle.direction_deg={pull.direction_deg + turn}"), motion())
        assert other is not None
        assert other.pull.traction_kpa > pull.traction_kpa
        assert 0.5 <= other.clearance_mm <= 0.505


def test_the_undrawn_lip_would_be_in_the_way():
    """So the lip lies on the neck when the muscle relaxes, and the muscle is there for a reason."""
    assert clearance_of(replace(found().pull, traction_kpa=0.0)) < -2.0


def test_the_resolution_of_the_replay_changes_nothing():
    direction = f"muscle.direction_deg={found().pull.direction_deg}"
    pulls = [
        find_pull(lips(direction, resolution=level), motion()) for level in ("coarse", "standard")
    ]
    assert pulls[0] == pulls[1]


def test_a_given_pull_is_kept_and_its_clearance_told():
    given = find_pull(lips("muscle.traction_kpa=1.0", "muscle.direction_deg=30.0"), motion())
    assert given is not None
    assert (given.pull.traction_kpa, given.pull.direction_deg) == (1.0, 30.0)
    assert given.clearance_mm == pytest.approx(clearance_of(given.pull), abs=0.05)
    assert find_pull(replace(lips(), scenario=load_scenario("A38-F")), motion()) is None


def test_a_lip_that_cannot_be_drawn_clear_is_said():
    with pytest.raises(ScenarioError, match=r"no pull on the upper lip up to 6 kPa keeps it 5 mm"):
        find_pull(lips("muscle.clearance_mm=5", "muscle.direction_deg=-60"), motion())


def test_a_lip_that_finds_no_equilibrium_is_not_taken_for_clear(monkeypatch):
    def stuck(model, load, *, start, **options):
        yield replace(start, status=StaticStatus.STEP_TOO_SMALL)

    monkeypatch.setattr("scenarios.sip.pull.static_path", stuck)
    with pytest.raises(ScenarioError, match="no pull on the upper lip"):
        find_pull(lips(), motion())
