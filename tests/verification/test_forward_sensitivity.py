"""Derivatives of a frictional path by a neck's radius: implicit ones are those of differences."""

import numpy as np
import pytest

from benchmarks.forward_sensitivity import derivatives, differences, model_of

RADIUS_MM = 0.6


@pytest.mark.slow
def test_forward_sensitivities_are_the_differences_of_whole_paths() -> None:
    found = derivatives(model_of, RADIUS_MM)
    wanted = differences(model_of, RADIUS_MM, 1e-5)
    scale = np.abs(wanted).max(axis=0)
    assert np.all(scale > 1e-3)  # MPa, N and N for each mm of radius
    away = np.abs(found.slopes - wanted) / scale
    assert away.mean(axis=0).max() < 1e-4
    assert away.max() < 2e-3
