"""The opening of the jaw from its marks, and how little they tell."""

from __future__ import annotations

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from mocap.motion.errors import MotionError
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


def opening(degrees: np.ndarray, *, fps: float = 25.0) -> JawOpening:
    """Return the openings of frames, degrees, with a standard error of one degree."""
    n = degrees.size
    return JawOpening(
        np.arange(n), np.arange(n) / fps, np.radians(degrees), np.full(n, np.radians(1.0))
    )


def test_what_is_written_is_read(tmp_path):
    written = opening(np.array([0.0, 0.5, 3.25, 8.0]))
    written.write(tmp_path / "jaw.csv")
    read = JawOpening.read(tmp_path / "jaw.csv")
    assert read.frame.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(read.time_s, written.time_s, atol=1e-6)
    np.testing.assert_allclose(read.opening_rad, written.opening_rad, atol=1e-6)
    np.testing.assert_allclose(read.sigma_rad, written.sigma_rad, atol=1e-6)


def test_means_average_noise_and_keep_the_course():
    """A ramp is kept but at its ends, white noise falls with the root of the frames averaged."""
    times, means = opening(np.linspace(0.0, 10.0, 101)).means(0.2)
    np.testing.assert_allclose(np.degrees(means[1:-1]), 10.0 * times[1:-1] / 4.0, atol=0.11)
    assert means[0] == 0.0
    assert np.diff(times).max() <= 0.2 + 1e-12
    noise = np.random.default_rng(5).standard_normal(5000)
    _, averaged = opening(noise).means(0.4)
    assert np.degrees(averaged[1:]).std() == pytest.approx(10**-0.5, rel=0.1)


def test_a_film_slower_than_the_means_keeps_its_frames():
    times, means = opening(np.array([0.0, 2.0, 4.0]), fps=2.0).means(0.25)
    np.testing.assert_allclose(np.degrees(means), [0.0, 2.0, 4.0], atol=1e-12)
    np.testing.assert_allclose(times, [0.0, 0.5, 1.0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("frame,time_s\n0,0.0\n", "lacks opening_deg, sigma_deg"),
        ("frame,time_s,opening_deg,sigma_deg\n0,0.0,0.0,0.0\n1,0.0,1.0,1.0\n", "line 3: time_s"),
        ("frame,time_s,opening_deg,sigma_deg\n0,0.0,wide,0.0\n", "opening_deg = 'wide'"),
    ],
)
def test_another_table_is_refused(tmp_path, text, said):
    (tmp_path / "jaw.csv").write_text(text)
    with pytest.raises(MotionError, match=said):
        JawOpening.read(tmp_path / "jaw.csv")


@pytest.mark.parametrize("jaw", [None, poses("jaw", NODDING, 0.004, turns=False)])
def test_without_two_marks_nothing_is_known(jaw):
    assert JawOpening.of(captured(jaw), 25.0) is None
