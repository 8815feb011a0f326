"""Films that another renderer drew, converted and compared with their truth, kind by kind.

    DRINKSIM_DATA=FOLDER python -m benchmarks.films [KIND ...]

``FOLDER/films`` holds a folder ``KIND-SEED`` for each film: ``video.mp4``, ``markers.toml``, and
the truth: ``truth.csv`` (frame, marker, x_px, y_px) and ``truth_motion.csv`` (time_s, rel_x_mm,
rel_y_mm, rel_theta_deg). They are not part of the project. Printed for each kind, all its seeds
together: RMS error of a coordinate of the relative position, the errors that are stated, the share
of coordinates and frames within one and three of them, the frames in which the marker that is seen
least is seen, sightings more than 3 px astray, and what is said of depth and turns. A film that is
refused is listed with the words.
"""

from __future__ import annotations

import os
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from mocap.convert import ConvertResult, convert
from mocap.views.depths import depth_warnings

Array = NDArray[np.float64]

RELATIVE = ("rel_x_mm", "rel_y_mm", "rel_theta_deg")
# A marker farther than this, px, from its place while it is said to be seen is something else.
ASTRAY_PX = 3.0


@dataclass(frozen=True)
class Film:
    """What became of one film.

    Attributes
    ----------
    error_mm, sigma_mm
        (n, 2) errors of the relative position and what is stated of them.
    seen
        Share of frames in which the marker that is seen least is seen.
    astray
        Number of sightings of something else.
    said
        What is said of depth and turns.
    """

    error_mm: Array
    sigma_mm: Array
    seen: float
    astray: int
    said: tuple[str, ...]


def film(folder: Path) -> Film:
    """Convert a film and compare it with its truth."""
    result = convert(folder / "video.mp4", folder / "markers.toml")
    truth = _columns(folder / "truth_motion.csv")
    motion = result.motion
    frames = result.measured.capture.frame
    right = np.column_stack([truth[name][frames] for name in RELATIVE[:2]])
    used = [name for body in result.markers.rigid_bodies for name in body]
    seen = [float(result.tracks.known(name).mean()) for name in used]
    return Film(
        error_mm=motion.relative_mm - right,
        sigma_mm=motion.sigma[:, :2],
        seen=min(seen),
        astray=_astray(result, folder),
        said=tuple(depth_warnings(result.measured, result.markers)),
    )


def _columns(file: Path) -> dict[str, Array]:
    table = np.genfromtxt(file, delimiter=",", names=True)
    return {name: np.asarray(table[name]) for name in table.dtype.names or ()}


def _astray(result: ConvertResult, folder: Path) -> int:
    table = np.genfromtxt(
        folder / "truth.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    count = 0
    for name in result.tracks.names:
        rows = table[table["marker"] == name]
        places = np.column_stack([rows["x_px"], rows["y_px"]])[result.tracks.frame]
        away = np.hypot(*(result.tracks.of(name)[0] - places).T)
        count += int(np.sum(result.tracks.known(name) & (away > ASTRAY_PX)))
    return count


def row(kind: str, folders: list[Path]) -> str:
    """Return a row of the table."""
    films, refused = [], []
    for folder in folders:
        try:
            films.append(film(folder))
        except DrinksimError as error:
            refused.append(str(error).replace(str(folder), ".").replace("|", "/"))
    words = "; ".join(f"refused: {each}" for each in refused)
    if not films:
        return f"| {kind} | {len(folders)} | | | | | | | {words} |"
    error = np.concatenate([each.error_mm for each in films])
    sigma = np.concatenate([each.sigma_mm for each in films])
    score = np.abs(error / sigma)
    said = dict.fromkeys(_short(line) for each in films for line in each.said)
    remark = "; ".join(filter(None, [*said, words]))
    return (
        f"| {kind} | {len(folders)} | {np.sqrt(np.mean(error**2)):.3f} | {np.median(sigma):.3f} | "
        f"{100 * np.mean(score < 1):.0f} % | {100 * np.mean(score < 3):.0f} % | "
        f"{100 * min(each.seen for each in films):.0f} % | {sum(each.astray for each in films)} | "
        f"{remark} |"
    )


def _short(warning: str) -> str:
    """Return a warning before its consequence."""
    return warning.rpartition(": ")[0] or warning


def rows(folder: Path, kinds: list[str]) -> Iterator[str]:
    """Yield the lines of the table."""
    found = defaultdict(list)
    for each in sorted(folder.glob("*-*")):
        if (each / "truth_motion.csv").is_file():
            found[each.name.rsplit("-", 1)[0]].append(each)
    yield "| kind | films | RMS, mm | stated, mm | within 1σ | 3σ | seen | astray | said |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for kind in kinds or sorted(found):
        yield row(kind, found[kind])


def main(kinds: list[str]) -> None:
    """Print the table, or the kinds that are named."""
    if "DRINKSIM_DATA" not in os.environ:
        raise SystemExit("DRINKSIM_DATA names no folder: set it to the one that holds films/")
    for line in rows(Path(os.environ["DRINKSIM_DATA"]) / "films", kinds):
        print(line, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
