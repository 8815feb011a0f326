"""Reading of marker files (TOML); ``EXAMPLE`` shows all that a file may hold."""

from __future__ import annotations

import difflib
import itertools
import math
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from geometry2d.foundation.text import listed, quoted, short
from geometry2d.foundation.toml import read_toml, shown
from mocap.stickers.codes import BAR_MM, CODED_MARKERS
from mocap.tracking.markers import (
    DEFAULT_BODIES,
    Depths,
    Intrinsics,
    MarkerFile,
    MarkerFileError,
    PlanePoints,
    PrintedStickers,
    StylePoints,
)

EXAMPLE = """\
[scale]
package = 14.0          # mm between the package's first two markers; required
head = 104.3            # mm between ear and nose, parallel to the picture; optional
# package_sigma = 0.05  # mm, standard error of a length above; optional (0), any body

[markers]               # rough position (px) in the first used frame
ear = [460.0, 300.0]
nose = "auto"           # located by its layout; so is a standard marker that is left out
package_lower = [752.0, 374.0]
package_upper = [733.0, 348.0]
jaw_front = [708.0, 434.0]   # optional, as is jaw_back

# All that follows is optional.

# [lens]                  # OpenCV's names: fx, fy, cx, cy, k1, k2, p1, p2, k3; and
# readout_s = 0.02        # of a rolling shutter: from the first row's exposure to the last's

# [bodies]                # these are the defaults
# head = ["ear", "nose"]
# package = ["package_lower", "package_upper"]
# jaw = ["jaw_front", "jaw_back"]     # followed and reported, never part of the head
# moving = "package"      # the body whose motion is wanted ...
# reference = "head"      # ... as seen from this one

# [tracking]
# polarity = "auto"       # "dark" on light, "light" on dark, "ring", or "auto"

# [plane]                 # four points of the plane of motion, px and mm (y up)
# image_px = [[100, 80], [1180, 80], [1180, 640], [100, 640]]
# world_mm = [[0, 150], [300, 150], [300, 0], [0, 0]]

# [style]                 # px in the first used frame, to recognise the drinking style
# upper_lip = [613, 384]  # foremost point of the upper lip
# rim_lower = [777, 577]  # ends of the neck's rim
# rim_upper = [833, 545]

# Coded stickers need neither position nor scale: write ear = "sticker". Measure the bar of their
# sheet and give bar_mm = 100.0 (and bar_sigma_mm, its standard error) in a table [stickers].

# Without [plane], a table [depth] may say in mm how far the camera is from the package's marks, and
# how much nearer ear and nose are: camera = 1500, ear = 60, nose = 15, sigma = 5 (standard error of
# each of these depths). The head then needs no [scale] head.

# [recording]
# rendered = true         # not filmed; stated wherever the recording is shown
"""

STICKER = "sticker"
"""What a marker file says of a marker that is a coded sticker."""

POLARITIES = ("auto", "dark", "light", "ring")
LENS_KEYS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "readout_s")
STYLE_KEYS = ("upper_lip", "rim_lower", "rim_upper")
TABLES = ("scale", "depth", "lens", "markers", "bodies", "tracking", "plane", "style", "stickers",
          "recording")  # fmt: skip
OPTIONAL_MARKERS = frozenset(DEFAULT_BODIES["jaw"])

MOST_MARKERS = 200
LONGEST_NAME = 60
"""Bounds of what is followed in a video, and of a name that fits into a table and a picture."""

NEAREST_MM, MOST_NEARER = 100.0, 0.5
"""Least distance of a camera that sees a head, and the share of it by which a mark is nearer."""

LONGEST_READOUT_S = 0.1
"""No camera takes so long from the first row of a picture to the last."""

LISTED = 12
"""Names that a message lists at most."""

LARGEST_PX = 1e6
"""No picture is larger, and no focal length or position in it."""

PLAUSIBLE_MM: dict[tuple[str, ...], tuple[float, float]] = {
    ("ear", "nose"): (60.0, 200.0),
    ("package_lower", "package_upper"): (3.0, 300.0),
}
"""How far apart standard markers can be, on a person and on a package that a person lifts."""


def read_markers(path: Path | str) -> MarkerFile:
    """Return the marker file at ``path``, checked.

    Raises
    ------
    MarkerFileError
        If it cannot be read, holds an unknown key, or a value that makes no sense; the message
        names the key, the value and what to write instead.
    """
    file = Path(path)
    data = read_toml(file, what="marker file", error=MarkerFileError)
    return _MarkerFileReader(file, data).read()


class _MarkerFileReader:
    """Turns the tables of one file into a MarkerFile, each message naming the file."""

    def __init__(self, path: Path, data: dict[str, Any]) -> None:
        self.path = path
        self.data = data

    def read(self) -> MarkerFile:
        self._known("the file", self.data, TABLES)
        for name in self.data:
            self._table(name)
        bodies, moving, reference = self._bodies()
        coded = self._coded(bodies)
        scaled = any(name in coded for name in (*bodies[moving], *bodies[reference]))
        needed = ("markers",) if scaled else ("scale", "markers")
        lacking = next((table for table in needed if table not in self.data), None)
        if lacking is not None:
            raise self._error(f"has no [{lacking}] table; see 'drinksim convert --help'")
        scale, sigma = self._scale(bodies, moving, reference, scaled=scaled)
        return MarkerFile(
            path=self.path,
            scale_mm=scale,
            scale_sigma_mm=sigma,
            lens=self._lens(),
            positions_px=self._positions(bodies),
            bodies=bodies,
            moving=moving,
            reference=reference,
            polarity=self._polarity(),
            plane=self._plane(),
            style=self._style(),
            rendered=self._rendered(),
            coded=coded,
            printed=self._printed(coded),
            depth=self._depth(bodies[reference]),
        )

    def _bodies(self) -> tuple[dict[str, tuple[str, ...]], str, str]:
        table = self._table("bodies")
        named = {key: value for key, value in table.items() if key not in ("moving", "reference")}
        bodies: dict[str, tuple[str, ...]] = {}
        for body, members in named.items():
            if (
                not isinstance(members, list)
                or not members
                or not all(isinstance(name, str) for name in members)
            ):
                raise self._error(
                    f"[bodies] {short(body)} = {shown(members)}: give a list of marker "
                    'names, such as ["ear", "nose"]'
                )
            bodies[body] = tuple(members)
        self._check_names([*bodies, *itertools.chain.from_iterable(bodies.values())])
        if not bodies:
            given = set(self._table("markers"))
            bodies = dict(DEFAULT_BODIES)
            if not given & OPTIONAL_MARKERS:
                del bodies["jaw"]
            else:
                bodies["jaw"] = tuple(name for name in bodies["jaw"] if name in given)
        members_of_all = [name for members in bodies.values() for name in members]
        doubled = sorted(name for name, count in Counter(members_of_all).items() if count > 1)
        if doubled:
            raise self._error(f"[bodies]: {doubled[0]} is listed twice; a marker sits on one body")
        chosen = []
        for key, default in (("moving", "package"), ("reference", "head")):
            body = table.get(key, default)
            if not isinstance(body, str) or body not in bodies:
                hint = _nearest(str(body), bodies)
                raise self._error(f"[bodies] {key} = {shown(body)}: is no body of this file{hint}")
            chosen.append(body)
        if chosen[0] == chosen[1]:
            raise self._error(f"[bodies]: moving and reference are both {chosen[0]!r}")
        return bodies, chosen[0], chosen[1]

    def _check_names(self, names: list[str]) -> None:
        """Refuse names that tables and pictures cannot carry, or more than are ever followed."""
        for name in names:
            if not name.isprintable() or name.strip() != name or not 0 < len(name) <= LONGEST_NAME:
                raise self._error(
                    f"[bodies]: {quoted(name)} cannot be a name: write letters, digits and signs, "
                    f"at most {LONGEST_NAME}, without space around them"
                )
        if len(names) > MOST_MARKERS:
            raise self._error(f"[bodies]: {len(names)} names: list at most {MOST_MARKERS}")

    def _coded(self, bodies: Mapping[str, tuple[str, ...]]) -> frozenset[str]:
        """Return the markers that are coded stickers."""
        table = self._table("markers")
        coded = frozenset(name for name, value in table.items() if value == STICKER)
        for name in sorted(coded - set(CODED_MARKERS)):
            raise self._error(
                f"[markers] {name} = {STICKER!r}: no sticker is printed for it; stickers are "
                f"printed for {', '.join(CODED_MARKERS)}"
            )
        if coded and "readout_s" in self._table("lens"):
            raise self._error(
                "[lens] readout_s and stickers: a rolling shutter is undone for dots only; remove "
                "readout_s"
            )
        if coded and "plane" in self.data:
            raise self._error(
                "[plane] and stickers: stickers show by themselves how they are turned; remove "
                "[plane]"
            )
        members = {name for names in bodies.values() for name in names}
        return coded & members

    def _printed(self, coded: frozenset[str]) -> PrintedStickers:
        table = self._table("stickers")
        self._known("[stickers]", table, ["bar_mm", "bar_sigma_mm"])
        printed = PrintedStickers(**{key: self._number("stickers", key) for key in table})
        low, high = 0.5 * BAR_MM, 2.0 * BAR_MM
        if not low <= printed.bar_mm <= high or printed.bar_sigma_mm < 0:
            raise self._error(
                f"[stickers] bar_mm = {printed.bar_mm:g}, bar_sigma_mm = {printed.bar_sigma_mm:g}: "
                f"measure the sheet's bar of {BAR_MM:g} mm; at most twice or half of it is printed"
            )
        if table and not coded:
            raise self._error(
                f'[stickers] without a sticker: write {CODED_MARKERS[0]} = "{STICKER}" in [markers]'
            )
        return printed

    def _scale(
        self,
        bodies: Mapping[str, tuple[str, ...]],
        moving: str,
        reference: str,
        *,
        scaled: bool,
    ) -> tuple[dict[str, float], dict[str, float]]:
        table = self._table("scale")
        pairs = [name for name, members in bodies.items() if len(members) > 1]
        self._known("[scale]", table, [*pairs, *(f"{name}_sigma" for name in pairs)])
        scale = {name: self._number("scale", name) for name in pairs if name in table}
        for name, length in scale.items():
            pair = bodies[name][:2]
            low, high = PLAUSIBLE_MM.get(pair, (0.0, math.inf))
            if length <= 0:
                raise self._error(
                    f"[scale] {name} = {length}: give the distance between {pair[0]} and "
                    f"{pair[1]} in mm, more than 0"
                )
            if not low <= length <= high:
                raise self._error(
                    f"[scale] {name} = {length}: {pair[0]} and {pair[1]} are {low:g} to {high:g} "
                    "mm apart; measure the distance again and give it in mm"
                )
        needed = moving if moving in pairs else reference
        if needed not in scale and not scaled:
            raise self._error(
                f"[scale] lacks {needed}: measure the distance between the markers "
                f"{' and '.join(bodies[needed][:2])} and write '{needed} = ' and the mm"
            )
        sigma = {
            name: self._number("scale", f"{name}_sigma") if f"{name}_sigma" in table else 0.0
            for name in scale
        }
        if any(value < 0 for value in sigma.values()):
            raise self._error("[scale]: a standard error cannot be negative")
        return scale, sigma

    def _depth(self, marks: tuple[str, ...]) -> Depths | None:
        """Return the stated depths of marks of the reference body."""
        table = self._table("depth")
        if not table:
            return None
        if "plane" in self.data:
            raise self._error("[depth] and [plane]: give one of them")
        self._known("[depth]", table, ["camera", "sigma", *marks])
        lacking = next((key for key in ("camera", *marks[:2]) if key not in table), None)
        if lacking is not None:
            raise self._error(f"[depth] lacks {lacking}: write '{lacking} = ' and the mm")
        values = {key: self._number("depth", key) for key in table}
        camera = values.pop("camera")
        sigma = values.pop("sigma", Depths.sigma_mm)
        if camera < NEAREST_MM:
            raise self._error(
                f"[depth] camera = {camera:g}: give the distance from the camera to the package in "
                f"mm, {NEAREST_MM:g} or more"
            )
        for name, nearer in values.items():
            if abs(nearer) > MOST_NEARER * camera:
                raise self._error(
                    f"[depth] {name} = {nearer:g}: give by how many mm {name} is nearer to the "
                    f"camera than the package's marks; the camera is {camera:g} mm away"
                )
        if sigma < 0:
            raise self._error("[depth]: a standard error cannot be negative")
        return Depths(camera, values, sigma)

    def _positions(
        self, bodies: Mapping[str, tuple[str, ...]]
    ) -> dict[str, tuple[float, float] | None]:
        table = self._table("markers")
        expected = [name for members in bodies.values() for name in members]
        if "bodies" not in self.data:
            expected += [name for name in DEFAULT_BODIES["jaw"] if name not in expected]
        self._known("[markers]", table, expected)
        positions: dict[str, tuple[float, float] | None] = {}
        for name in expected:
            value = table.get(name)
            if name not in table and name in OPTIONAL_MARKERS and "bodies" not in self.data:
                continue
            positions[name] = (
                None
                if value in (None, "auto", STICKER)
                else self._point(f"[markers] {name}", value)
            )
        self._check_apart(positions)
        return positions

    def _check_apart(self, positions: Mapping[str, tuple[float, float] | None]) -> None:
        given = [(name, at) for name, at in positions.items() if at is not None]
        for (one, a), (other, b) in itertools.combinations(given, 2):
            if math.dist(a, b) < 2.0:
                raise self._error(
                    f"[markers] {one} and {other} coincide at [{a[0]:g}, {a[1]:g}]: correct the "
                    "position of one of them"
                )

    def _lens(self) -> Intrinsics:
        table = self._table("lens")
        self._known("[lens]", table, LENS_KEYS)
        lens = Intrinsics(**{key: self._number("lens", key) for key in table})
        for key in ("fx", "fy"):
            value = getattr(lens, key)
            if value is not None and value <= 0:
                raise self._error(f"[lens] {key} = {value}: focal lengths are positive, in px")
        if not 0 <= lens.readout_s <= LONGEST_READOUT_S:
            raise self._error(
                f"[lens] readout_s = {lens.readout_s:g}: a picture is read out in 0 to "
                f"{LONGEST_READOUT_S:g} s; phones take 0.01 to 0.03"
            )
        if lens.is_distorting and (lens.fx is None or lens.fy is None):
            raise self._error(
                "[lens] gives distortion without fx and fy: add the focal lengths in px, the "
                "coefficients have no meaning without them"
            )
        return lens

    def _polarity(self) -> str:
        table = self._table("tracking")
        self._known("[tracking]", table, ["polarity"])
        polarity = table.get("polarity", "auto")
        if polarity not in POLARITIES:
            raise self._error(
                f"[tracking] polarity = {shown(polarity)}: is none of {', '.join(POLARITIES)}"
                f"{_nearest(str(polarity), POLARITIES)}"
            )
        return str(polarity)

    def _plane(self) -> PlanePoints | None:
        table = self._table("plane")
        if not table:
            return None
        self._known("[plane]", table, ["image_px", "world_mm"])
        sides = []
        for key in ("image_px", "world_mm"):
            rows = table.get(key)
            if not isinstance(rows, list) or len(rows) != 4:
                raise self._error(f"[plane] {key} = {shown(rows)}: give four points [[x, y], …]")
            sides.append(tuple(self._point(f"[plane] {key}", row) for row in rows))
        return PlanePoints(image_px=sides[0], world_mm=sides[1])

    def _style(self) -> StylePoints | None:
        table = self._table("style")
        if not table:
            return None
        self._known("[style]", table, STYLE_KEYS)
        lacking = [key for key in STYLE_KEYS if key not in table]
        if lacking:
            raise self._error(f"[style] lacks {lacking[0]}: give all of {', '.join(STYLE_KEYS)}")
        points = {key: self._point(f"[style] {key}", table[key]) for key in STYLE_KEYS}
        if math.dist(points["rim_lower"], points["rim_upper"]) < 2.0:
            raise self._error("[style] rim_lower and rim_upper coincide: give both ends of the rim")
        return StylePoints(**points)

    def _rendered(self) -> bool:
        table = self._table("recording")
        self._known("[recording]", table, ["rendered"])
        rendered = table.get("rendered", False)
        if not isinstance(rendered, bool):
            raise self._error(f"[recording] rendered = {shown(rendered)}: write true or false")
        return rendered

    def _table(self, name: str) -> dict[str, Any]:
        table = self.data.get(name, {})
        if not isinstance(table, dict):
            raise self._error(f"{name} = {shown(table)}: has to be a table, written [{name}]")
        return table

    def _number(self, table: str, key: str) -> float:
        return self._finite(f"[{table}] {key}", self.data[table][key])

    def _finite(self, where: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self._error(f"{where} = {shown(value)}: has to be a number")
        if not abs(value) <= LARGEST_PX:
            raise self._error(f"{where} = {shown(value)}: has to be a finite number, not so large")
        return float(value)

    def _point(self, where: str, value: object) -> tuple[float, float]:
        if not isinstance(value, list) or len(value) != 2:
            raise self._error(f"{where} = {shown(value)}: give two numbers, [x, y]")
        return self._finite(where, value[0]), self._finite(where, value[1])

    def _known(self, where: str, table: Mapping[str, Any], known: Iterable[str]) -> None:
        allowed = list(known)
        for key in table:
            if key not in allowed:
                raise self._error(
                    f"{where} has no key {quoted(key)}{_nearest(key, allowed)}; known: "
                    f"{listed(allowed, LISTED)}"
                )

    def _error(self, message: str) -> MarkerFileError:
        return MarkerFileError(f"{self.path}: {message}")


def _nearest(word: str, known: Iterable[str]) -> str:
    """Return a half sentence proposing the nearest known word, or nothing."""
    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f" (did you mean {near[0]!r}?)" if near else ""
