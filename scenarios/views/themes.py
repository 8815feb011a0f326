"""Colours of what is drawn, on light paper and on dark; maps of them are in `colours`.

People who lack one kind of cones tell them apart too: tests simulate that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

INK = "#2b2f36"
PAPER = "#fbfaf8"
QUIET = "#8a8f98"
BULK = "#efc9b8"
SKIN_EDGE = "#7c4a3c"
BONE = "#dcd8cf"
TOOTH = "#f7f4ea"
HARD_EDGE = "#a8a294"
NECK = "#6d7f92"
NECK_EDGE = "#3e4c5b"
PACKAGE = "#dfe5ea"
UPPER = "#1d6a86"
LOWER = "#d07a2d"
WARNING = "#9c2f2f"
RUN_COLOURS = (UPPER, LOWER, "#79311c", "#52a285", "#4b3fd6", "#1d1220")
"""Of runs in one figure, in order."""


@dataclass(frozen=True)
class Theme:
    """What lies under and beside the drawn section: light, or dark for a dim room.

    ``pressure`` are the colours of contact, from none to the highest.
    """

    paper: str
    panel: str
    ink: str
    quiet: str
    line: str
    halo: str
    package: str
    upper: str
    lower: str
    warning: str
    pressure: tuple[str, ...]


THEMES: Mapping[str, Theme] = {
    "light": Theme(
        paper=PAPER,
        panel="#ffffff",
        ink=INK,
        quiet="#5d626b",
        line="#d9d6d0",
        halo="#ffffff",
        package=PACKAGE,
        upper=UPPER,
        lower=LOWER,
        warning=WARNING,
        pressure=("#bfe6e4", "#4fb3c4", "#1c6f9c", "#123a7a", "#160b47"),
    ),
    "dark": Theme(
        paper="#15181c",
        panel="#1f2329",
        ink="#ece9e3",
        quiet="#a3abb5",
        line="#3d444d",
        halo="#1f2329",
        package="#39424c",
        upper="#5cb3d4",
        lower="#f0a35b",
        warning="#ff8f85",
        pressure=("#1d4a63", "#2684a6", "#4fb6d2", "#a4e0ea", "#f2ffff"),
    ),
}
"""The themes by name, the first of them unless another is asked for."""
LIGHT = THEMES["light"]
