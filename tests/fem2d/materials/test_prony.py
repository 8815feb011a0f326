"""The scalar law of viscosity against its closed forms, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.materials.material import MaterialError
from fem2d.materials.prony import PronySeries

SERIES = PronySeries((0.6, 0.25), (0.05, 1.5))


def test_the_recurrence_is_exact_while_the_stress_grows_evenly():
    duration = 0.7
    time = np.linspace(0, duration, 200_001)
    decay, gain = SERIES.recurrence(duration)
    tau, beta = np.array(SERIES.relaxation_s)[:, None], np.array(SERIES.overstress)[:, None]
    # Q(Δ) = Q₀ e + ∫ β exp(−(Δ − s)/τ) S′ ds with S′ = (S₁ − S₀)/Δ.
    memory = np.trapezoid(beta * np.exp(-(duration - time) / tau), time, axis=1) / duration
    np.testing.assert_allclose(gain, memory, rtol=1e-8)
    np.testing.assert_allclose(decay, np.exp(-duration / tau[:, 0]), rtol=1e-15)


def test_a_sudden_step_keeps_everything_and_an_endless_one_nothing():
    decay, gain = SERIES.recurrence(1e-12)
    np.testing.assert_allclose(decay, 1.0, atol=1e-10)
    np.testing.assert_allclose(gain, SERIES.overstress, rtol=1e-10)
    decay, gain = SERIES.recurrence(1e12)
    assert decay.max() == 0.0 and gain.max() < 1e-11


@pytest.mark.parametrize(
    ("overstress", "relaxation_s", "named"),
    [
        ((), (), "overstress has 0 terms"),
        ((0.5,), (0.1, 1.0), "1 terms and relaxation_s 2"),
        ((0.5, -0.1), (0.1, 1.0), r"overstress = \[0.5, -0.1\]"),
        ((0.5,), (0.0,), r"relaxation_s = \[0.0\]"),
        ((float("nan"),), (1.0,), "overstress"),
    ],
)
def test_what_is_no_series_is_refused(overstress, relaxation_s, named):
    with pytest.raises(MaterialError, match=named):
        PronySeries(overstress, relaxation_s)
