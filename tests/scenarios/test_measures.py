"""Measures of a contact on pressure profiles whose answers are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.measures import ContactLine

GAUSS = np.polynomial.legendre.leggauss(4)
NODES = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3
RULES = pytest.mark.parametrize("rule", [GAUSS, NODES], ids=["gauss", "nodes"])


def sampled(pressure, edges: int, edge_mm: float, shift_mm: float, rule=GAUSS) -> ContactLine:
    """A surface with the points of a rule on [-1, 1] under ``pressure`` (MPa at a place in mm)."""
    local, weight = rule
    start = edge_mm * np.arange(edges)[:, None] - shift_mm
    place = np.round(start + 0.5 * edge_mm * (1 + local), 12)
    length = np.broadcast_to(0.5 * edge_mm * weight, place.shape)
    return ContactLine(pressure(place) * length, length, place)


def hertz(half_width_mm: float):
    return lambda x: 0.05 * np.sqrt(np.maximum(0.0, 1 - (x / half_width_mm) ** 2))


def flat(half_width_mm: float):
    return lambda x: 0.05 * np.sqrt(np.maximum(0.0, 1 - (x / half_width_mm) ** 4))


@RULES
@given(shift=st.floats(3.0, 3.3), half_width=st.floats(0.4, 1.5))
def test_the_length_of_a_hertzian_contact_is_exact(rule, shift, half_width):
    edge = 0.3
    line = sampled(hertz(half_width), 24, edge, shift, rule)
    assert line.contact_length() == pytest.approx(2 * half_width, abs=1e-9)


@RULES
@given(shift=st.floats(3.0, 3.3), half_width=st.floats(0.4, 1.5))
def test_the_length_of_a_flat_contact_is_better_than_its_points(rule, shift, half_width):
    edge = 0.3
    line = sampled(flat(half_width), 24, edge, shift, rule)
    assert line.contact_length() == pytest.approx(2 * half_width, abs=0.35 * edge)


@RULES
def test_the_length_converges_with_the_mesh(rule):
    def worst(edge):
        shifts = np.linspace(3.0, 3.0 + edge, 40)
        lines = [sampled(flat(0.8), int(7 / edge), edge, shift, rule) for shift in shifts]
        return max(abs(line.contact_length() - 1.6) for line in lines)

    assert worst(0.1) < 0.5 * worst(0.3)


@RULES
def test_two_contacts_add_up(rule):
    two = sampled(lambda x: hertz(0.6)(x) + hertz(0.4)(x - 2.5), 40, 0.2, 3.05, rule)
    assert two.contact_length() == pytest.approx(2.0, abs=0.05)


def test_nothing_touches():
    nothing = sampled(np.zeros_like, 10, 0.3, 0.0)
    assert nothing.contact_length() == 0.0
    assert nothing.highest_window() == 0.0
    assert nothing.top_two_edges() == 0.0


def test_pressure_everywhere_is_length_everywhere():
    line = sampled(lambda x: np.full_like(x, 0.02), 10, 0.3, 0.0)
    # The surface ends a twelfth of an edge beyond its last point, taken as half of its share.
    assert line.contact_length() == pytest.approx(3.0, abs=0.05 * 0.3)
    assert line.highest_window() == pytest.approx(0.02)
    assert line.top_two_edges() == pytest.approx(0.02)


def test_the_window_is_the_mean_of_the_profile_over_it():
    inside = np.linspace(-0.25, 0.25, 20_001)
    expected = np.trapezoid(hertz(0.8)(inside), inside) / 0.5
    line = sampled(hertz(0.8), 60, 0.1, 3.02)
    assert line.highest_window() == pytest.approx(expected, rel=0.002)


def test_the_two_highest_edges():
    pressure = np.array([[0.01] * 4, [0.05] * 4, [0.03] * 4])
    length = np.full((3, 4), 0.1)
    place = np.cumsum(length).reshape(length.shape)
    assert ContactLine(pressure * length, length, place).top_two_edges() == pytest.approx(0.04)
