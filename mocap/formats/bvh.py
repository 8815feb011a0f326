"""BVH: a skeleton with the rotations of its joints over time, read as positions of the joints.

The position of a joint is its offset from its parent, rotated by all joints above it. The rotations
of a joint are applied in the order of its channels, each about the axis as rotated so far (Meredith
and Maddock 2001, "Motion capture file formats explained", §2). The file does not state its unit:
the table's unit is empty, and the caller sets it with ``dataclasses.replace``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import TableRow, refuse_cut
from geometry2d.foundation.text import number, quoted
from mocap.formats.marker_table import (
    AXES,
    LARGEST,
    LONGEST_NAME,
    ExchangeError,
    MarkerTable,
    checked_table,
    refuse_size,
    text_of,
)

Array: TypeAlias = NDArray[np.float64]

MOST_JOINTS = 5000
"""Ten times the joints of two persons with all fingers."""


@dataclass(frozen=True)
class _Joint:
    """A joint: its parent's number (-1: none), offset, and channels with their first column."""

    name: str
    parent: int
    offset: tuple[float, ...]
    channels: tuple[str, ...]
    column: int


def read_bvh(path: Path | str) -> MarkerTable:
    """Return the positions of all joints of a BVH file; ends of chains are named ``NAME_end``.

    Raises
    ------
    ExchangeError
        If the file is no BVH file, is cut short, or holds fewer or more frames than it announces.
    """
    file = Path(path)
    skeleton, found, movement = text_of(file).partition("MOTION")
    if not skeleton.lstrip().startswith("HIERARCHY"):
        raise ExchangeError(f"{file}: is no BVH file (first word 'HIERARCHY')")
    if not found:
        raise ExchangeError(f"{file}: was cut short: its skeleton is not followed by 'MOTION'")
    joints = _joints(file, iter(skeleton.split()))
    columns = sum(len(joint.channels) for joint in joints)
    time, values = _frames(file, skeleton.count("\n") + 1, movement, columns)
    refuse_size(file, time.size, len(joints), values.size)
    positions = _positions(joints, values)
    return checked_table(file, time, [joint.name for joint in joints], positions, "")


def _joints(file: Path, words: Iterator[str]) -> list[_Joint]:
    """Return the joints, parents before children."""
    joints: list[_Joint] = []
    open_joints: list[int] = []
    name, column = "", 0
    offset: tuple[float, ...] = ()
    channels: tuple[str, ...] = ()
    try:
        for word in words:
            begins = word in ("ROOT", "JOINT")
            if begins:
                name = _name(words)
            elif word == "End":
                next(words)
                name = f"{joints[open_joints[-1]].name}_end"
            if begins or word == "{":
                parent = open_joints[-1] if open_joints else -1
                if next(words) != "OFFSET":
                    raise ExchangeError(f"{file}: joint {quoted(name)} begins without OFFSET")
                offset = tuple(_number(next(words)) for _ in range(3))
                if len(name) > LONGEST_NAME or len(joints) == MOST_JOINTS:
                    raise ExchangeError(
                        f"{file}: joint {quoted(name)} is one of more than {MOST_JOINTS}, or has a "
                        "longer name than people write; export the skeleton again"
                    )
                open_joints.append(len(joints))
                joints.append(_Joint(name, parent, offset, (), column))
            elif word == "CHANNELS":
                channels = tuple(next(words) for _ in range(int(next(words))))
                _check_channels(file, name, channels)
                joints[-1] = _Joint(name, joints[-1].parent, offset, channels, column)
                column += len(channels)
            elif word == "}":
                open_joints.pop()
    except ExchangeError:
        raise
    except (StopIteration, RuntimeError, ValueError, IndexError):
        raise ExchangeError(f"{file}: its skeleton is broken at joint {quoted(name)}") from None
    if open_joints or not joints:
        raise ExchangeError(f"{file}: its skeleton ends before joint {quoted(name)} is closed")
    return joints


def _name(words: Iterator[str]) -> str:
    """Return a joint's name, which may hold blanks, and pass the brace that follows it."""
    parts = []
    for word in words:
        if word == "{":
            break
        parts.append(word)
        if len(parts) > LONGEST_NAME:
            raise ValueError("name")
    if not parts:
        raise ValueError("name")
    return " ".join(parts)


def _number(word: str) -> float:
    """Return the number of an offset; ValueError if it is none that a skeleton has."""
    found = number(word)
    if found is None or abs(found) > LARGEST:
        raise ValueError(word)
    return found


def _check_channels(file: Path, name: str, channels: tuple[str, ...]) -> None:
    for channel in channels:
        if channel[1:] not in ("position", "rotation") or channel[0] not in AXES:
            raise ExchangeError(
                f"{file}: joint {quoted(name)} has a channel {quoted(channel)} not known"
            )


def _frames(file: Path, above: int, movement: str, columns: int) -> tuple[Array, Array]:
    """Return times (n,), s, and the values (n, columns) of all channels.

    ``above`` is the number of lines before the text of the movement.
    """
    lines = [(k, line) for k, line in enumerate(movement.split("\n"), start=above) if line.strip()]
    head = [line.strip() for _, line in lines[:2]]
    declared = number(head[0].removeprefix("Frames:").strip()) if len(head) == 2 else None
    interval = number(head[1].removeprefix("Frame Time:").strip()) if len(head) == 2 else None
    if declared is None or interval is None:
        raise ExchangeError(
            f"{file}: MOTION is not followed by 'Frames:' and 'Frame Time:' with a number each"
        )
    if not 0 < interval <= LARGEST:
        raise ExchangeError(f"{file}: the frame time is {interval:g} s, not above zero")
    rows = [TableRow(k, line.split()) for k, line in lines[2:]]
    if len(rows) != declared:
        raise ExchangeError(f"{file}: announces {declared:g} frames and holds {len(rows)}")
    refuse_cut(file, rows, columns, complete=movement.endswith("\n"), error=ExchangeError)
    values = np.empty((len(rows), columns))
    for k, row in enumerate(rows):
        if len(row.cells) != columns:
            raise ExchangeError(
                f"{file}: frame {k + 1} holds {len(row.cells)} values for {columns} channels"
            )
        found = [number(cell) for cell in row.cells]
        if None in found:
            wrong = quoted(row.cells[found.index(None)])
            raise ExchangeError(f"{file} line {row.line}: {wrong} is no finite number")
        values[k] = found
    if np.any(np.abs(values) > LARGEST):
        worst = values.flat[np.argmax(np.abs(values))]
        raise ExchangeError(f"{file}: a value of MOTION is {worst:g}, too large")
    time: Array = interval * np.arange(len(rows), dtype=np.float64)
    return time, values


def _positions(joints: list[_Joint], values: Array) -> Array:
    """Return the positions of all joints (n, m, 3)."""
    frames = values.shape[0]
    positions = np.zeros((frames, len(joints), 3))
    still = np.tile(np.eye(3), (frames, 1, 1))
    turns: list[Array] = []
    for k, joint in enumerate(joints):
        own = np.tile(np.array(joint.offset), (frames, 1))
        turn = still
        for column, channel in enumerate(joint.channels, start=joint.column):
            axis = AXES[channel[0]]
            if channel.endswith("position"):
                own[:, axis] += values[:, column]
            else:
                turn = turn @ _rotation(axis, np.radians(values[:, column]))
        if joint.parent >= 0:
            above = turns[joint.parent]
            own = positions[:, joint.parent] + np.einsum("nij,nj->ni", above, own)
            # A joint without rotations shares the array of its parent.
            turn = above if turn is still else above @ turn
        positions[:, k] = own
        turns.append(turn)
    return positions


def _rotation(axis: int, angle: Array) -> Array:
    """Return rotation matrices (n, 3, 3) about a coordinate axis by angles (n,), rad."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.zeros((angle.size, 3, 3))
    matrix[:, axis, axis] = 1.0
    matrix[:, one, one] = matrix[:, two, two] = np.cos(angle)
    matrix[:, two, one] = np.sin(angle)
    matrix[:, one, two] = -np.sin(angle)
    return matrix
