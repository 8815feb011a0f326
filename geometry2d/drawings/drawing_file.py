"""Curves of a drawing in SVG or DXF.

Nothing is repaired: an open curve, one that crosses itself, or a drawing without a unit is an error
that names the place. Only rounding is accepted: ends within a micrometre of each other meet.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from contextlib import contextmanager
from pathlib import Path

from geometry2d.drawings.chains import Chain, DrawingError
from geometry2d.drawings.dxf import read_dxf
from geometry2d.drawings.joined import NamedOutline, closed_outlines
from geometry2d.drawings.svg import read_svg

READERS = {".svg": read_svg, ".dxf": read_dxf}


def drawn_outlines(
    file: Path, *, unit_mm: float | None = None, names: tuple[str, ...] | None = None
) -> list[NamedOutline]:
    """Return the closed curves of an SVG or DXF drawing, mm, y up.

    Parameters
    ----------
    file
        The drawing.
    unit_mm
        Unit of the drawing, mm, if the file does not state it.
    names
        The curves wanted, in lower case; all of them if None.

    Raises
    ------
    DrawingError
        If the file cannot be read, or a curve is open, branches or crosses itself.
    """
    chains = drawn_chains(file, unit_mm=unit_mm, names=names)
    with naming(file):
        return closed_outlines(chains)


def drawn_chains(
    file: Path, *, unit_mm: float | None = None, names: Container[str] | None = None
) -> list[Chain]:
    """Return the curves of an SVG or DXF drawing, open or closed, mm, y up.

    Parameters
    ----------
    file
        The drawing.
    unit_mm
        Unit of the drawing, mm, if the file does not state it.
    names
        The curves wanted, in lower case; the others are not followed. All of them if None.

    Raises
    ------
    DrawingError
        If the file cannot be read.
    """
    reader = READERS.get(file.suffix.lower())
    if reader is None:
        raise DrawingError(f"{file.name} is neither .svg nor .dxf: save the drawing as one of them")
    with naming(file):
        return reader(file, unit_mm=unit_mm, names=names)


@contextmanager
def naming(file: Path) -> Iterator[None]:
    """Prefix errors of the block with the name of the drawing, unless they contain it."""
    try:
        yield
    except DrawingError as error:
        if file.name in str(error):
            raise
        raise DrawingError(f"{file.name}: {error}") from error
