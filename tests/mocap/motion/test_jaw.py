"""The opening of the jaw from its marks, and how little they tell."""

from __future__ import annotations

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from mocap.motion.jaw import SLIDING_MM, JawOpening
from mocap.motion.poses import Poses

N = 5
NODDING = np.linspace(0.0, 0.3, N)


def poses(body: str, angle_rad: np.ndarray, sigma_rad: float, *, turns: bool = True) -> Poses:
    covariance = np.zeros((N, 3, 3))
    covariance[:, 2, 2] = sigma_rad**2
    return Poses(
        body, ("a", "b"), np.zeros((N, 2)), angle_rad, covariance, np.zeros((N, 3, 3)),
        np.zeros(N), 0.01, turns, 0.0,
    )  # fmt: skip


def captured(jaw: Poses | None):
    motion = SimpleNamespace(
        head_body=SimpleNamespace(name="head"), head_rad=NODDING, time_s=np.arange(N) / 25.0
    )
    return SimpleNamespace(
        frame=np.arange(3, 3 + N),
        motion=motion,
        poses={"head": poses("head", NODDING, 0.003)},
        others={} if jaw is None else {"jaw": jaw},
    )


def test_a_jaw_that_turns_clockwise_on_a_nodding_head_opens(tmp_path):
    opened = np.radians([0.0, 1.0, 4.0, 8.0, 8.0])
    found = JawOpening.of(captured(poses("jaw", NODDING - opened + 0.1, 0.004)), 25.0)
    assert found is not None
    np.testing.assert_allclose(found.opening_rad, opened, atol=1e-15)
    sliding = np.sqrt(2) * SLIDING_MM / 25.0
    assert found.sigma_rad[0] == 0.0
    np.testing.assert_allclose(found.sigma_rad[1:], np.hypot(sliding, 0.005), rtol=1e-12)
    found.write(tmp_path / "jaw.csv")
    with (tmp_path / "jaw.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["frame"] for row in rows] == ["3", "4", "5", "6", "7"]
    assert float(rows[3]["opening_deg"]) == pytest.approx(8.0)
    assert float(rows[3]["sigma_deg"]) == pytest.approx(np.degrees(found.sigma_rad[3]), abs=1e-4)


@pytest.mark.parametrize("jaw", [None, poses("jaw", NODDING, 0.004, turns=False)])
def test_without_two_marks_nothing_is_known(jaw):
    assert JawOpening.of(captured(jaw), 25.0) is None
