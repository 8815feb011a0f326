"""Checks of the header and the parameters of a C3D file, before a library reads it.

C3D is binary: blocks of 512 bytes, the first of which states where parameters and data begin and
how many points there are (C3D user guide, 2008, "Header section", "C3dParameter section"). The
parameters are records that point to one another. A wrong number in them makes a reader crash or use
all memory. The checks follow the records within the file.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from geometry2d.foundation.text import quoted
from mocap.formats.marker_table import ExchangeError

BLOCK = 512
MARK = 80
INTEL, DEC, MIPS = 84, 85, 86
"""Codes of the processors that define the byte order and the format of numbers."""

UNKNOWN_END = 65535
"""Largest frame number of the header; longer recordings have it among the parameters."""

TYPES = (-1, 1, 2, 4)
"""Types of a parameter: characters, bytes, integers and reals; the size is the bytes of one."""

MOST_DIMENSIONS = 7


@dataclass(frozen=True)
class C3dParameter:
    """A parameter: its type, its dimensions, and its bytes."""

    kind: int
    dimensions: tuple[int, ...]
    data: bytes

    def first(self, order: str) -> float:
        """Return the first number of it, 0 if there is none."""
        size = abs(self.kind)
        if len(self.data) < size or self.kind < 0:
            return 0.0
        code = {1: "B", 2: "H", 4: "f"}[size]
        return float(struct.unpack_from(order + code, self.data)[0])


def check_c3d(file: Path, data: bytes) -> None:
    """Check that header and parameters describe the file.

    Parameters
    ----------
    file
        For messages.
    data
        The content of the file.

    Raises
    ------
    ExchangeError
        If the file is no C3D file, its parameters leave it, or it is shorter than it says.
    """
    if len(data) < BLOCK or data[1] != MARK:
        raise ExchangeError(f"{file}: is no C3D file, or was cut short in its header")
    start = (max(data[0], 1) - 1) * BLOCK
    if start + 4 > len(data):
        raise ExchangeError(f"{file}: was cut short in its parameters")
    processor = data[start + 3]
    if processor not in (INTEL, DEC, MIPS):
        raise ExchangeError(
            f"{file}: its parameters name the processor {processor}, which is none of C3D "
            f"({INTEL}, {DEC}, {MIPS}); export it again"
        )
    order = ">" if processor == MIPS else "<"
    parameters = dict(_parameters(file, data, start + 4, order))
    points, analogue, first, last = struct.unpack_from(order + "4H", data, 2)
    _check_counts(file, parameters, points, analogue, order)
    frames = _frames(parameters, first, last, order)
    if frames < 1:
        raise ExchangeError(f"{file}: announces frames {first} to {last}; export it again")
    # A negative scale marks real numbers; the position of its sign depends on the byte order.
    real = bool(data[12 if order == ">" else 15 if processor == INTEL else 13] & 0x80)
    begin = struct.unpack_from(order + "H", data, 16)[0]
    needed = (begin - 1) * BLOCK + frames * (4 * points + analogue) * (4 if real else 2)
    if begin < 2 or len(data) < needed:
        raise ExchangeError(
            f"{file}: holds {len(data)} bytes and announces frames for {needed}: it was cut short"
        )


def _parameters(
    file: Path, data: bytes, at: int, order: str
) -> Iterator[tuple[tuple[str, str], C3dParameter]]:
    """Yield the parameters by the names of their group and their own, in capitals."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, C3dParameter]] = []
    while True:
        if at + 2 > len(data):
            raise ExchangeError(f"{file}: was cut short in its parameters")
        length, group = struct.unpack_from("<2b", data, at)
        if length == 0 or group == 0:
            break
        name = data[at + 2 : at + 2 + abs(length)].decode("latin-1").upper()
        link = at + 2 + abs(length)
        if link + 2 > len(data):
            raise ExchangeError(f"{file}: was cut short in its parameter {quoted(name)}")
        offset = struct.unpack_from(order + "H", data, link)[0]
        following = link + offset if offset else len(data)
        if following > len(data):
            raise ExchangeError(f"{file}: its parameter {quoted(name)} leads out of the file")
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _parameter(file, name, data[link + 2 : following])))
        if offset == 0:
            break
        at = following
    for group, name, parameter in found:
        yield (groups.get(group, ""), name), parameter


def _parameter(file: Path, name: str, record: bytes) -> C3dParameter:
    """Return a parameter from its record, which begins with its type."""
    kind, count = struct.unpack_from("<bB", record) if len(record) >= 2 else (0, 0)
    dimensions = tuple(record[2 : 2 + count])
    size = abs(kind) * math.prod(dimensions)
    if kind not in TYPES or count > MOST_DIMENSIONS or 2 + count + size > len(record):
        raise ExchangeError(
            f"{file}: its parameter {quoted(name)} is damaged: type {kind} with {count} dimensions "
            f"does not fit into its record of {len(record)} bytes; export the file again"
        )
    return C3dParameter(kind, dimensions, record[2 + count : 2 + count + size])


def _check_counts(
    file: Path,
    parameters: dict[tuple[str, str], C3dParameter],
    points: int,
    analogue: int,
    order: str,
) -> None:
    """Check that parameters and header agree on the number of points and channels."""
    if ("POINT", "USED") not in parameters:
        raise ExchangeError(f"{file}: has no parameter POINT:USED; export it again")
    for group, counted, what in (("POINT", points, "points"), ("ANALOG", analogue, "channels")):
        used = parameters.get((group, "USED"))
        stated = int(used.first(order)) if used else 0
        fits = stated == counted if group == "POINT" else not stated or counted % stated == 0
        if used and not fits:
            raise ExchangeError(
                f"{file}: its header has {counted} {what} in a frame and {group}:USED says "
                f"{stated}; export it again"
            )


def _frames(
    parameters: dict[tuple[str, str], C3dParameter], first: int, last: int, order: str
) -> int:
    """Return the number of announced frames, from the header or, if long, from the parameters."""
    if last < UNKNOWN_END:
        return last - first + 1
    ends: list[int] = []
    for name in ("ACTUAL_START_FIELD", "ACTUAL_END_FIELD"):
        field = parameters.get(("TRIAL", name))
        if field and field.kind == 2 and len(field.data) >= 4:
            low, high = struct.unpack_from(order + "2H", field.data)
            ends.append(low + UNKNOWN_END * high + high)
    if len(ends) == 2:
        return ends[1] - ends[0] + 1
    stated = parameters.get(("POINT", "FRAMES"))
    return max(int(stated.first(order)) if stated else 0, last - first + 1)
