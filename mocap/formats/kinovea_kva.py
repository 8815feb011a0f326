"""Trajectories in an annotation file of Kinovea (.kva, or .xml), in pixels of the film.

The file is XML with the root ``KinoveaVideoAnalysis``. A ``Track`` has a name and a
``TrackPointList``, each of whose points is ``x;y;t``: pixels of the film and a time stamp. A frame
takes ``AverageTimeStampsPerFrame`` of these, counted from ``FirstTimeStamp``. Source: Kinovea 0.9,
``DrawingTrack.TrackPointsToXml`` and ``Metadata.WriteGeneralInformation``. Files of version 0.8.15
(format 1) count time from the start of each track and are refused: Kinovea writes them anew.
"""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.text import number, quoted, short
from mocap.formats.marker_table import (
    ExchangeError,
    MarkerTable,
    checked_table,
    refuse_size,
    text_of,
)

Array: TypeAlias = NDArray[np.float64]

ROOT = "KinoveaVideoAnalysis"
FIRST_FORMAT = 2.0
OFF_FRAME = 0.25
"""A point belongs to a frame if its time stamp is so near to it, in frames."""

MOST_FRAMES = 10**9

GENERAL = ("FormatVersion", "AverageTimeStampsPerFrame", "FirstTimeStamp")


def read_kva(path: Path | str) -> MarkerTable:
    """Return the trajectories of a file, px; rows have the numbers of the film's frames.

    Raises
    ------
    ExchangeError
        If the file is broken, of another program or an old format, or a point lies between frames.
    """
    file = Path(path)
    reader = _KvaReader(file)
    parser = expat.ParserCreate()
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.CharacterDataHandler = reader.characters
    parser.EntityDeclHandler = reader.refuse_entity
    try:
        parser.Parse(text_of(file).encode("utf-8"), True)
    except ExchangeError:
        raise
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise ExchangeError(f"{file}: is not readable as XML: {short(str(error))}") from None
    return reader.table()


class _KvaReader:
    """Collects tracks and what says when frames are shown, element by element."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._open: list[str] = []
        self._parts: list[str] = []
        self._general: dict[str, float] = {}
        self._tracks: list[tuple[str, list[tuple[float, float, float]]]] = []

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Begin an element."""
        if not self._open and tag != ROOT:
            raise ExchangeError(
                f"{self._file}: its first element is {quoted(tag)}, not {ROOT}: save the "
                "annotations of Kinovea, not a spreadsheet"
            )
        if tag == "Track":
            self._tracks.append((attributes.get("name", ""), []))
        elif tag == "MainLabel" and self._tracks and not self._tracks[-1][0]:
            self._tracks[-1] = (attributes.get("Text", ""), self._tracks[-1][1])
        self._open.append(tag)
        self._parts.clear()

    def characters(self, text: str) -> None:
        """Take up the text of what is read."""
        if self._open[-1] in (*GENERAL, "TrackPoint"):
            self._parts.append(text)

    def end(self, tag: str) -> None:
        """End an element."""
        self._open.pop()
        text = "".join(self._parts).strip()
        self._parts.clear()
        if tag in GENERAL and self._open == [ROOT]:
            self._general[tag] = self._number(text, tag)
        elif tag == "TrackPoint" and self._tracks:
            parts = text.split(";")
            if len(parts) < 3:
                raise ExchangeError(f"{self._file}: a point is {quoted(text)}, not x;y;t")
            x, y, t = (self._number(part, "TrackPoint") for part in parts[:3])
            self._tracks[-1][1].append((x, y, t))

    def refuse_entity(self, name: str, *rest: object) -> None:
        """Refuse what could unfold to any size."""
        raise ExchangeError(f"{self._file}: declares the entity {quoted(name)}; remove it")

    def table(self) -> MarkerTable:
        """Return all tracks as a table."""
        lacking = next((key for key in GENERAL[:2] if key not in self._general), None)
        if lacking is not None or self._general[GENERAL[0]] < FIRST_FORMAT:
            raise ExchangeError(
                f"{self._file}: has no {lacking or 'present format'}: open it in Kinovea 0.9 or "
                "later and save it again"
            )
        if not any(points for _, points in self._tracks):
            raise ExchangeError(f"{self._file}: holds no trajectory; track points, then save")
        tracks = [(name or f"track_{k + 1}", points) for k, (name, points) in
                  enumerate(self._tracks) if points]  # fmt: skip
        placed = [{self._frame(t): (x, y) for x, y, t in points} for _, points in tracks]
        for (name, points), rows in zip(tracks, placed, strict=True):
            if len(rows) < len(points):
                raise ExchangeError(f"{self._file}: {quoted(name)} has two points in one frame")
        frames = np.array(sorted({frame for rows in placed for frame in rows}), int)
        refuse_size(self._file, frames.size, len(tracks), 3 * sum(map(len, placed)))
        row_of = {frame: row for row, frame in enumerate(frames.tolist())}
        positions = np.full((frames.size, len(tracks), 3), np.nan)
        for k, rows in enumerate(placed):
            for frame, at in rows.items():
                positions[row_of[frame], k] = (*at, 0.0)
        names = [name for name, _ in tracks]
        return checked_table(self._file, frames * 1.0, names, positions, "px", frame=frames)

    def _frame(self, stamp: float) -> int:
        """Return the number of the frame that a time stamp names."""
        step = self._general["AverageTimeStampsPerFrame"]
        if step <= 0:
            raise ExchangeError(f"{self._file}: AverageTimeStampsPerFrame is {step:g}, not above 0")
        exact = (stamp - self._general.get("FirstTimeStamp", 0.0)) / step
        if not -OFF_FRAME <= exact <= MOST_FRAMES or abs(exact - round(exact)) > OFF_FRAME:
            raise ExchangeError(
                f"{self._file}: the time stamp {stamp:g} belongs to no frame ({exact:.2f}): it is "
                "another film, or one of uneven rate; export times instead"
            )
        return round(exact)

    def _number(self, text: str, what: str) -> float:
        value = number(text)
        if value is None:
            raise ExchangeError(f"{self._file}: {what} {quoted(text)} is no finite number")
        return value
