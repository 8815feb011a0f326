"""The look of a marker adapts to motion blur and passing light, and to nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mocap.tracking.detect import Detection
from mocap.tracking.follower import Follower
from mocap.tracking.kalman import KalmanState

SEEN = Detection(
    x=50.0,
    y=40.0,
    covariance=1e-4 * np.eye(2),
    radius=5.0,
    aspect=1.0,
    contrast=-150.0,
    misfit=0.016,
    ring=False,
    parameters=np.zeros(11),
)


def follower(look: Detection = SEEN, speed: float = 0.0) -> Follower:
    state = KalmanState(np.array([50.0, 40.0, speed, 0.0]), 1e-3 * np.eye(4))
    return Follower("ear", "head", state, look)


def test_misfit_of_a_smeared_marker_is_accepted_and_of_a_covered_one_not() -> None:
    smeared, covered = replace(SEEN, misfit=0.055), replace(SEEN, misfit=0.115)
    still, fast = follower(), follower(speed=270.0)
    for one in (still, fast):
        one.predict(1 / 30, 0.0)
    assert fast.resembles(smeared) and not still.resembles(smeared)
    assert not fast.resembles(covered)


def test_a_highlight_that_passes_leaves_the_look_as_it_was() -> None:
    marker = follower()
    for share in np.linspace(0.0, 1.0, 40):
        veiled = replace(SEEN, contrast=-150 + 60 * share, misfit=0.016 + 0.03 * share)
        if marker.resembles(veiled):
            marker.accept(veiled, 0.0)
    assert marker.resembles(SEEN)
    assert marker.appearance.misfit < 0.036


def test_a_marker_under_a_highlight_from_the_start_is_known_without_it() -> None:
    marker = follower(replace(SEEN, contrast=-70.0, misfit=0.1))
    assert not marker.resembles(SEEN) and marker.unveiled(SEEN)
    marker.accept(SEEN, 0.0)
    assert marker.resembles(SEEN) and not marker.resembles(replace(SEEN, misfit=0.1))
    assert not follower(replace(SEEN, contrast=-70.0, misfit=0.1, radius=8.0)).unveiled(SEEN)
