"""The force–length law: its values, its smoothness, and that energy, tension, stiffness agree."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.loads.amplitude import LoadError
from fem2d.loads.muscle_law import MuscleFibre

BOTH = MuscleFibre(0.12, passive_share=0.05)
ACTIVE = MuscleFibre(0.1)


def test_the_active_tension_is_the_parabola_within_its_range_and_nothing_far_outside():
    stretch = np.array([0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.4])
    _, tension, _ = ACTIVE.response(stretch, 0.5)
    np.testing.assert_allclose(tension, 0.05 * (1 - 4 * (1 - stretch) ** 2), rtol=1e-14)
    outside = ACTIVE.response([0.2, 0.375, 1.625, 2.0], 1.0)
    assert np.all(outside[1] == 0.0)
    assert np.all(outside[2] == 0.0)


@pytest.mark.parametrize("stretch", [0.45, 0.55, 0.65, 0.9, 1.07, 1.3, 1.45, 1.55])
@pytest.mark.parametrize("law", [ACTIVE, BOTH], ids=["active", "with passive fibres"])
def test_tension_and_stiffness_are_derivatives_of_the_energy(law, stretch):
    h = 1e-5
    energy, tension, slope = law.response([stretch - h, stretch, stretch + h], 0.7)
    assert abs(tension[1]) > 1e-3
    assert abs(slope[1]) > 1e-3
    assert (energy[2] - energy[0]) / (2 * h) == pytest.approx(tension[1], rel=1e-7)
    assert (tension[2] - tension[0]) / (2 * h) == pytest.approx(slope[1], rel=1e-7)


@pytest.mark.parametrize("end", [0.375, 0.6, 1.4, 1.625])
def test_nothing_jumps_where_two_pieces_of_the_curve_meet(end):
    h = 1e-9
    before, after = (np.array(ACTIVE.response(s, 1.0)) for s in (end - h, end + h))
    np.testing.assert_allclose(before, after, atol=1e-8)


def test_passive_fibres_are_slack_when_short_and_go_on_straight_when_long():
    passive = MuscleFibre(0.1, passive_share=0.05)
    _, tension, slope = passive.response([0.7, 1.0, 1.2, 1.5, 1.7], 0.0)
    assert tension[0] == tension[1] == 0.0
    assert tension[2] == pytest.approx(0.1 * 0.05 * (np.exp(6.6 * 0.2) - 1), rel=1e-13)
    assert slope[3] == slope[4] > 0
    assert tension[4] - tension[3] == pytest.approx(0.2 * slope[3], rel=1e-12)


def test_without_activation_and_passive_share_a_fibre_does_nothing_at_all():
    for values in ACTIVE.response(np.linspace(0.2, 2.0, 50), 0.0):
        assert np.all(values == 0.0)


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"max_stress_mpa": -0.1}, "max_stress_mpa = -0.1"),
        ({"passive_share": float("nan")}, "passive_share = nan"),
        ({"passive_exponent": 0.0}, "passive_exponent = 0"),
        ({"passive_until": 0.9}, "passive_until = 0.9"),
    ],
)
def test_a_fibre_that_cannot_be_is_refused(changed, what):
    with pytest.raises(LoadError, match=what):
        MuscleFibre(**changed)
