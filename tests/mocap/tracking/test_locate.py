"""Markers are taken where a user points, and hair is not taken for one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mocap.tracking.errors import TrackingError
from mocap.tracking.locate import locate_markers
from mocap.tracking.marker_file import read_markers
from mocap.video.channels import Pixels

DOTS = {
    "ear": (60, 80),
    "nose": (200, 84),
    "package_lower": (300, 170),
    "package_upper": (300, 130),
}
JAW = (150, 180)


def face_with_beard(*, dot_in_beard: bool, hairs: int = 700, seed: int = 3) -> np.ndarray:
    """Return a face with dots, and a beard around the place of the jaw's marker."""
    import cv2

    rng = np.random.default_rng(seed)
    image = np.full((260, 360), 170, np.uint8)
    for _ in range(hairs):
        root = rng.uniform([95, 135], [205, 225])
        tip = root + rng.normal(size=2) * [4.0, 4.0] + [-2.0, 7.0]
        ends = [tuple(int(v) for v in np.rint(16 * end)) for end in (root, tip)]
        cv2.line(image, *ends, 60, 1, cv2.LINE_AA, 4)
    for place in (*DOTS.values(), *([JAW] if dot_in_beard else [])):
        cv2.circle(image, place, 5, 25, -1, cv2.LINE_AA)
    image = cv2.GaussianBlur(image, (0, 0), 0.7).astype(float)
    return np.clip(np.rint(image + rng.standard_normal(image.shape)), 0, 255).astype(np.uint8)


def marker_file(folder: Path, **others: tuple[int, int]) -> Path:
    file = folder / "markers.toml"
    places = {**DOTS, **others}
    lines = [f"{name} = [{x + 3}, {y - 2}]" for name, (x, y) in places.items()]
    text = "[scale]\npackage = 20.0\nhead = 104.0\n\n[markers]\n" + "\n".join(lines) + "\n"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("dot", [False, True])
@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_beard_is_not_taken_for_a_marker(tmp_path: Path, dot: bool, seed: int) -> None:
    """A dot in a beard is found, or refused in words: nothing beside it is taken."""
    image = face_with_beard(dot_in_beard=dot, seed=seed)
    markers = read_markers(marker_file(tmp_path, jaw_front=JAW))
    try:
        found = locate_markers(Pixels(image), markers, 0)
    except TrackingError as error:
        assert str(error).startswith("jaw_front: ")
    else:
        assert dot
        assert np.hypot(found["jaw_front"].x - JAW[0], found["jaw_front"].y - JAW[1]) < 1.5


def test_the_other_markers_of_a_bearded_face_are_found(tmp_path: Path) -> None:
    found = locate_markers(
        Pixels(face_with_beard(dot_in_beard=False)), read_markers(marker_file(tmp_path)), 0
    )
    for name, place in DOTS.items():
        assert np.hypot(found[name].x - place[0], found[name].y - place[1]) < 0.1
