"""Marker centres: right to a small fraction of a pixel, and the stated error honest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap.synthetic.raster import coverage
from mocap.tracking.detect import Blob, detect, find_blobs, fit_blob
from mocap.tracking.spot import disc_and_gradient

HEIGHT, WIDTH = 48, 66


def drawn(
    x: float,
    y: float,
    *,
    radius: float = 6.0,
    inner: float = 0.0,
    blur: float = 0.7,
    levels: tuple[float, float] = (215.0, 40.0),
    slope: tuple[float, float] = (0.0, 0.0),
    stretch: float = 1.0,
    noise: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """An area-exact blurred disc or ring on a sloping background, grey levels."""
    import cv2

    covered = _disc(x, y, radius, stretch)
    if inner:
        covered = covered - _disc(x, y, inner, stretch)
    columns, rows = np.meshgrid(np.arange(WIDTH) - x, np.arange(HEIGHT) - y)
    image = levels[0] + slope[0] * columns + slope[1] * rows + (levels[1] - levels[0]) * covered
    if blur:
        image = cv2.GaussianBlur(image, (0, 0), blur, borderType=cv2.BORDER_REPLICATE)
    image = image + noise * np.random.default_rng(seed).standard_normal(image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _disc(x: float, y: float, radius: float, stretch: float) -> np.ndarray:
    angle = 2 * np.pi * np.arange(180) / 180
    corners = np.column_stack([radius * stretch * np.cos(angle), radius * np.sin(angle)])
    return np.asarray(coverage(corners + np.array([x, y]), (HEIGHT, WIDTH)), float)


def test_gradient_of_the_model_agrees_with_finite_differences() -> None:
    p = np.array([3.2, -1.1, 0.21, 0.02, 0.17, 6.0, -150.0, 210.0, 0.4, -0.3, 0.45])
    gradient, unused = np.zeros(11), np.zeros(11)
    for ring in (False, True):
        for x, y in ((7.5, 2.0), (4.9, -5.6), (-2.4, 0.3)):
            disc_and_gradient(p, x, y, ring, gradient)
            numeric = []
            for k in range(11):
                step = np.zeros(11)
                step[k] = 1e-6
                up = disc_and_gradient(p + step, x, y, ring, unused)
                down = disc_and_gradient(p - step, x, y, ring, unused)
                numeric.append((up - down) / 2e-6)
            assert np.abs(gradient[:10]).max() > 1.0
            np.testing.assert_allclose(gradient, numeric, rtol=1e-5, atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(
    x=st.floats(28, 38),
    y=st.floats(20, 27),
    radius=st.floats(2.5, 9),
    blur=st.floats(0.45, 1.3),
    dark=st.booleans(),
    stretch=st.floats(1.0, 1.35),
)
def test_clean_centres_are_right_to_a_fiftieth_of_a_pixel(
    x: float, y: float, radius: float, blur: float, dark: bool, stretch: float
) -> None:
    levels = (215.0, 40.0) if dark else (50.0, 220.0)
    image = drawn(x, y, radius=radius, blur=blur, levels=levels, slope=(0.6, -0.4), stretch=stretch)
    found = fit_blob(image, Blob(x + 1.2, y - 0.9, 1.2 * radius, -150.0 if dark else 150.0))
    assert found is not None
    # Rounding to whole grey levels alone moves a small blurred marker by 0.01 px in each direction.
    assert np.hypot(found.x - x, found.y - y) < max(0.02, 3.5 * found.sigma_px)
    assert found.sigma_px < 0.012
    assert found.contrast < 0 if dark else found.contrast > 0
    # Blur moves a curved edge inwards by about blur²/2r, which the model does not follow.
    assert found.radius == pytest.approx(radius * np.sqrt(stretch), abs=0.04 + blur**2 / radius)


def test_rings_are_found_where_their_middle_is() -> None:
    image = drawn(31.37, 22.81, radius=8.0, inner=4.0)
    found = fit_blob(image, Blob(32.0, 22.0, 8.5, -150.0), ring=True)
    assert found is not None
    assert np.hypot(found.x - 31.37, found.y - 22.81) < 0.01


@pytest.mark.parametrize("levels", [(215.0, 40.0), (50.0, 220.0)])
def test_the_middle_of_a_ring_is_not_taken_for_the_ring(levels: tuple[float, float]) -> None:
    image = drawn(31.37, 22.81, radius=6.0, inner=3.0, levels=levels)
    (found,) = detect(image, polarity="ring")
    assert np.hypot(found.x - 31.37, found.y - 22.81) < 0.01
    assert found.radius == pytest.approx(6.0, abs=0.2)
    assert detect(drawn(31.37, 22.81, levels=levels), polarity="ring") == []


def test_no_pixel_locking() -> None:
    """The error does not depend on where in a pixel the centre lies."""
    phases = np.linspace(-0.5, 0.5, 21)
    errors = []
    for phase in phases:
        found = fit_blob(drawn(33.0 + phase, 24.3, radius=5.0, blur=0.5), Blob(33, 24, 5, -150))
        assert found is not None
        errors.append(found.x - 33.0 - phase)
    assert np.ptp(errors) < 0.02


@pytest.mark.parametrize(("noise", "radius"), [(2.0, 6.0), (5.0, 6.0), (3.0, 3.0)])
def test_stated_errors_are_honest_in_white_noise(noise: float, radius: float) -> None:
    rng = np.random.default_rng(4)
    scores = []
    for seed in range(250):
        x, y = 33 + rng.uniform(-0.5, 0.5), 24 + rng.uniform(-0.5, 0.5)
        image = drawn(x, y, radius=radius, noise=noise, seed=seed)
        found = fit_blob(image, Blob(33, 24, radius, -150))
        assert found is not None
        spread = np.sqrt(np.diag(found.covariance))
        scores += [(found.x - x) / spread[0], (found.y - y) / spread[1]]
    size = np.abs(scores)
    assert 0.60 < np.mean(size < 1) < 0.76
    assert 0.91 < np.mean(size < 2) < 0.98


def test_an_edge_or_a_smooth_shade_is_no_marker() -> None:
    edge = np.full((HEIGHT, WIDTH), 200, np.uint8)
    edge[:, 33:] = 60
    shade = np.tile(np.linspace(40, 220, WIDTH), (HEIGHT, 1)).astype(np.uint8)
    assert detect(edge, polarity="auto") == []
    assert detect(shade, polarity="auto") == []


def test_everything_in_a_picture_is_found_with_its_polarity() -> None:
    image = np.full((120, 190), 128, np.uint8)
    image[10:58, 10:76] = drawn(30.2, 24.6)
    image[60:108, 100:166] = drawn(35.8, 21.4, levels=(60.0, 230.0), radius=5.0)
    dark = detect(image, polarity="dark")
    light = detect(image, polarity="light")
    assert any(np.hypot(d.x - 40.2, d.y - 34.6) < 0.05 for d in dark)
    assert any(np.hypot(d.x - 135.8, d.y - 81.4) < 0.05 for d in light)
    assert all(d.contrast < 0 for d in dark)
    assert all(d.contrast > 0 for d in light)


def test_spots_of_a_radius_are_those_of_any_radius_that_have_it() -> None:
    import cv2

    picture = np.full((160, 240), 200, np.uint8)
    for at, radius in (((50, 50), 4), (((120, 60), 9)), ((190, 90), 20), ((70, 120), 10)):
        cv2.circle(picture, at, radius, 40, -1, cv2.LINE_AA)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    every = detect(picture, polarity="dark")
    assert len(every) == 4
    wanted = detect(picture, polarity="dark", radius_px=9.5)
    assert {(s.x, s.y) for s in wanted} >= {(s.x, s.y) for s in every if 8 < s.radius < 12}
    assert not any(s.radius > 19 for s in wanted)
    assert {s.radius for s in detect(picture, polarity="dark", radius_px=20)} >= {
        s.radius for s in every if s.radius > 19
    }


def test_positions_of_a_part_are_those_of_the_whole() -> None:
    image = drawn(30.2, 24.6)
    whole = find_blobs(image, polarity="dark")
    part = find_blobs(image[10:, 12:], polarity="dark", offset=(12, 10))
    assert whole and part
    assert whole[0].x == pytest.approx(part[0].x, abs=0.5)
    assert whole[0].y == pytest.approx(part[0].y, abs=0.5)


def test_a_marker_cut_off_by_the_border_is_not_guessed() -> None:
    assert fit_blob(drawn(2.0, 24.0), Blob(2, 24, 6, -150)) is None


def test_a_few_bright_pixels_that_fix_no_ring_are_none() -> None:
    picture = np.full((17, 17), 12, np.uint8)
    for row, end in enumerate([10, 8, 8, 8, 7, 6, 4, 3]):
        picture[row, :end] = 62
    picture[[1, 7, 9, 10], [8, 7, 10, 14]] = 177, 216, 216, 216
    for polarity in ("ring", "auto"):
        assert detect(picture, polarity=polarity) == []
