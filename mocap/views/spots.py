"""A frame with the round spots in it numbered, for a user who says which marker each is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mocap.video.frames import Image
from mocap.views.overlay import BLACK, SEEN, put_text

RADIUS_PX = 14
HEIGHT_OF_TEXT = 720.0
"""Height of a picture, px, in which text has its usual size."""


def numbered_spots(picture: Image, places_px: Sequence[tuple[float, float]]) -> Image:
    """Return a picture with a circle and a number, from 1 on, at each place.

    Parameters
    ----------
    picture
        (height, width, 3): blue, green, red; it is not changed.
    places_px
        (n, 2) centres, px.
    """
    import cv2

    canvas = picture.copy()
    size = max(canvas.shape[0] / HEIGHT_OF_TEXT, 0.8)
    for number, (x, y) in enumerate(places_px, 1):
        centre = round(x), round(y)
        for colour, thickness in ((BLACK, 4), (SEEN, 2)):
            cv2.circle(canvas, centre, round(RADIUS_PX * size), colour, thickness, cv2.LINE_AA)
        at = (x + 1.1 * RADIUS_PX * size, y - 0.8 * RADIUS_PX * size)
        put_text(canvas, str(number), at, 0.8 * size, SEEN)
    return canvas


def write_numbered_spots(
    picture: Image, places_px: Sequence[tuple[float, float]], path: Path
) -> None:
    """Write :func:`numbered_spots` as a PNG file."""
    from PIL import Image as Pillow

    Pillow.fromarray(numbered_spots(picture, places_px)[..., ::-1]).save(path, "PNG")
