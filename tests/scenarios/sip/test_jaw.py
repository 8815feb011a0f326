"""A jaw that turns takes lower tooth and lip along, and a jaw that does not changes nothing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fem2d.contact.rigid import RigidContact
from fem2d.loads.driven import DrivenAnchor, DrivenOutline
from fem2d.loads.load import Load
from fem2d.solvers.static import solve_static
from mocap.motion.jaw import JawOpening
from scenarios.settings.person import Jaw
from scenarios.settings.scenario import load_scenario, resolved_toml
from scenarios.settings.tables import SettingError
from scenarios.sip.findings import Severity, jaw_file_findings
from scenarios.sip.jaw import JawCourse
from scenarios.sip.lip_model import Lips, without_neck

TURNING = ("head.jaw.time_s=[0.0, 1.0]", "head.jaw.opening_deg=[7.0, 12.0]")


def lips_of(*settings: str) -> Lips:
    scenario = load_scenario("A38-F", ["numerics.resolution=coarse", *settings])
    head = scenario.head.section()
    jaw = scenario.head.jaw
    course = None if jaw is None else JawCourse.of(jaw, head.landmarks["hinge"])
    return Lips(scenario, head, scenario.package.section(), jaw=course, present=("lower",))


def test_what_goes_with_the_jaw_is_where_a_head_so_far_open_has_it():
    opened = load_scenario("A38-F", ["head.jaw_opening_deg=12.0"]).head.section()
    lips = lips_of(*TURNING)
    course = lips.jaw
    assert course is not None
    place = course(1.0)
    moved = lips.head.lower_tooth.moved(place.angle_rad, place.shift_mm).sampled(0.5)
    assert np.allclose(moved, opened.lower_tooth.sampled(0.5), rtol=0.0, atol=1e-9)
    for name in ("stomion_lower", "pogonion", "lower_incisor"):
        assert np.allclose(place.apply(lips.head.landmarks[name]), opened.landmarks[name])
    assert np.allclose(
        course(0.0).apply(lips.head.landmarks["menton"]), lips.head.landmarks["menton"]
    )


def test_a_lip_that_nothing_else_touches_goes_with_its_jaw_without_strain():
    lips = lips_of(*TURNING)
    model = without_neck(lips.quasi_static)
    assert lips.jaw is not None
    nodes = lips.body.nodes
    turned = lips.jaw(1.0).apply(nodes) - nodes
    for time, smallest, largest in ((1.0, 0.0, 1e-10), (0.0, 0.01, np.inf)):
        load = Load(time_s=time)
        unbalanced = np.abs(model.balance(turned, load, model.at_rest(load)).residual).max()
        assert smallest <= unbalanced < largest
    result = solve_static(model, Load(time_s=1.0))
    assert result.converged
    # Newton's method ends where the largest force is balanced to a thousandth.
    assert np.allclose(result.displacement, turned, rtol=0.0, atol=1e-3)


def loads_of(lips: Lips) -> dict[type, list]:
    kinds: dict[type, list] = {DrivenAnchor: [], DrivenOutline: []}
    for load in lips.jaw_loads:
        kinds[type(load)].append(load)
    return kinds


def test_forces_of_a_turning_jaw_are_derivatives():
    """Pressed into its tooth and away from the identity: by displacement, and from energy."""
    lips = lips_of(*TURNING)
    rng = np.random.default_rng(3)
    u = lips.jaw(0.6).apply(lips.body.nodes) - lips.body.nodes + [-0.4, 0.0]  # onto the tooth
    u = u + 0.01 * rng.standard_normal(u.shape)
    direction = rng.standard_normal(u.shape)
    load, step = Load(time_s=0.6), 1e-6
    for kind, loads in loads_of(lips).items():
        assert loads
        for each in loads:
            force = each.force(u, load)
            assert np.abs(force).max() > 1e-6
            ahead, behind = (each.energy(u + s * step * direction, load) for s in (1, -1))
            work = -(ahead - behind) / (2 * step)
            assert work == pytest.approx(float(force @ direction.ravel()), rel=1e-5)
            if kind is DrivenOutline:
                pattern = lips.body.pattern
                data = np.zeros(pattern.nonzeros)
                each.add_stiffness(data, pattern, u, load, psd=False)
                predicted = -(pattern.matrix(data) @ direction.ravel())
                forces = [each.force(u + s * step * direction, load) for s in (1, -1)]
                changed = (forces[0] - forces[1]) / (2 * step)
                assert np.abs(changed).max() > 1e-3
                assert np.allclose(predicted, changed, rtol=0.0, atol=1e-5 * np.abs(changed).max())
            later = Load(time_s=0.6 + 1e-6)
            first_order = each.change(u, load, later)
            exact = each.force(u, later) - force
            assert np.abs(exact).max() > 0.0
            assert np.allclose(first_order, exact, rtol=0.0, atol=1e-3 * np.abs(exact).max())


@pytest.mark.parametrize("key", ["head.jaw", "head.jaw_opening_deg"])
def test_a_jaw_that_stays_changes_nothing(key):
    stays = lips_of(f"{key}.time_s=[0.0, 1.0]", f"{key}.opening_deg=[7.0, 7.0]")
    plain = lips_of()
    assert stays.jaw is None
    assert stays.jaw_loads == ()
    assert np.array_equal(stays.body.nodes, plain.body.nodes)
    names = [[c.name for c in lips.fem_model.contacts] for lips in (stays, plain)]
    assert names[0] == names[1]


def test_the_opening_is_a_number_or_a_table_against_time(tmp_path):
    table = "{time_s = [0.0, 1.0], opening_deg = [7.0, 12.0]}"
    for number, opening in enumerate(("9.0", table)):
        file = tmp_path / f"{number}.toml"
        file.write_text(f'base = "A38-F"\n[head]\njaw_opening_deg = {opening}\n')
    number, turning = (load_scenario(tmp_path / f"{k}.toml").head for k in (0, 1))
    assert number.jaw is None and number.measurements.jaw_opening_deg == 9.0
    assert turning.jaw == Jaw((0.0, 1.0), (7.0, 12.0)) == load_scenario("A38-F", TURNING).head.jaw
    # What is said later holds, whichever of the two it is; and what is written reads back.
    assert load_scenario(tmp_path / "1.toml", ["head.jaw_opening_deg=9.0"]).head == number
    later = load_scenario(tmp_path / "0.toml", TURNING)
    assert later.head == turning
    file.write_text(resolved_toml(later))
    assert load_scenario(file).head == turning


def test_teeth_of_a_turning_jaw_touch_without_friction():
    lips = lips_of(*TURNING)
    on_teeth = [
        contact
        for contact in lips.fem_model.contacts
        if isinstance(contact, RigidContact) and not contact.moving
    ]
    assert on_teeth == []  # the tooth is one of the loads
    with pytest.raises(SettingError, match=r"teeth_friction = 0\.5 and head"):
        load_scenario("A38-F", [*TURNING, "contact.teeth_friction=0.5"])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["head.jaw.time_s=[0.0, 1.0]", "head.jaw.opening_deg=[7.0]"], "one opening for each"),
        (["head.jaw.time_s=[1.0, 1.0]", "head.jaw.opening_deg=[7.0, 8.0]"], "later than the one"),
        ([*TURNING, "head.jaw_opening_deg=9.0"], r"no effect, as \[head.jaw\] tells it"),
        ([*TURNING[:1], "head.jaw.opening_deg=[7.0, 40.0]"], "opening_deg"),
        ([*TURNING, "head.jaw_opening_deg.time_s=[0.0]"], "head.jaw are the same table"),
    ],
)
def test_contradictions_are_refused(settings, message):
    with pytest.raises(SettingError, match=message):
        load_scenario("A38-F", settings)


def filmed_jaw(folder: Path, degrees: np.ndarray, sigma_deg: float) -> Path:
    """Write what ``convert`` writes of a jaw that is so far open at 20 frames a second."""
    n = degrees.size
    sigma = np.radians(np.where(np.arange(n) == 0, 0.0, sigma_deg))
    file = folder / "jaw.csv"
    JawOpening(np.arange(n), np.arange(n) / 20.0, np.radians(degrees), sigma).write(file)
    return file


def test_a_filmed_jaw_turns_from_its_first_opening(tmp_path):
    file = filmed_jaw(tmp_path, np.concatenate([np.zeros(10), np.full(11, 8.0)]), 2.0)
    head = load_scenario("A38-F", [f"head.jaw_file={file}", "head.jaw_opening_deg=9"]).head
    jaw = head.jaw_course()
    assert jaw.time_s[0] == 0.0
    assert jaw.time_s[-1] == 1.0
    assert jaw.amplitude.at(0.0) == 9.0
    assert jaw.amplitude.at(1.0) == pytest.approx(17.0)
    built = head.section().landmarks["lower_incisor"]
    still = load_scenario("A38-F", ["head.jaw_opening_deg=9"]).head.section()
    assert np.array_equal(built, still.landmarks["lower_incisor"])
    assert list(jaw_file_findings(head)) == []


def test_a_turn_within_its_error_is_odd(tmp_path):
    file = filmed_jaw(tmp_path, np.linspace(0.0, 3.0, 21), 6.0)
    head = load_scenario("A38-F", [f"head.jaw_file={file}"]).head
    (finding,) = jaw_file_findings(head)
    assert finding.severity is Severity.WARNING
    assert str(finding).startswith("head.jaw_file: in jaw.csv the jaw turns by")
    assert "its standard error is 6.0°" in str(finding)
    assert re.search(r"turns by (2\.[89]|3\.0)°", str(finding))


@pytest.mark.parametrize(
    ("degrees", "settings", "message"),
    [
        (20.0, (), r"on head.jaw_opening_deg = 7° its opening is 2[67]\.\d° at"),
        (-8.0, (), r"its opening is -1\.0° at"),
        (1.0, TURNING, "head.jaw and head.jaw_file = .* contradict"),
        (1.0, ("contact.teeth_friction=0.5",), r"teeth_friction = 0\.5 and head"),
    ],
)
def test_a_filmed_jaw_that_cannot_be_is_refused(tmp_path, degrees, settings, message):
    file = filmed_jaw(tmp_path, np.linspace(0.0, 1.0, 21).round() * degrees, 2.0)
    with pytest.raises(SettingError, match=message):
        load_scenario("A38-F", [f"head.jaw_file={file}", *settings]).head.jaw_course()


def test_a_resting_jaw_stays_where_it_is():
    course = JawCourse.of(Jaw((0.0, 1.0), (7.0, 12.0)), np.array([11.0, 2.0]))
    assert course is not None
    resting = course.resting(0.5)
    assert resting(0.0) == resting(9.0) == course(0.5)
    assert course.built_deg == 7.0
