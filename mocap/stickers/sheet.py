"""The sheet of coded stickers to print: true size, a bar to check it, lines to cut along."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from geometry2d.foundation.output import file_at_once
from mocap.stickers.codes import (
    BAR_MM,
    CELLS,
    CODED_MARKERS,
    MARGIN_CELLS,
    SIDES_MM,
    StickerCode,
    StickerError,
    code_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# ISO A4, its margin and the pitch of the stickers, mm.
PAGE_MM = (210.0, 297.0)
LEFT_MM, PITCH_MM = 18.0, 29.0
FIRST_ROW_MM, ROW_MM = 235.0, 42.0
BAR_AT_MM = (18.0, 267.0)
MM_PER_INCH = 25.4
FONT_PT = 7

ADVICE = (
    "Print at 100 %, not 'fit to page', on matt paper; measure the bar.",
    "Cut along the thin lines: the white margin belongs to the sticker.",
    "The mark on the margin points up; package stickers: from package_lower to package_upper.",
    "Stick them flat. They tell their own name and size: convert needs no marker file.",
)


def write_sheet(path: Path) -> None:
    """Write the sheet as a vector drawing (PDF or SVG) on A4, or as a picture of 600 dpi (PNG).

    Raises
    ------
    StickerError
        If the name does not end in .pdf, .svg or .png.
    OutputError
        If the file cannot be written.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in ("pdf", "svg", "png"):
        raise StickerError(f"--out {path}: a sheet is written as .pdf, .svg or .png; choose one")
    dates: dict[str, dict[str, None]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
    with file_at_once(path) as partial:
        figure = sheet_figure()
        figure.savefig(partial, format=kind, dpi=600, metadata=dates.get(kind))


def sheet_figure() -> Figure:
    """Return the sheet as a figure of A4 whose axes count mm from the lower left corner."""
    from matplotlib.figure import Figure as NewFigure

    figure = NewFigure(figsize=(PAGE_MM[0] / MM_PER_INCH, PAGE_MM[1] / MM_PER_INCH))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, PAGE_MM[0]), ylim=(0, PAGE_MM[1]))
    axes.set_axis_off()
    _draw_bar(axes)
    for number, line in enumerate(ADVICE):
        axes.text(LEFT_MM, 285.0 - 4.0 * number, line, fontsize=FONT_PT + 1)
    for row, side in enumerate(SIDES_MM):
        for column, marker in enumerate(CODED_MARKERS):
            middle = (LEFT_MM + 10.0 + PITCH_MM * column, FIRST_ROW_MM - ROW_MM * row)
            _draw_sticker(axes, code_of(marker, side), middle)
    return figure


def _draw_bar(axes: Axes) -> None:
    left, height = BAR_AT_MM
    axes.plot([left, left + BAR_MM], [height, height], "k", linewidth=0.8)
    for end in (left, left + BAR_MM):
        axes.plot([end, end], [height - 2, height + 2], "k", linewidth=0.4)
    words = f"{BAR_MM:g} mm; if it is not, write its length as bar_mm into [stickers]"
    axes.text(left + BAR_MM + 4, height - 1, words, fontsize=FONT_PT)


def _draw_sticker(axes: Axes, code: StickerCode, middle: tuple[float, float]) -> None:
    """Draw a sticker around a point, mm: its cells, its cutting line, its name and its top."""
    cell, half = code.side_mm / CELLS, code.side_mm / 2
    whole = half + MARGIN_CELLS * cell
    x, y = middle
    _rectangle(axes, x - half, y - half, code.side_mm, code.side_mm, "black")
    for row, cells in enumerate(~code.dark):
        for column in cells.nonzero()[0]:
            left, bottom = x - half + column * cell, y + half - (row + 1) * cell
            _rectangle(axes, left, bottom, cell, cell, "white")
    frame = [x - whole, x + whole, x + whole, x - whole, x - whole]
    axes.plot(frame, [y - whole, y - whole, y + whole, y + whole, y - whole], "0.6", linewidth=0.25)
    axes.plot([x, x], [y + whole - 0.35 * cell, y + whole], "k", linewidth=0.5)
    name = code.marker.replace("_", " ")
    label = f"{name}\n{code.side_mm:g} mm"
    axes.text(x, y - whole - 1.5, label, ha="center", va="top", fontsize=FONT_PT)


def _rectangle(
    axes: Axes, left: float, bottom: float, width: float, height: float, colour: str
) -> None:
    from matplotlib.patches import Rectangle

    patch = Rectangle((left, bottom), width, height, facecolor=colour, edgecolor="none")
    # Snapped to whole pixels, the cells of a picture would differ in size.
    patch.set_snap(False)
    axes.add_patch(patch)
