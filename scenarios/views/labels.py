"""What the parts of a section are called, written where they are; and a closer look at the rim."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.patheffects import AbstractPathEffect, withStroke
from numpy.typing import NDArray

from geometry2d.rigid import RigidPlacement
from scenarios.results.quantities import IN_NECK_FRAME, LIPS
from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Snapshot, Solution
from scenarios.views.scene import SectionArtists
from scenarios.views.shown import Shown
from scenarios.views.themes import LIGHT, Theme

Array = NDArray[np.float64]

NAMES = {
    "upper_bulk": "upper lip",
    "lower_bulk": "lower lip",
    "upper_tooth": "teeth",
    "upper_jaw": "bone",
    "lower_wall": "neck",
}
"""A region or an outline, and what is written on it."""

MARGIN = 0.06
"""Share of the view along its edges in which nothing is written."""

DERMIS_SHARE = 0.3
"""Where along the upper lip's skin the dermis is named, of what is in view."""

CLOSE_MM = 3.2
"""Half the height of the closer look."""


def halo(theme: Theme) -> list[AbstractPathEffect]:
    """Return what keeps text legible on whatever lies under it."""
    return [withStroke(linewidth=3, foreground=theme.halo)]


class PartLabels:
    """Names of lips, dermis, teeth, bone and neck that follow what they name."""

    def __init__(self, axes: Axes, *, size: float, theme: Theme = LIGHT) -> None:
        around = halo(theme)
        self._axes = axes
        self._texts = {
            part: axes.text(
                0.0, 0.0, name, size=size, color=theme.ink, ha="center", va="center", zorder=9,
                path_effects=around, clip_on=True,
            )
            for part, name in NAMES.items()
        }  # fmt: skip
        self._dermis = axes.annotate(
            "dermis", (0.0, 0.0), xytext=(26, 18), textcoords="offset points", size=size,
            color=theme.ink, zorder=9, path_effects=around, annotation_clip=True,
            arrowprops={"arrowstyle": "-", "color": theme.quiet, "lw": 0.9},
        )  # fmt: skip
        self.artists: list[Artist] = [*self._texts.values(), self._dermis]

    def show(self, snapshot: Snapshot, head: RigidPlacement) -> None:
        """Put every name onto the middle of what is seen of its part; hide those that are not."""
        for part, points in _parts(snapshot).items():
            seen = self._in_view(head.apply(points))
            self._texts[part].set_visible(seen.size > 0)
            if seen.size:
                self._texts[part].set_position(tuple(_middle(seen)))
        skin = snapshot.model.skin["upper"][:, 0]
        seen = self._in_view(head.apply((snapshot.model.nodes + snapshot.displacement)[skin]))
        self._dermis.set_visible(seen.size > 0)
        if seen.size:
            self._dermis.xy = tuple(seen[int(DERMIS_SHARE * (len(seen) - 1))])

    def _in_view(self, points: Array) -> Array:
        (left, right), (bottom, top) = self._axes.get_xlim(), self._axes.get_ylim()
        low = np.array([left, bottom]) + MARGIN * np.array([right - left, top - bottom])
        high = np.array([left + right, bottom + top]) - low
        return points[((points >= low) & (points <= high)).all(axis=1)]


def _parts(snapshot: Snapshot) -> Mapping[str, Array]:
    """Return points (n, 2) of every part to be named that is there, in the head frame."""
    model = snapshot.model
    positions = model.nodes + snapshot.displacement
    found = {}
    for part in NAMES:
        if part in model.region_names:
            of_part = model.region == model.region_names.index(part)
            found[part] = positions[np.unique(model.triangles[of_part])]
        elif part in model.outlines:
            line = model.outlines[part]
            found[part] = snapshot.placement.apply(line) if part in IN_NECK_FRAME else line
        else:
            found[part] = np.zeros((0, 2))
    return found


def _middle(points: Array) -> Array:
    """Return the one of the points (n, 2) that is nearest to their mean: it lies in the part."""
    away = np.hypot(*(points - points.mean(axis=0)).T)
    nearest: Array = points[int(away.argmin())]
    return nearest


@dataclass(frozen=True)
class Closer:
    """The section around the place of the neck that is pressed most, on axes of its own.

    ``outline`` frames on the whole section what is seen closer.
    """

    axes: Axes
    scene: SectionArtists
    place_mm: Array
    outline: Rectangle

    @classmethod
    def on(
        cls,
        axes: Axes,
        whole: Axes,
        solution: Solution,
        shown: Shown,
        limits: tuple[float, float],
        theme: Theme,
    ) -> Closer:
        """Return it on small square axes; ``whole`` are those of the whole section."""
        scene = SectionArtists(
            axes, solution.snapshot(0), shown, limits, band_mm=0.5 * CLOSE_MM, theme=theme
        )
        lip, place = most_pressed_place(solution)
        title = f"pressed most: {lip} lip" if lip else "never pressed"
        axes.text(
            0.03, 0.97, title, size=9, color=theme.ink, ha="left", va="top",
            transform=axes.transAxes, path_effects=halo(theme), zorder=9,
        )  # fmt: skip
        outline = Rectangle(
            (0.0, 0.0), 2 * CLOSE_MM, 2 * CLOSE_MM, fill=False, ec=theme.quiet, lw=1.0, zorder=8
        )
        whole.add_patch(outline)
        return cls(axes, scene, place, outline)

    @property
    def artists(self) -> list[Artist]:
        """What moves, and its frames; that of its axes lies above what moves below it."""
        above = [*self.axes.spines.values(), *self.axes.texts]
        return [self.outline, self.axes.patch, *self.scene.artists, *above]

    def show(self, snapshot: Snapshot, head: RigidPlacement) -> None:
        """Follow the place of the neck, which does not move on it."""
        x, y = head.apply(snapshot.placement.apply(self.place_mm[None]))[0]
        self.axes.set_xlim(x - CLOSE_MM, x + CLOSE_MM)
        self.axes.set_ylim(y - CLOSE_MM, y + CLOSE_MM)
        self.outline.set_xy((x - CLOSE_MM, y - CLOSE_MM))
        self.scene.show(snapshot, head)


def most_pressed_place(solution: Solution) -> tuple[str, Array]:
    """Return the lip that is pressed most in a run, and where (2,) on the neck, in its frame.

    No lip, and the origin of the neck frame, if nothing is ever pressed.
    """
    highest = {lip: solution.contact[lip].fields["pressure_mpa"] for lip in LIPS}
    lip = max(LIPS, key=lambda name: float(highest[name].max()))
    if highest[lip].max() <= 0.0:
        return "", np.zeros(2)
    index, point = np.unravel_index(int(highest[lip].argmax()), highest[lip].shape)
    snapshot = solution.snapshot(int(index))
    model, arc_mm = solution.model, solution.contact[lip].arc_mm
    points = SkinLine(model, model.skin[lip], arc_mm).points(model.nodes + snapshot.displacement)
    place: Array = snapshot.placement.pull_back(points[point])
    return lip, place
