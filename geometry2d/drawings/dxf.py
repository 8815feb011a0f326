"""Closed curves from DXF drawings, in mm, one name per layer.

Lines, arcs, circles and polylines with bulges come out as they are; ellipses and splines as arcs
fitted to them. The format itself is read by ezdxf, which the extra ``files`` brings.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from geometry2d.drawings.chains import Chain, DrawingError, bezier

if TYPE_CHECKING:
    from ezdxf.document import Drawing

Array = NDArray[np.float64]

MM_PER_INSUNIT = {1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0, 13: 1e-3, 14: 100.0}
"""Values of the header variable $INSUNITS that a drawing of a package may have."""

ANNOTATION = frozenset(
    ["TEXT", "MTEXT", "POINT", "HATCH", "ATTDEF", "ATTRIB", "VIEWPORT", "WIPEOUT", "IMAGE"]
)
"""Entities that say something about a drawing and are no part of its outlines."""


def read_dxf(file: Path, *, unit_mm: float | None = None) -> list[Chain]:
    """Return the curves in the model space of a DXF file as chains, named by their layer, mm.

    Parameters
    ----------
    file
        ASCII or binary DXF.
    unit_mm
        What a drawing unit is, mm, if the file is unitless.

    Raises
    ------
    DrawingError
        If the file cannot be read, has no unit, or holds something that cannot be followed.
    """
    try:
        import ezdxf
        from ezdxf.disassemble import recursive_decompose
    except ImportError as error:
        raise DrawingError(
            f"reading {file.name} needs ezdxf: pip install 'drinksim[files]'"
        ) from error
    # What is wrong is said by our own errors; the library's log would say it a second time.
    log = logging.getLogger("ezdxf")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        document = ezdxf.readfile(file)  # type: ignore[attr-defined]
        scale = _unit(document, file.name, unit_mm)
        entities = list(recursive_decompose(document.modelspace()))
        chains = [chain for entity in entities for chain in _chains(entity, file.name)]
        return [chain.mapped([[scale, 0, 0], [0, scale, 0]]) for chain in chains]
    except DrawingError as error:
        raise DrawingError(_printable(error)) from error
    except OSError as error:
        raise DrawingError(f"cannot read {file} as DXF: {error}") from error
    except Exception as error:
        # A damaged file fails anywhere inside the reader, with whatever Python says there.
        raise DrawingError(
            f"{file.name} is not a readable DXF file: {_printable(error)}"
        ) from error
    finally:
        log.setLevel(level)


def _printable(error: Exception) -> str:
    """Return a message in which bytes that were no text are written as escapes."""
    return str(error).encode("utf-8", "backslashreplace").decode("utf-8")


def _unit(document: Drawing, file: str, unit_mm: float | None) -> float:
    code = int(document.header.get("$INSUNITS", 0))
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


def _chains(entity: Any, file: str) -> Iterator[Chain]:
    kind, name = entity.dxftype(), str(entity.dxf.layer)
    where = f"{file}: a {kind} on layer {name!r}"
    if kind in ANNOTATION:
        return
    if kind == "LINE":
        yield Chain.through(name, _flat([entity.dxf.start, entity.dxf.end], where))
    elif kind in ("CIRCLE", "ARC"):
        yield _round(entity, kind, name, where)
    elif kind in ("LWPOLYLINE", "POLYLINE"):
        yield from _polyline(entity, kind, name, where)
    elif kind in ("ELLIPSE", "SPLINE"):
        yield _free(entity, name, where)
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


def _free(entity: Any, name: str, where: str) -> Chain:
    from ezdxf.path import make_path

    path = make_path(entity)
    here = _flat([path.start], where)[0]
    parts: list[Chain] = []
    for command in path.commands():
        controls = [getattr(command, key) for key in ("ctrl", "ctrl1", "ctrl2") if
                    hasattr(command, key)]  # fmt: skip
        points = np.array([here, *_flat([*controls, command.end], where)])
        parts.append(
            Chain.fitted(name, bezier(points)) if controls else Chain.through(name, points)
        )
        here = points[-1]
    return Chain.of(name, parts)


def _flat(points: Any, where: str) -> Array:
    """Return x and y of points (n, 2); their heights must be zero."""
    p = np.array([tuple(point)[:3] for point in points], float)
    if np.any(np.abs(p[:, 2]) > 1e-6):
        raise DrawingError(f"{where} lies at height {p[0, 2]:g}: draw the section in the xy-plane")
    return p[:, :2]


def _seen_from_above(chain: Chain, entity: Any, where: str) -> Chain:
    """Mirrored entities are stored as seen from below (their extrusion points to −z)."""
    direction = np.array(tuple(entity.dxf.extrusion), float)
    if np.allclose(direction, (0, 0, 1), atol=1e-9):
        return chain
    if np.allclose(direction, (0, 0, -1), atol=1e-9):
        return chain.mapped([[-1, 0, 0], [0, 1, 0]])
    raise DrawingError(f"{where} is not drawn in the xy-plane: its normal is {direction.tolist()}")
