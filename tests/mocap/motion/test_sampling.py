"""Motions sampled from their standard errors have these errors, correlated in time."""

import numpy as np
import pytest

from mocap.motion.errors import MotionError
from mocap.motion.motion import Motion
from mocap.motion.sampling import correlated_noise, sampled_motion
from tests.support.approach import approach

TIMES = np.linspace(0.0, 2.0, 41)
MANY = 3000


def noise(constant_share):
    random = np.random.default_rng(3)
    return correlated_noise(TIMES, MANY, random, correlation_s=0.1, constant_share=constant_share)


@pytest.mark.parametrize("constant_share", [0.0, 0.5, 1.0])
def test_noise_has_unit_variance_at_every_instant(constant_share):
    variance = noise(constant_share).var(axis=1)
    assert np.all(np.abs(variance - 1.0) < 4.0 * np.sqrt(2.0 / MANY))


@pytest.mark.parametrize("constant_share", [0.0, 0.5])
def test_noise_is_correlated_as_stated(constant_share):
    found = np.corrcoef(noise(constant_share))
    lag = np.subtract.outer(TIMES, TIMES)
    stated = constant_share + (1 - constant_share) * np.exp(-0.5 * (lag / 0.1) ** 2)
    assert np.max(np.abs(found - stated)) < 5.0 / np.sqrt(MANY)


@pytest.mark.slow
def test_a_sampled_motion_is_as_far_from_the_measured_one_as_its_standard_errors_say():
    motion = approach()
    random = np.random.default_rng(1)
    sampled = [sampled_motion(motion, random) for _ in range(400)]
    away = np.array([m.relative_mm - motion.relative_mm for m in sampled])
    turn = np.array([m.relative_rad - motion.relative_rad for m in sampled])
    assert away.std(axis=0) == pytest.approx(motion.sigma[:, :2], rel=0.2)
    assert turn.std(axis=0) == pytest.approx(motion.sigma[:, 2], rel=0.2)


def test_a_sampled_motion_is_as_smooth_as_errors_of_a_spline():
    motion = approach()
    sampled = sampled_motion(motion, np.random.default_rng(2))
    error = (sampled.relative_mm - motion.relative_mm) / motion.sigma[:, :2]
    step = np.diff(error, axis=0)
    assert np.abs(step).max() < 2.5 * np.diff(motion.time_s)[0] / 0.1


def test_the_same_seed_gives_the_same_motion():
    first, second = (sampled_motion(approach(), np.random.default_rng(5)) for _ in range(2))
    assert first == second


def test_a_motion_without_standard_errors_is_refused():
    motion = approach()
    unknown = Motion.of(motion.time_s, motion.relative_mm, motion.relative_rad)
    with pytest.raises(MotionError, match="no standard errors to draw from"):
        sampled_motion(unknown, np.random.default_rng(1))
