"""A marking as the files that other commands read, and back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path

from geometry2d.foundation.delimited import read_named_table
from mocap.tracking.marker_file import STICKER, STYLE_KEYS
from mocap.tracking.markers import DEFAULT_BODIES, Intrinsics, MarkerFile, PrintedStickers
from scenarios.marking.marking import LIPS, Marking
from scenarios.marking.pointing import MarkingError, Touch
from scenarios.settings.writing import toml_value

CONTACT_COLUMNS = ("lip", "frame", "time_s", "x_px", "y_px")
POSITION_DECIMALS = 2
LENGTH_DECIMALS = 4


def marker_file_text(markers: MarkerFile) -> str:
    """Return a marker file as text; :func:`mocap.tracking.marker_file.read_markers` reads it."""
    unknown = asdict(Intrinsics())
    tables: dict[str, Mapping[str, object]] = {
        "recording": {"rendered": True} if markers.rendered else {},
        "scale": _scale(markers),
        "depth": _depth(markers),
        "lens": {key: value for key, value in asdict(markers.lens).items()
                 if value != unknown[key]},
        "markers": _markers(markers),
        "bodies": _bodies(markers),
        "tracking": {} if markers.polarity == "auto" else {"polarity": markers.polarity},
        "plane": {} if markers.plane is None else asdict(markers.plane),
        "style": {} if markers.style is None else
                 {key: _point(getattr(markers.style, key)) for key in STYLE_KEYS},
        "stickers": {} if markers.printed == PrintedStickers() else asdict(markers.printed),
    }  # fmt: skip
    return "\n".join(_lines(tables))


def scenario_text(
    marking: Marking,
    time_of: Mapping[int, float],
    *,
    name: str,
    video: Path,
) -> str:
    """Return a scenario of the marked film; paths in it start from the directory it lies in.

    Parameters
    ----------
    marking
        The marking; its first contacts become those of the scenario.
    time_of
        Time of each frame, s, by its number.
    name
        What the scenario is called.
    video
        The film.
    """
    touches = {
        f"{lip}_time_s": round(time_of[marking.touches[lip].frame], 6)
        for lip in LIPS
        if lip in marking.touches
    }
    tables: dict[str, Mapping[str, object]] = {
        "recording": {"video": str(video.absolute()), "markers": "markers.toml"},
        "motion": {"file": "motion/motion.csv"},
        "first_contact": touches,
    }
    head = (
        f"name = {toml_value(name)}\n\n# The neck and all else has its default: say [package] …\n"
    )
    return head + "\n".join(_lines(tables))


def contacts_text(marking: Marking, time_of: Mapping[int, float]) -> str:
    """Return where and when each lip is touched first, as a table."""
    rows = [
        f"{lip},{touch.frame},{time_of[touch.frame]:.6f},{touch.at[0]:.2f},{touch.at[1]:.2f}"
        for lip, touch in marking.touches.items()
    ]
    return "\n".join([",".join(CONTACT_COLUMNS), *rows]) + "\n"


def with_contacts(marking: Marking, file: Path) -> Marking:
    """Return the marking with the first contacts of a table.

    Raises
    ------
    MarkingError
        If the file is broken.
    """
    table = read_named_table(file, CONTACT_COLUMNS, what="table of contacts", error=MarkingError)
    columns = [table.numbers(name) for name in ("frame", "x_px", "y_px")]
    for lip, frame, x, y in zip(table.texts("lip"), *columns, strict=True):
        marking = marking.with_touch(lip, Touch(int(frame), (float(x), float(y))))
    return marking


def _scale(markers: MarkerFile) -> dict[str, object]:
    table: dict[str, object] = {}
    for body, length in markers.scale_mm.items():
        table[body] = round(float(length), LENGTH_DECIMALS)
        if markers.scale_sigma_mm[body]:
            table[f"{body}_sigma"] = round(float(markers.scale_sigma_mm[body]), LENGTH_DECIMALS)
    return table


def _depth(markers: MarkerFile) -> dict[str, object]:
    depth = markers.depth
    if depth is None:
        return {}
    return {"camera": depth.camera_mm, "sigma": depth.sigma_mm, **depth.nearer_mm}


def _markers(markers: MarkerFile) -> dict[str, object]:
    table: dict[str, object] = {}
    for name, at in markers.positions_px.items():
        if name in markers.coded:
            table[name] = STICKER
        else:
            table[name] = "auto" if at is None else _point(at)
    return table


def _bodies(markers: MarkerFile) -> dict[str, object]:
    standard = {
        body: tuple(name for name in members if name in markers.positions_px)
        for body, members in DEFAULT_BODIES.items()
    }
    standard = {body: members for body, members in standard.items() if members}
    usual = (standard, "package", "head")
    if (dict(markers.bodies), markers.moving, markers.reference) == usual:
        return {}
    return {**markers.bodies, "moving": markers.moving, "reference": markers.reference}


def _point(at: tuple[float, float]) -> tuple[float, float]:
    return round(float(at[0]), POSITION_DECIMALS), round(float(at[1]), POSITION_DECIMALS)


def _lines(tables: Mapping[str, Mapping[str, object]]) -> Iterator[str]:
    for name, table in tables.items():
        if table:
            yield f"[{name}]"
            yield from (f"{_key(key)} = {toml_value(value)}" for key, value in table.items())
            yield ""


def _key(name: str) -> str:
    """Return a name as a key of TOML."""
    bare = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if bare else toml_value(name)
