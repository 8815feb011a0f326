"""Streaks and passing light: what a plain disc does not explain is fitted, or is in the error."""

from __future__ import annotations

import numpy as np
import pytest

from mocap.tracking.detect import Blob, Detection, fit_blob, refit, tinted
from mocap.tracking.explain import explained
from mocap.tracking.link import Tracker
from mocap.tracking.spot import PARAMETERS, spot_and_gradient
from mocap.tracking.tracks import Tracks
from mocap.video.channels import Pixels

HEIGHT, WIDTH = 120, 260
RADIUS, DARK, LIGHT = 4.8, 35.0, 210.0
FPS = 30.0


def disc(x: float, y: float) -> np.ndarray:
    """Return how much of each pixel a disc with soft edges covers."""
    columns, rows = np.meshgrid(np.arange(WIDTH) - x, np.arange(HEIGHT) - y)
    return np.clip(RADIUS + 0.5 - np.hypot(columns, rows), 0.0, 1.0)


def picture(covered: np.ndarray, veil: np.ndarray | float = 0.0, seed: int = 0) -> np.ndarray:
    """Return dots on a light ground, under light that adds up to white, with noise and blur."""
    import cv2

    level = LIGHT + (DARK - LIGHT) * covered
    level = cv2.GaussianBlur(level * (1 - veil) + 225.0 * veil, (0, 0), 0.8)
    level = level + 1.5 * np.random.default_rng(seed).standard_normal(level.shape)
    return np.clip(np.rint(level), 0, 255).astype(np.uint8)


def streaked(x: float, y: float, path: tuple[float, float]) -> np.ndarray:
    """Return the covered share of an exposure in which a disc moves along a path."""
    instants = np.linspace(-0.5, 0.5, 41)
    return np.mean([disc(x + t * path[0], y + t * path[1]) for t in instants], axis=0)


def band(centre: float) -> np.ndarray:
    """Return how much of the light a highlight's upright band replaces."""
    columns = np.tile(np.arange(WIDTH), (HEIGHT, 1))
    return np.asarray(0.85 * np.exp(-(((columns - centre) / 11.0) ** 2)))


def plain_at(image: np.ndarray, x: float, y: float) -> Detection | None:
    return fit_blob(image, Blob(x, y, RADIUS, DARK - LIGHT))


def test_gradient_of_a_streaked_and_tinted_marker_agrees_with_finite_differences() -> None:
    p = np.array([3.2, -1.1, 0.21, 0.02, 0.17, 6.0, -150.0, 210.0, 0.4, -0.3, 0.45])
    p = np.concatenate([p, [2.1, -0.8, 7.0, -4.0]])
    gradient, unused = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
    largest = np.zeros(PARAMETERS)
    for x, y in ((7.5, 2.0), (4.9, -5.6), (-2.4, 0.3)):
        spot_and_gradient(p, x, y, True, gradient)
        numeric = []
        for k in range(PARAMETERS):
            step = np.zeros(PARAMETERS)
            step[k] = 1e-6
            up = spot_and_gradient(p + step, x, y, True, unused)
            numeric.append((up - spot_and_gradient(p - step, x, y, True, unused)) / 2e-6)
        largest = np.maximum(largest, np.abs(gradient))
        assert gradient == pytest.approx(np.array(numeric), rel=1e-5, abs=1e-5)
    assert np.all(largest > 1e-3)


def test_a_streak_is_told_from_its_path_and_leaves_size_and_place() -> None:
    x, y, path = 130.3, 60.8, np.array([9.0, -6.0])
    image = picture(streaked(x, y, (9.0, -6.0)))
    still = plain_at(picture(disc(x, y)), x, y)
    assert still is not None
    start = still.parameters.copy()
    start[:2] += 2.0, 1.5
    found = explained(image, refit(image, start), start, 2 * path, believed=False)
    assert found is not None
    assert np.hypot(found.x - x, found.y - y) < 0.06
    assert found.radius == pytest.approx(still.radius, rel=0.08)
    assert np.abs(found.parameters[11:13]) == pytest.approx(np.abs(path) / 2, abs=0.6)
    assert not tinted(found)


@pytest.mark.parametrize("away", [-12.0, -9.0, 9.0, 11.0])
def test_the_edge_of_a_highlight_moves_the_centre_no_more_than_stated(away: float) -> None:
    x, y = 130.3, 60.8
    image = picture(disc(x, y), band(x + away))
    still = plain_at(image, x, y)
    assert still is not None and abs(still.x - x) > 0.3
    found = explained(image, still, still.parameters, np.zeros(2), believed=True)
    assert found is not None and tinted(found)
    assert abs(found.x - x) < 0.5 * abs(still.x - x)
    assert abs(found.x - x) < 3 * found.sigma_px and abs(found.y - y) < 3 * found.sigma_px


def test_a_clean_disc_is_a_plain_disc() -> None:
    image = picture(disc(130.3, 60.8))
    still = plain_at(image, 130.3, 60.8)
    assert still is not None
    assert explained(image, still, still.parameters, np.zeros(2), believed=True) is None


def followed(places: np.ndarray, pictures: list[np.ndarray]) -> Tracks:
    """Return the track of one marker through pictures, started at its first place."""
    start = plain_at(pictures[0], *places[0])
    assert start is not None
    better = explained(pictures[0], start, start.parameters, np.zeros(2), believed=True)
    tracker = Tracker(
        starts={"ear": better or start},
        bodies={"head": ("ear",)},
        picture=(HEIGHT, WIDTH),
        polarity="dark",
        fit_near=lambda shown, at, look: None,
    )
    for index, image in enumerate(pictures):
        tracker.process(index, index / FPS, Pixels(image))
    return tracker.tracks()


def test_a_marker_that_sets_off_fast_is_seen_in_every_frame() -> None:
    """It goes from rest to thirteen pixels a frame, the shutter open for two thirds of it."""
    time = np.arange(24) / FPS
    run = np.clip((time - 0.2) / 0.5, 0.0, 1.0)
    places = np.column_stack([40.0 + 150.0 * run**2 * (3 - 2 * run), 60.0 + 0 * time])
    rate = np.gradient(places, axis=0) / 1.5
    pictures = [
        picture(streaked(*place, tuple(step)), seed=k)
        for k, (place, step) in enumerate(zip(places, rate, strict=True))
    ]
    tracks = followed(places, pictures)
    off = np.hypot(*(tracks.of("ear")[0] - places).T)
    assert np.all(tracks.status[:, 0] == "seen")
    assert off.max() < 0.2


def test_a_passing_highlight_is_honest_and_the_marker_returns() -> None:
    time = np.arange(60) / FPS
    places = np.column_stack([130.0 + 3.0 * np.sin(3 * time), 60.0 + 2.0 * np.cos(4 * time)])
    centres = 100.0 + 70.0 * time / time[-1]
    pictures = [
        picture(disc(*place), band(centre), seed=k)
        for k, (place, centre) in enumerate(zip(places, centres, strict=True))
    ]
    tracks = followed(places, pictures)
    seen = tracks.status[:, 0] == "seen"
    assert seen.mean() > 0.75 and seen[:15].all() and seen[-15:].all()
    off, sigma = tracks.of("ear")[0] - places, tracks.of("ear")[1]
    score = np.abs(off / sigma[:, None])[seen]
    assert np.abs(off[seen]).max() < 0.6
    assert np.mean(score < 3) > 0.95
