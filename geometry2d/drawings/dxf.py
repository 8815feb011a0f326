"""Closed curves from DXF drawings, in mm, one name per layer.

Lines, arcs, circles and polylines with bulges are exact; ellipses and splines are approximated by
arcs. The library ezdxf reads the format; the extra ``files`` installs it.
"""

from __future__ import annotations

import logging
from collections.abc import Container, Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from geometry2d.drawings.chains import Chain, DrawingError, PieceCount
from geometry2d.foundation.text import bytes_of, quoted, short

if TYPE_CHECKING:
    from ezdxf.document import Drawing

Array = NDArray[np.float64]

MM_PER_INSUNIT = {1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0, 13: 1e-3, 14: 100.0}
"""Accepted values of the header variable $INSUNITS, in mm."""

ANNOTATION = frozenset(
    ["TEXT", "MTEXT", "POINT", "HATCH", "ATTDEF", "ATTRIB", "VIEWPORT", "WIPEOUT", "IMAGE"]
)
"""Entities that annotate a drawing and are no part of its outlines."""


MOST_BYTES = 100_000_000

MOST_COPIES = 20_000
DEEPEST_BLOCK = 32
"""Entities that blocks and grids of blocks may become, and blocks within one another."""

BLOCK_OF = {"INSERT": "name", "DIMENSION": "geometry", "ARC_DIMENSION": "geometry"}
"""Entities that are copies of a block, and which attribute names it."""

MOST_SPLINE_POINTS = 2000

LONGEST_REASON = 120
"""Characters of what the library says of a damaged file."""


def read_dxf(
    file: Path, *, unit_mm: float | None = None, names: Container[str] | None = None
) -> list[Chain]:
    """Return the curves in the model space of a DXF file as chains, named by their layer, mm.

    Parameters
    ----------
    file
        ASCII or binary DXF.
    unit_mm
        Unit of the drawing, mm, if the file is unitless.
    names
        The layers wanted, in lower case; the others are not followed. All of them if None.

    Raises
    ------
    DrawingError
        If the file cannot be read, has no unit, or holds an entity that cannot be converted.
    """
    try:
        import ezdxf
    except ImportError as error:
        raise DrawingError(
            f"reading {file.name} needs ezdxf: pip install 'drinksim[files]'"
        ) from error
    bytes_of(file, what="drawing", error=DrawingError, most_bytes=MOST_BYTES)
    # Our errors report all problems; the library's log would repeat them.
    log = logging.getLogger("ezdxf")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        document = ezdxf.readfile(file)  # type: ignore[attr-defined]
        return list(_chains_of(document, file.name, unit_mm, names))
    except DrawingError:
        raise
    except Exception as error:
        # A damaged file may raise any exception inside the reader.
        structure = isinstance(error, ezdxf.DXFStructureError)  # type: ignore[attr-defined]
        reason = f" ({short(str(error), LONGEST_REASON)})" if structure else ""
        raise DrawingError(
            f"{file.name} is no DXF drawing that can be read{reason}: export it again"
        ) from error
    finally:
        log.setLevel(level)


def _chains_of(
    document: Drawing, file: str, unit_mm: float | None, names: Container[str] | None
) -> Iterator[Chain]:
    """Yield the curves of a document, mm."""
    from ezdxf.disassemble import recursive_decompose

    scale = _unit(document, file, unit_mm)
    _refuse_many_copies(document, file)
    pieces, drawn = PieceCount(file), len(document.modelspace())
    for k, entity in enumerate(recursive_decompose(document.modelspace())):
        layer = str(entity.dxf.layer)
        if k > drawn + MOST_COPIES:
            raise DrawingError(
                f"{file}: what stands before a {entity.dxftype()} on layer {quoted(layer)} becomes "
                f"more than {MOST_COPIES} entities: explode it and delete what is not needed"
            )
        if names is None or layer.lower() in names:
            yield from _chains(entity, file, scale, pieces)


def _refuse_many_copies(document: Drawing, file: str) -> None:
    """Refuse blocks that would become more entities than are ever drawn, before they do."""
    known: dict[str, tuple[int, int]] = {}

    def copies(entity: Any, depth: int) -> tuple[int, int]:
        """Return what an entity becomes, no more than matters, and how deep its blocks lie."""
        kind = entity.dxftype()
        if kind not in BLOCK_OF:
            return 1, 0
        block = str(entity.dxf.get(BLOCK_OF[kind], ""))
        if depth > DEEPEST_BLOCK:
            raise DrawingError(
                f"{file}: block {quoted(block)} lies more than {DEEPEST_BLOCK} blocks deep, or in "
                "itself: explode it"
            )
        if block not in known:
            found = [copies(inner, depth + 1) for inner in document.blocks.get(block) or ()]
            total = sum(count for count, _ in found)
            known[block] = total, 1 + max((height for _, height in found), default=0)
        total, height = known[block]
        if kind == "INSERT":
            total = (1 + total) * max(entity.mcount, 1)
        total = min(1 + total, 10**9)
        if total > MOST_COPIES or depth + height > DEEPEST_BLOCK:
            raise DrawingError(
                f"{file}: block {quoted(block)} on layer {quoted(str(entity.dxf.layer))} becomes "
                f"{total} entities, {height} blocks deep: at most {MOST_COPIES} and "
                f"{DEEPEST_BLOCK}; explode it and delete what is not needed"
            )
        return total, height

    for entity in document.modelspace():
        copies(entity, 0)


def _unit(document: Drawing, file: str, unit_mm: float | None) -> float:
    code = document.header.get("$INSUNITS", 0)
    if code == 0 and unit_mm is None:
        raise DrawingError(
            f"{file} has no unit ($INSUNITS is 0): export it with a unit, or say what a drawing "
            "unit is"
        )
    unit = MM_PER_INSUNIT.get(code) if code else unit_mm
    if unit is None:
        raise DrawingError(f"{file}: $INSUNITS = {code} is not a unit for a package: use mm")
    if not 1e-6 < unit < 1e6:
        raise DrawingError(f"{file}: a drawing unit of {unit:.4g} mm is not for a drawing")
    if unit_mm is not None and not np.isclose(unit, unit_mm):
        raise DrawingError(f"{file} says that its unit is {unit:g} mm, not {unit_mm:g} mm")
    return unit


def _chains(entity: Any, file: str, scale: float, pieces: PieceCount) -> Iterator[Chain]:
    """Yield the curves of an entity, mm; ``scale`` is the drawing's unit, mm."""
    kind, name = entity.dxftype(), str(entity.dxf.layer)
    where = f"{file}: a {kind} on layer {quoted(name)}"
    to_mm = [[scale, 0, 0], [0, scale, 0]]
    if kind in ANNOTATION:
        return
    if kind == "LINE":
        line = Chain.through(name, _flat([entity.dxf.start, entity.dxf.end], where))
        yield pieces.counted(line.mapped(to_mm))
    elif kind in ("CIRCLE", "ARC"):
        yield pieces.counted(_round(entity, kind, name, where).mapped(to_mm))
    elif kind in ("LWPOLYLINE", "POLYLINE"):
        for chain in _polyline(entity, kind, name, where):
            yield pieces.counted(chain.mapped(to_mm))
    elif kind == "ELLIPSE":
        yield pieces.counted(_ellipse(entity, name, where, scale), fitted=True)
    elif kind == "SPLINE":
        yield _spline(entity, name, where, scale, pieces)
    else:
        raise DrawingError(f"{where} cannot be followed: explode it to lines, arcs and splines")


def _round(entity: Any, kind: str, name: str, where: str) -> Chain:
    centre, radius = _flat([entity.dxf.center], where)[0], float(entity.dxf.radius)
    if not radius > 0:
        raise DrawingError(f"{where} has radius {radius:g}")
    low, turn = 0.0, 2 * np.pi
    if kind == "ARC":
        low = np.radians(float(entity.dxf.start_angle))
        turn = (np.radians(float(entity.dxf.end_angle)) - low) % (2 * np.pi) or 2 * np.pi
    start = centre + radius * np.array([np.cos(low), np.sin(low)])
    return _seen_from_above(Chain.about(name, centre, start, turn), entity, where)


def _polyline(entity: Any, kind: str, name: str, where: str) -> Iterator[Chain]:
    if kind == "LWPOLYLINE":
        rows = np.array(list(entity.get_points("xyb")), float).reshape(-1, 3)
        closed = bool(entity.closed)
    else:
        if not entity.is_2d_polyline or entity.dxf.flags & 0b110:
            raise DrawingError(f"{where} is a mesh, a fitted or a 3D polyline: explode it")
        rows = np.array(
            [(*v.dxf.location.vec2, v.dxf.get("bulge", 0.0)) for v in entity.vertices], float
        ).reshape(-1, 3)
        closed = bool(entity.is_closed)
    if len(rows) < 2:
        return
    ends = np.concatenate([rows, rows[:1]]) if closed else rows
    parts = [Chain.arc(name, a[:2], b[:2], 4 * float(np.arctan(a[2]))) for a, b in pairwise(ends)]
    yield _seen_from_above(Chain.of(name, parts), entity, where)


def _ellipse(entity: Any, name: str, where: str, scale: float) -> Chain:
    """Return the arcs, mm, near an ellipse: a turn of the unit circle, mapped."""
    centre, major = scale * _flat([entity.dxf.center, entity.dxf.major_axis], where)
    upwards = _seen_from(entity, where)
    minor = upwards * float(entity.dxf.ratio) * np.array([-major[1], major[0]])
    low, high = float(entity.dxf.start_param), float(entity.dxf.end_param)
    turn = (high - low) % (2 * np.pi) or 2 * np.pi
    start = np.array([np.cos(low), np.sin(low)])
    return Chain.about(name, (0.0, 0.0), start, turn).mapped(
        np.column_stack([major, minor, centre])
    )


def _spline(entity: Any, name: str, where: str, scale: float, pieces: PieceCount) -> Chain:
    """Return the arcs, mm, near a spline."""
    from ezdxf.path import make_path

    count = max(len(entity.control_points), len(entity.fit_points), len(entity.knots))
    if count > MOST_SPLINE_POINTS:
        raise DrawingError(
            f"{where} has {count} points or knots, more than {MOST_SPLINE_POINTS}: simplify it"
        )
    path = make_path(entity)
    here = scale * _flat([path.start], where)[0]
    parts: list[Chain] = []
    for command in path.commands():
        controls = [
            getattr(command, key) for key in ("ctrl", "ctrl1", "ctrl2") if hasattr(command, key)
        ]
        points = np.array([here, *(scale * _flat([*controls, command.end], where))])
        chain = Chain.free(name, points) if controls else Chain.through(name, points)
        parts.append(pieces.counted(chain, fitted=bool(controls)))
        here = points[-1]
    return Chain.of(name, parts)


def _flat(points: Any, where: str) -> Array:
    """Return x and y of points (n, 2); their heights must be zero."""
    p = np.array([tuple(point)[:3] for point in points], float)
    if np.any(np.abs(p[:, 2]) > 1e-6):
        raise DrawingError(f"{where} lies at height {p[0, 2]:g}: draw the section in the xy-plane")
    return p[:, :2]


def _seen_from_above(chain: Chain, entity: Any, where: str) -> Chain:
    """Return the chain seen from above; mirrored entities are stored with an extrusion along −z."""
    return chain if _seen_from(entity, where) > 0 else chain.mapped([[-1, 0, 0], [0, 1, 0]])


def _seen_from(entity: Any, where: str) -> int:
    """Return 1 if the normal of an entity points up, −1 if it points down."""
    direction = np.array(tuple(entity.dxf.extrusion), float)
    for sign in (1, -1):
        if np.allclose(direction, (0, 0, sign), atol=1e-9):
            return sign
    raise DrawingError(
        f"{where} is not drawn in the xy-plane: its normal is {direction.tolist()}: rotate it there"
    )
