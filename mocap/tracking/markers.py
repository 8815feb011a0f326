"""What a marker file holds: markers by body, their distances, camera constants.

The first marker of a body is its origin. A body with a single marker has no rotation. Pixels count
from the centre of the upper left pixel, x to the right, y down.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from geometry2d.foundation.errors import DrinksimError
from mocap.stickers.codes import BAR_MM, CODED_MARKERS
from mocap.video.lens import Distortion

DEFAULT_BODIES = {
    "head": ("ear", "nose"),
    "package": ("package_lower", "package_upper"),
    "jaw": ("jaw_front", "jaw_back"),
}


class MarkerFileError(DrinksimError):
    """A marker file that cannot be used."""


@dataclass(frozen=True, kw_only=True)
class Intrinsics(Distortion):
    """Camera constants by OpenCV's names.

    Attributes
    ----------
    fx, fy
        Focal lengths, px; None if not known.
    cx, cy
        Where the camera's axis meets the picture, px; None: the middle of the picture.
    readout_s
        Time from the exposure of the first row to that of the last, s: of a rolling shutter.
    """

    fx: float | None = None
    fy: float | None = None
    cx: float | None = None
    cy: float | None = None
    readout_s: float = 0.0


@dataclass(frozen=True)
class PlanePoints:
    """Four points of the plane of motion in the picture (px) and in the world (mm, y up)."""

    image_px: tuple[tuple[float, float], ...]
    world_mm: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class StylePoints:
    """Upper lip and ends of the neck's rim in the first used frame, px."""

    upper_lip: tuple[float, float]
    rim_lower: tuple[float, float]
    rim_upper: tuple[float, float]


@dataclass(frozen=True)
class PrintedStickers:
    """How the coded stickers came out of the printer.

    Attributes
    ----------
    bar_mm, bar_sigma_mm
        Measured length of the sheet's bar, drawn 100 mm long, and its standard error, mm.
    """

    bar_mm: float = BAR_MM
    bar_sigma_mm: float = 0.0

    @property
    def stretch(self) -> float:
        """Printed length over drawn length."""
        return self.bar_mm / BAR_MM


@dataclass(frozen=True)
class Depths:
    """How far away the camera is, and marks nearer to it than the package's.

    Attributes
    ----------
    camera_mm
        Distance of the camera from the moving body's first two marks, mm, along its axis.
    nearer_mm
        By how much marks are nearer to the camera than those, mm.
    sigma_mm
        Standard error of each of these depths, mm.
    """

    camera_mm: float
    nearer_mm: Mapping[str, float]
    sigma_mm: float = 5.0

    def known(self, pair: tuple[str, ...]) -> bool:
        """Whether the depths of all these marks are stated."""
        return all(name in self.nearer_mm for name in pair)

    def farther(self, pair: tuple[str, ...]) -> dict[str, float]:
        """Return depths of all stated marks over the geometric mean of those of two of them."""
        away = {name: self.camera_mm - nearer for name, nearer in self.nearer_mm.items()}
        mean = math.sqrt(away[pair[0]] * away[pair[1]])
        return {name: depth / mean for name, depth in away.items()}


@dataclass(frozen=True)
class MarkerFile:
    """A checked marker file.

    Attributes
    ----------
    path
        The file.
    scale_mm, scale_sigma_mm
        Distance between the first two markers of a body as the camera sees it, parallel to the
        picture, and its standard error, mm, by body.
    lens
        Camera constants.
    positions_px
        Approximate position in the first used frame, px, by marker; None if it is to be located.
    bodies
        Markers by body.
    moving, reference
        The body whose motion is wanted, and the body from which it is seen.
    polarity
        "dark", "light", "ring" or "auto".
    plane, style
        Optional points of the plane of motion, and of lip and rim.
    rendered
        Whether the recording is rendered and not filmed.
    coded
        Markers that are coded stickers.
    printed
        How these were printed.
    depth
        Stated depths of marks; None if there are none.
    """

    path: Path
    scale_mm: Mapping[str, float]
    scale_sigma_mm: Mapping[str, float]
    lens: Intrinsics
    positions_px: Mapping[str, tuple[float, float] | None]
    bodies: Mapping[str, tuple[str, ...]]
    moving: str
    reference: str
    polarity: str
    plane: PlanePoints | None
    style: StylePoints | None
    rendered: bool
    coded: frozenset[str] = frozenset()
    printed: PrintedStickers = PrintedStickers()
    depth: Depths | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """All markers, in the order of the file."""
        return tuple(self.positions_px)

    @property
    def rigid_bodies(self) -> tuple[tuple[str, ...], ...]:
        """Markers of the two bodies whose motion is measured, which keep their distances."""
        return self.bodies[self.reference], self.bodies[self.moving]

    def has_sticker(self, body: str) -> bool:
        """Whether a body carries a coded sticker."""
        return any(name in self.coded for name in self.bodies[body])

    def body_of(self, marker: str) -> str | None:
        """Return the body of a marker, None if it has none."""
        return next((name for name, members in self.bodies.items() if marker in members), None)


def unsaid_markers(name: str, bodies: Mapping[str, tuple[str, ...]]) -> MarkerFile:
    """Return a marker file that names bodies with their markers, and says nothing else of them.

    ``name`` stands in messages for the file that there is none of.
    """
    return MarkerFile(
        path=Path(name),
        scale_mm={},
        scale_sigma_mm={},
        lens=Intrinsics(),
        positions_px=dict.fromkeys(each for members in bodies.values() for each in members),
        bodies=bodies,
        moving="package",
        reference="head",
        polarity="auto",
        plane=None,
        style=None,
        rendered=False,
    )


def markers_of_stickers(names: Iterable[str]) -> MarkerFile:
    """Return what a marker file would say of a film with these coded stickers and no dots.

    Raises
    ------
    MarkerFileError
        If head or package carries none of them.
    """
    found = [name for name in CODED_MARKERS if name in set(names)]
    bodies = {
        body: tuple(name for name in members if name in found)
        for body, members in DEFAULT_BODIES.items()
        if any(name in found for name in members)
    }
    for body in ("head", "package"):
        if body not in bodies:
            seen = f"only {', '.join(found)}" if found else "none"
            wanted = " or ".join(DEFAULT_BODIES[body])
            raise MarkerFileError(
                f"no coded sticker of the {body} ({wanted}) is seen in the film ({seen}): give "
                "--markers FILE with the positions of its dots, or print stickers with 'drinksim "
                "stickers'"
            )
    return replace(unsaid_markers("stickers", bodies), coded=frozenset(found))
