"""Measures of a contact on pressure profiles whose answers are known."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem2d.body.surface import edge_shapes
from scenarios.sip.contact_line import TOUCHING_MM, ContactLine, recovered_traction

GAUSS = np.polynomial.legendre.leggauss(4)
NODES = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3
RULES = pytest.mark.parametrize("rule", [GAUSS, NODES], ids=["gauss", "nodes"])


def sampled(profile, edges: int, edge_mm: float, shift_mm: float, rule=GAUSS) -> ContactLine:
    """A surface with the points of a rule on [-1, 1] under a profile.

    A profile returns pressure (MPa) and gap (mm, negative in contact) at places in mm.
    """
    local, weight = rule
    start = edge_mm * np.arange(edges)[:, None] - shift_mm
    place = np.round(start + 0.5 * edge_mm * (1 + local), 12)
    length = np.broadcast_to(0.5 * edge_mm * weight, place.shape)
    pressure, gap = profile(place)
    return ContactLine(pressure * length, length, place, gap)


def penetrating(pressure, gap):
    """The profile of a penalty of 50 MPa/mm."""
    return lambda x: (pressure(x), np.where(pressure(x) > 0, -pressure(x) / 50.0, gap(x)))


def hertz(half_width_mm: float):
    """A parabola pressed on (Johnson, 1985, section 4.2)."""

    def pressure(x):
        return 0.05 * np.sqrt(np.maximum(0.0, 1 - (x / half_width_mm) ** 2))

    def gap(x):
        t = np.maximum(1.0, np.abs(x / half_width_mm))
        return 0.1 * (t * np.sqrt(t**2 - 1) - np.arccosh(t))

    return penetrating(pressure, gap)


def quartic(half_width_mm: float):
    """A flatter shape, like x⁴: p ~ √(1 − t²) (t² + ½), and outside dg/dt ~ √(t² − 1) (t² + ½)."""

    def pressure(x):
        t = x / half_width_mm
        return 0.05 * np.sqrt(np.maximum(0.0, 1 - t**2)) * (t**2 + 0.5)

    def gap(x):
        t = np.maximum(1.0, np.abs(x / half_width_mm))
        return 0.1 * (t * np.sqrt(t**2 - 1) * (2 * t**2 + 1) - 3 * np.arccosh(t))

    return penetrating(pressure, gap)


def double(inner_mm: float, outer_mm: float):
    """Two crests, like x⁴ − c x², that touch on inner < |x| < outer: Hertz' gap in t = x²."""
    middle, half = 0.5 * (outer_mm**2 + inner_mm**2), 0.5 * (outer_mm**2 - inner_mm**2)
    one = hertz(half)

    def profile(x):
        pressure, gap = one(x**2 - middle)
        return np.abs(x) * pressure, gap

    return profile


def uniform(half_width_mm: float, power: float):
    """The same pressure everywhere, and a gap like that power of the distance from it."""

    def gap(x):
        return 0.1 * np.maximum(0.0, np.abs(x) - half_width_mm) ** power

    return penetrating(lambda x: np.where(np.abs(x) < half_width_mm, 0.05, 0.0), gap)


def true_length(profile) -> float:
    """Length nearer than the tolerance, from a million places."""
    return 5.0 * float(np.mean(profile(np.linspace(-2.5, 2.5, 1_000_000))[1] < TOUCHING_MM))


def worst_error(profile, points: int, rule=NODES) -> float:
    """Largest error of the length, as a share of it, over where the points happen to lie.

    ``points`` of them lie in the length, half a point more or less.
    """
    exact = true_length(profile)
    rng = np.random.default_rng(points)
    per_edge = 2 if rule is NODES else len(rule[0])
    errors = []
    for _ in range(200):
        edge = per_edge * exact / (points + rng.uniform(-0.5, 0.5))
        edges = int(5 / edge) + 3
        line = sampled(profile, edges, edge, 2.5 + (1 + rng.random()) * edge, rule)
        errors.append(abs(line.contact_length() / exact - 1))
    return max(errors)


@pytest.mark.parametrize("points", [5, 10])
@pytest.mark.parametrize(
    ("profile", "at_five", "at_ten"),
    [
        (hertz(0.8), 0.025, 0.006),
        (quartic(0.8), 0.13, 0.035),
        (uniform(0.8, 1.5), 1e-5, 1e-5),
        # Ends that are not of round bodies.
        (uniform(0.8, 1.0), 0.15, 0.06),
        (uniform(0.8, 2.0), 0.15, 0.06),
    ],
    ids=["hertz", "quartic", "uniform", "uniform, wedge", "uniform, cusp"],
)
def test_the_length_of_contact_between_points(profile, at_five, at_ten, points):
    assert worst_error(profile, points) < (at_five if points == 5 else at_ten)


@RULES
@pytest.mark.parametrize("profile", [hertz(0.8), quartic(0.8)], ids=["hertz", "quartic"])
def test_the_length_converges_with_the_square_of_the_spacing(rule, profile):
    assert worst_error(profile, 32, rule) < 0.35 * worst_error(profile, 16, rule)


def test_two_contacts_add_up():
    # Two of 1 mm, at ten and at twenty points each.
    assert worst_error(double(0.4, 1.4), 20) < 0.02
    assert worst_error(double(0.4, 1.4), 40) < 0.006


@pytest.mark.parametrize("half_width", [0.02, 0.05, 0.09])
def test_a_single_closed_point_is_less_than_half_a_spacing_wrong(half_width):
    line = sampled(hertz(half_width), 20, 0.2, 2.0, NODES)  # points 0.1 mm apart, one at 0
    assert line.contact_length() == pytest.approx(true_length(hertz(half_width)), abs=0.05)


def line_of_gaps(*gaps: float) -> ContactLine:
    """Points 0.1 mm apart; those that overlap bear load."""
    points = np.array([gaps])
    return ContactLine(
        (points < 0).astype(float), 0 * points, 0.1 * np.arange(points.size)[None], points
    )


def test_a_gap_too_small_to_tell_counts_as_none():
    assert line_of_gaps(1.0, 0.001, -1e-4, 0.002, 1.0).contact_length() > 0.2
    assert line_of_gaps(1.0, 0.1, 0.006, 0.1, 1.0).contact_length() == 0.0


def test_what_bears_no_load_does_not_touch():
    assert line_of_gaps(1.0, 0.001, 0.0, 0.002, 1.0).contact_length() == 0.0


def test_between_two_contacts_a_lone_open_point_stands_for_its_own_length():
    ends = line_of_gaps(-1e-4, 0.02, 0.1).contact_length()
    line = line_of_gaps(0.1, 0.02, -1e-4, 0.01, -1e-4, 0.02, 0.1)
    assert line.contact_length() == pytest.approx(2 * ends + 0.1, rel=1e-12)


def consistent_forces(pressure, ends):
    """Forces (2m + 1,) of a pressure on the quadratic shape functions between places (m + 1,)."""
    point, weight = np.polynomial.legendre.leggauss(8)
    shape, _ = edge_shapes(3, 0.5 * (point + 1))
    force = np.zeros(2 * len(ends) - 1)
    for edge, (a, b) in enumerate(pairwise(ends)):
        load = 0.5 * (b - a) * weight * pressure(a + 0.5 * (b - a) * (point + 1))
        force[[2 * edge, 2 * edge + 2, 2 * edge + 1]] += load @ shape
    return force


@given(lengths=st.lists(st.floats(0.05, 0.5), min_size=2, max_size=9))
def test_a_uniform_traction_is_recovered_on_edges_of_any_length(lengths):
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    force = consistent_forces(lambda x: np.full_like(x, 0.03), ends)
    np.testing.assert_allclose(recovered_traction(force, np.diff(ends)), 0.03, rtol=1e-12)


@given(forces=st.lists(st.floats(0.0, 1.0), min_size=5, max_size=21).filter(lambda f: len(f) % 2))
def test_the_recovered_traction_adds_up_to_the_force(forces):
    force = np.array(forces)
    length = np.linspace(0.1, 0.3, len(force) // 2)
    traction = recovered_traction(force, length)
    assert np.sum(traction[1::2] * length) == pytest.approx(force.sum(), abs=1e-12)


def test_the_error_of_a_recovered_traction_is_of_second_order():
    def error(edges):
        ends = np.linspace(0.0, 2.0, edges + 1)
        force = consistent_forces(lambda x: 0.05 * np.sin(2 * x) ** 2, ends)
        nodes = np.linspace(0.0, 2.0, 2 * edges + 1)
        traction = recovered_traction(force, np.diff(ends))
        return np.abs(traction - 0.05 * np.sin(2 * nodes) ** 2)[2:-2].max()

    assert 0 < error(40) < 0.28 * error(20) < 0.08 * error(10)


def test_forces_that_do_nothing_to_linear_displacements_are_no_traction():
    alternating = np.array([-0.5, 1.0, -1.0, 1.0, -1.0, 1.0, -0.5])
    np.testing.assert_allclose(recovered_traction(alternating, np.full(3, 0.2)), 0.0, atol=1e-15)


def test_nothing_touches():
    nothing = sampled(lambda x: (np.zeros_like(x), np.ones_like(x)), 10, 0.3, 0.0)
    assert nothing.contact_length() == 0.0
    assert nothing.highest_window() == 0.0
    assert nothing.top_two_edges() == 0.0


def test_pressure_everywhere_is_length_everywhere():
    line = sampled(uniform(9.0, 1.5), 10, 0.3, 0.0, NODES)
    assert line.contact_length() == pytest.approx(3.0, rel=1e-12)
    assert line.highest_window() == pytest.approx(0.05)
    assert line.top_two_edges() == pytest.approx(0.05)


def test_the_window_is_the_mean_of_the_profile_over_it():
    inside = np.linspace(-0.25, 0.25, 20_001)
    expected = np.trapezoid(hertz(0.8)(inside)[0], inside) / 0.5
    line = sampled(hertz(0.8), 60, 0.1, 3.02)
    assert line.highest_window() == pytest.approx(expected, rel=0.002)


def test_the_two_highest_edges():
    pressure = np.array([[0.01] * 4, [0.05] * 4, [0.03] * 4])
    length = np.full((3, 4), 0.1)
    place = np.cumsum(length).reshape(length.shape)
    line = ContactLine(pressure * length, length, place, np.full((3, 4), -1e-3))
    assert line.top_two_edges() == pytest.approx(0.04)


def test_both_windows_of_a_fine_mesh_agree():
    line = sampled(hertz(0.8), 200, 0.02, 2.0, NODES)
    assert line.recovered_window() == pytest.approx(line.highest_window(), rel=2e-3)


def test_the_recovered_window_of_a_coarse_mesh_holds_the_same_force():
    line = sampled(hertz(0.8), 10, 0.9, 4.05, NODES)
    assert line.recovered_window(6.0) == pytest.approx(line.highest_window(6.0), rel=1e-3)
    assert line.recovered_window() < 0.85 * line.highest_window()


def test_nothing_that_presses_has_no_recovered_window():
    line = sampled(penetrating(np.zeros_like, np.ones_like), 4, 0.3, 0.6, NODES)
    assert line.recovered_window() == 0.0
    whole = sampled(hertz(0.2), 1, 0.4, 0.2, NODES)
    assert whole.recovered_window() == pytest.approx(whole.load.sum() / 0.4)
