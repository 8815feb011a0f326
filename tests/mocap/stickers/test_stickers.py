"""Coded stickers in drawn pictures and on the printed sheet: corners, errors, names."""

from __future__ import annotations

import numpy as np
import pytest

from geometry2d.rigid import RigidMotion
from mocap.stickers.codes import CODED_MARKERS, SIDES_MM, StickerError, code_of
from mocap.stickers.detect import find_stickers, refit_sticker
from mocap.stickers.fit import PARAMETERS, grey_and_gradient
from mocap.stickers.sheet import PAGE_MM, sheet_figure, write_sheet
from mocap.synthetic.camera import Camera, Lens, Sensor
from mocap.synthetic.rendering import render
from mocap.synthetic.scene import Marker, OutOfPlane, Scene, SceneBody

FOUR = CODED_MARKERS[:4]


def still(x: float, y: float, angle: float) -> RigidMotion:
    return RigidMotion(np.array([0.0, 1.0]), np.full(2, angle), np.tile([x, y], (2, 1)))


def picture(seed: int, side_px: float, gamma: float = 2.2, tilt_deg: float = 20.0):
    """Four stickers of 12 mm in any direction, tilted out of the plane, and their true corners."""
    rng = np.random.default_rng(seed)
    focal = side_px / 12 * 700
    camera = Camera(400, 360, (focal, focal), 700, (0, 0), lens=Lens(blur_px=0.7))
    bodies = []
    for k, name in enumerate(FOUR):
        corner = np.array([[-1, 1], [1, 1], [-1, -1], [1, -1]])[k] * 80 * 12 / side_px
        tilt = np.tile(rng.uniform(-tilt_deg, tilt_deg, 2), (2, 1))
        bodies.append(
            SceneBody(
                name,
                still(*(corner + rng.uniform(-2, 2, 2)), rng.uniform(0, 2 * np.pi)),
                markers=(Marker.coded(name, (0, 0), side_mm=12.0),),
                out_of_plane=OutOfPlane(np.array([0.0, 1.0]), tilt, np.zeros(2)),
            )
        )
    sensor = Sensor(4000, 3, gamma, seed=seed)
    image, _ = next(iter(render(Scene(tuple(bodies)), camera, sensor, [0.5])))
    square = np.array([[-6.0, 6.0], [6, 6], [6, -6], [-6, -6]])
    true = {b.name: camera.project(*b.placed(square, 0.0, 0.5)) for b in bodies}
    return image[..., 1].copy(), true


def test_codes_differ_and_tell_marker_and_size() -> None:
    codes = [code_of(marker, side) for marker in CODED_MARKERS for side in SIDES_MM]
    patterns = {tuple(np.rot90(code.dark, k).ravel()) for code in codes for k in range(4)}
    assert len(patterns) == 4 * len(codes)
    assert all(code.dark[0].all() and code.dark[:, 0].all() for code in codes)
    with pytest.raises(StickerError, match="knee"):
        code_of("knee", 12.0)
    with pytest.raises(StickerError, match="11 mm"):
        code_of("ear", 11.0)


def test_derivatives_of_the_grey_level() -> None:
    rng = np.random.default_rng(0)
    p = np.zeros(PARAMETERS)
    p[:8] = 0.3, 0.05, 0.2, -0.06, 0.28, -0.1, 0.002, -0.003
    p[8:] = 0.3, 0.25, 0.02, 0.7, 0.05, 0.004, -0.002
    dark = code_of("nose", 12.0).dark
    edges, left = np.zeros((3, 2, 6)), np.zeros(PARAMETERS)
    total = np.zeros(PARAMETERS)
    for x, y in rng.uniform(-11, 11, (40, 2)):
        gradient = np.zeros(PARAMETERS)
        grey_and_gradient(p, dark, x, y, gradient, edges)
        for k in range(PARAMETERS):
            step = np.zeros(PARAMETERS)
            step[k] = 1e-6
            ends = [grey_and_gradient(p + s * step, dark, x, y, left, edges) for s in (1, -1)]
            numeric = (ends[0] - ends[1]) / 2e-6
            assert gradient[k] == pytest.approx(numeric, rel=2e-5, abs=2e-4)
        total += np.abs(gradient)
    assert np.all(total > 1.0)


@pytest.mark.parametrize(("side_px", "gamma"), [(18, 2.2), (24, 1.9), (30, 2.5)])
def test_corners_to_a_twentieth_of_a_pixel_with_the_error_they_state(side_px, gamma) -> None:
    errors, scores, missed = [], [], 0
    for seed in range(6):
        image, true = picture(seed, side_px, gamma)
        found = find_stickers(image)
        assert found.keys() <= set(FOUR)
        missed += len(FOUR) - len(found)
        for name, sticker in found.items():
            assert sticker.code.marker == name
            assert sticker.code.side_mm == 12.0
            error = (sticker.corners - true[name]).ravel()
            errors.append(error)
            scores.append(error / np.sqrt(np.diag(sticker.covariance)))
    assert missed <= 1
    assert np.sqrt(np.mean(np.square(errors))) < 0.05
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.7
    assert np.mean(np.abs(scores) < 3) > 0.95


def test_a_sticker_is_refitted_where_it_went() -> None:
    image, _ = picture(1, 24)
    before = find_stickers(image)["ear"]
    moved = np.roll(image, (3, -2), axis=(0, 1))
    after = refit_sticker(moved, before, np.array([-1.2, 2.1]))
    assert after is not None
    assert after.centre == pytest.approx(before.centre + np.array([-2, 3]), abs=0.02)
    assert refit_sticker(moved, before, np.array([40.0, 0.0])) is None


def test_a_partly_covered_sticker_is_not_taken() -> None:
    image, true = picture(2, 24)
    ear = true["ear"]
    low, high = ear.min(axis=0).astype(int), ear.max(axis=0).astype(int)
    image[low[1] : high[1] + 4, low[0] - 4 : (low[0] + high[0]) // 2] = 150
    assert "ear" not in find_stickers(image)


def test_nothing_else_is_a_sticker() -> None:
    import cv2

    rng = np.random.default_rng(3)
    for _ in range(6):
        image = np.full((360, 480), 170, np.uint8)
        for _ in range(60):
            at = tuple(int(v) for v in rng.integers(10, 350, 2))
            size = int(rng.integers(6, 40))
            shade = int(rng.integers(0, 255))
            other = (at[0] + size, at[1] + int(rng.integers(6, 40)))
            cv2.rectangle(image, at, other, shade, -1)
            cv2.circle(image, other, size // 3, 255 - shade, -1)
        cells = rng.integers(0, 2, (10, 10)).astype(np.uint8) * 235 + 10
        image[100:180, 380:460] = np.kron(cells, np.ones((8, 8), np.uint8))
        cv2.putText(image, "SN 4711 [#]", (20, 340), cv2.FONT_HERSHEY_SIMPLEX, 1.2, 10, 3)
        blurred = cv2.GaussianBlur(image, (0, 0), 0.8)
        noise = rng.normal(0, 2, image.shape)
        assert find_stickers(np.clip(blurred + noise, 0, 255).astype(np.uint8)) == {}


@pytest.mark.parametrize("side_px", [18.0, 27.0, 40.0])
def test_a_print_with_one_cell_unlike_a_code_is_no_sticker(side_px: float) -> None:
    import cv2

    rng = np.random.default_rng(int(side_px))
    named = 0
    for row in range(-1, 16):
        dark = code_of("jaw_back", 12.0).dark.copy()
        if row >= 0:
            at = (1 + row // 4, 1 + row % 4)
            dark[at] = ~dark[at]
        light = np.pad(~dark, 2, constant_values=True)
        fine = np.kron(np.where(light, 230, 30), np.ones((24, 24), int)).astype(np.uint8)
        scale = side_px / (6 * 24)
        turn = cv2.getRotationMatrix2D((120.0, 120.0), float(rng.uniform(0, 90)), scale)
        turn[:, 2] += 80 - 120 + rng.uniform(-0.5, 0.5, 2)
        image = cv2.warpAffine(
            cv2.GaussianBlur(fine, (0, 0), 0.6 / scale), turn, (160, 160), borderValue=230
        )
        found = find_stickers(
            np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)
        )
        if row < 0:
            assert set(found) == {"jaw_back"}
        named += row >= 0 and bool(found)
    assert named == 0


@pytest.mark.slow
def test_the_sheet_prints_true_sizes() -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = sheet_figure()
    dpi = 120
    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = np.asarray(canvas.buffer_rgba())[..., 1].copy()
    assert drawn.shape == tuple(round(mm / 25.4 * dpi) for mm in PAGE_MM[::-1])
    row = drawn.shape[0] / 7
    for number, side in enumerate(SIDES_MM):
        top = int((297 - 235 + 42 * number - 15) / 297 * drawn.shape[0])
        found = find_stickers(np.ascontiguousarray(drawn[top : int(top + row)]))
        assert set(found) == set(CODED_MARKERS)
        for sticker in found.values():
            assert sticker.code.side_mm == side
            assert sticker.side_px / dpi * 25.4 == pytest.approx(side, rel=2e-3)


def test_the_sheet_is_written_and_other_names_are_refused(tmp_path) -> None:
    write_sheet(tmp_path / "sheet.pdf")
    assert (tmp_path / "sheet.pdf").read_bytes().startswith(b"%PDF")
    first = (tmp_path / "sheet.pdf").read_bytes()
    write_sheet(tmp_path / "sheet.pdf")
    assert (tmp_path / "sheet.pdf").read_bytes() == first
    with pytest.raises(StickerError, match=r"sheet\.doc"):
        write_sheet(tmp_path / "sheet.doc")
