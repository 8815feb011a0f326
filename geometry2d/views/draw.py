"""Drawing of heads, necks and meshes on matplotlib axes, with one palette."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
import skfem
from numpy.typing import ArrayLike, NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.anatomy.likeness import cranium, ear
from geometry2d.anatomy.muscles import MuscleRegion, StraightFibres
from geometry2d.neck import NeckSection
from geometry2d.outline import Outline
from geometry2d.regions import Section
from geometry2d.rigid import UNMOVED, RigidPlacement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

Array = NDArray[np.float64]

DRAWING_SPACING_MM = 0.1
NAME_AT_PT = 80
"""Distance of a muscle's name to its right, printer's points."""


@dataclass(frozen=True)
class Palette:
    """Colours of tissues and bodies."""

    dermis: str = "#cf8f77"
    bulk: str = "#f0c9b4"
    bone: str = "#ece5d3"
    bone_edge: str = "#b9ad8f"
    tooth: str = "#fbfaf5"
    tooth_edge: str = "#9a958a"
    face: str = "#f8e9e0"
    profile: str = "#6d4a3d"
    neck: str = "#7f9bb3"
    neck_edge: str = "#3f586e"
    package: str = "#e3ebf1"
    package_edge: str = "#9db0c0"
    mouth: str = "#c9958a"
    mesh: str = "#5a4a44"
    muscle: str = "#a03c35"


PALETTE = Palette()


def draw_head(
    axes: Axes,
    head: HeadSection,
    *,
    face: bool = True,
    tissue: bool = True,
    palette: Palette = PALETTE,
) -> None:
    """Draw a head section: silhouette, bones, teeth and the undeformed tissue.

    Parameters
    ----------
    axes
        The axes; data units are mm.
    head
        The head.
    face
        Whether to draw the silhouette from forehead to neck, and the ear.
    tissue
        Whether to draw the lips; False if a deformed mesh replaces them.
    palette
        Colours.
    """
    if face:
        silhouette = np.concatenate([head.profile, cranium(head.profile)])
        _fill(axes, silhouette, facecolor=palette.face, edgecolor="none", zorder=1)
        _fill(axes, head.mouth, facecolor=palette.mouth, edgecolor="none", zorder=1.5)
        for part in _above_and_below_mouth(head):
            axes.plot(*part.T, color=palette.profile, linewidth=1.0, zorder=6)
        for curve in ear():
            axes.plot(*curve.T, color=palette.profile, linewidth=0.8, zorder=2)
    for jaw in (head.upper_jaw, head.lower_jaw):
        _fill(
            axes, jaw, facecolor=palette.bone, edgecolor=palette.bone_edge, linewidth=0.7, zorder=3
        )
    for tooth in (head.upper_tooth, head.lower_tooth):
        draw_outline(
            axes, tooth, face=palette.tooth, edge=palette.tooth_edge, linewidth=0.8, zorder=2
        )
    if tissue:
        for lip in (head.upper, head.lower):
            draw_section(axes, lip, palette=palette)


def draw_section(axes: Axes, section: Section, *, palette: Palette = PALETTE) -> None:
    """Fill the regions of a section, in order, and draw its boundary."""
    colours = {"dermis": palette.dermis, "bulk": palette.bulk}
    for region, polygon in section.regions.items():
        _fill(
            axes, polygon, facecolor=colours.get(region, palette.bulk), edgecolor="none", zorder=4
        )
    for name, curves in section.boundaries.items():
        if name == "cut":
            continue
        for curve in curves:
            axes.plot(
                *curve.T, color=palette.profile, linewidth=1.0 if name == "skin" else 0.6, zorder=6
            )


def _fill(axes: Axes, points: Array, **style: Any) -> Patch:
    """Fill a polygon (n, 2).

    `Axes.fill` looks for extremes of every side as if it were a curve, which takes most of the time
    of a drawing; those of a polygon are its corners.
    """
    from matplotlib.patches import Polygon

    patch = Polygon(points, closed=True, **style)
    axes.add_artist(patch)
    axes.update_datalim(points)
    axes.autoscale_view()
    return patch


def draw_muscles(
    axes: Axes, muscles: Iterable[MuscleRegion], *, names: bool = True, palette: Palette = PALETTE
) -> None:
    """Fill muscles: with dots where fibres cross the section, with lines where they lie in it.

    Parameters
    ----------
    axes
        The axes; data units are mm.
    muscles
        The muscles, in the frame of the head section.
    names
        Whether to write the name of each muscle beside it.
    palette
        Colours.
    """
    for muscle in muscles:
        in_plane = isinstance(muscle.fibres, StraightFibres)
        patch = _fill(
            axes, muscle.polygon, facecolor=palette.muscle, edgecolor=palette.muscle, alpha=0.55,
            linewidth=0.8, zorder=5,
        )  # fmt: skip
        patch.set_hatch("///" if in_plane else "...")
        if names:
            axes.annotate(
                muscle.name.replace("_", " "),
                shapely.Polygon(muscle.polygon).centroid.coords[0],
                xytext=(NAME_AT_PT, 0),
                textcoords="offset points",
                va="center",
                fontsize=7,
                color=palette.profile,
                arrowprops={"arrowstyle": "-", "color": palette.profile, "linewidth": 0.5},
                zorder=8,
            )


def draw_outline(
    axes: Axes,
    outline: Outline,
    *,
    face: str,
    edge: str,
    placement: RigidPlacement = UNMOVED,
    linewidth: float = 1.0,
    zorder: float = 5.0,
) -> None:
    """Fill an outline at a placement."""
    points = placement.apply(outline.sampled(DRAWING_SPACING_MM))
    _fill(axes, points, facecolor=face, edgecolor=edge, linewidth=linewidth, zorder=zorder)


def draw_neck(
    axes: Axes,
    neck: NeckSection,
    placement: RigidPlacement,
    *,
    package: bool = True,
    palette: Palette = PALETTE,
) -> None:
    """Draw the two walls of a neck at a placement of the neck frame.

    Parameters
    ----------
    axes
        The axes; data units are mm.
    neck
        The neck.
    placement
        Placement of the neck frame in the head frame.
    package
        Whether to draw the package's silhouette behind the walls.
    palette
        Colours.
    """
    if package:
        _fill(
            axes,
            placement.apply(neck.silhouette),
            facecolor=palette.package,
            edgecolor=palette.package_edge,
            linewidth=0.8,
            zorder=0.5,
        )
    for wall in (neck.upper_wall, neck.lower_wall):
        draw_outline(
            axes,
            wall,
            face=palette.neck,
            edge=palette.neck_edge,
            placement=placement,
            linewidth=0.7,
            zorder=7,
        )


def draw_mesh(
    axes: Axes,
    mesh: skfem.MeshTri,
    *,
    displacement: ArrayLike | None = None,
    lines: bool = True,
    palette: Palette = PALETTE,
) -> None:
    """Draw a triangle mesh with subdomains coloured by tissue, moved by nodal displacements.

    Parameters
    ----------
    axes
        The axes; data units are mm.
    mesh
        Straight-sided triangles.
    displacement
        (n, 2) displacement of the mesh's nodes, mm; None: zero.
    lines
        Whether to draw the element edges.
    palette
        Colours.
    """
    from matplotlib.collections import PolyCollection

    points = mesh.p.T if displacement is None else mesh.p.T + np.asarray(displacement, float)
    named: Mapping[str, NDArray[np.int64]] = mesh.subdomains or {"bulk": np.arange(mesh.t.shape[1])}
    for name, elements in named.items():
        colour = palette.dermis if name.endswith("dermis") else palette.bulk
        axes.add_collection(
            PolyCollection(
                points[mesh.t.T[elements]],
                facecolors=colour,
                edgecolors=palette.mesh if lines else colour,
                linewidths=0.2 if lines else 0.7,
                zorder=4,
            )
        )
    axes.autoscale_view()


def _above_and_below_mouth(head: HeadSection) -> list[Array]:
    """Return the profile above and below the gap between the lips, its longest step."""
    step = np.diff(head.profile, axis=0)
    gap = int(np.argmax(np.hypot(step[:, 0], step[:, 1]))) + 1
    return [head.profile[:gap], head.profile[gap:]]
