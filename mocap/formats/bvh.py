"""BVH, a skeleton with the rotations of its joints over time, read as positions of its joints.

A joint lies at the offset from its parent, turned by all rotations above it; the rotations of one
joint are applied in the order in which its channels are listed, each about its already turned axis
(Meredith and Maddock 2001, "Motion capture file formats explained", §2). The file says nothing of
its unit, hence the unit of the table is empty: the caller gives it with ``dataclasses.replace``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.formats.marker_table import AXES, ExchangeError, MarkerTable, checked_table, text_of

Array: TypeAlias = NDArray[np.float64]


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
        If the file is no BVH file, breaks off, or holds fewer or more frames than it announces.
    """
    file = Path(path)
    skeleton, found, movement = text_of(file).lstrip("\ufeff").partition("MOTION")
    if not skeleton.lstrip().startswith("HIERARCHY"):
        raise ExchangeError(f"{file}: is no BVH file (first word 'HIERARCHY')")
    if not found:
        raise ExchangeError(f"{file}: was cut short: its skeleton is not followed by 'MOTION'")
    joints = _joints(file, iter(skeleton.split()))
    columns = sum(len(joint.channels) for joint in joints)
    time, values = _frames(file, movement.strip().splitlines(), columns)
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
            if word in ("ROOT", "JOINT"):
                name = next(words)
            elif word == "End":
                next(words)
                name = f"{joints[open_joints[-1]].name}_end"
            elif word == "{":
                parent = open_joints[-1] if open_joints else -1
                if next(words) != "OFFSET":
                    raise ExchangeError(f"{file}: joint {name!r} does not begin with its OFFSET")
                offset = tuple(float(next(words)) for _ in range(3))
                open_joints.append(len(joints))
                joints.append(_Joint(name, parent, offset, (), column))
            elif word == "CHANNELS":
                channels = tuple(next(words) for _ in range(int(next(words))))
                _check_channels(file, name, channels)
                joints[-1] = _Joint(name, joints[-1].parent, offset, channels, column)
                column += len(channels)
            elif word == "}":
                open_joints.pop()
    except (StopIteration, RuntimeError, ValueError, IndexError) as error:
        if isinstance(error, ExchangeError):
            raise
        raise ExchangeError(f"{file}: its skeleton is broken at joint {name!r}") from None
    if open_joints or not joints:
        raise ExchangeError(f"{file}: its skeleton ends before joint {name!r} is closed")
    return joints


def _check_channels(file: Path, name: str, channels: tuple[str, ...]) -> None:
    for channel in channels:
        if channel[1:] not in ("position", "rotation") or channel[0] not in AXES:
            raise ExchangeError(f"{file}: joint {name!r} has a channel {channel!r} not known")


def _frames(file: Path, lines: list[str], columns: int) -> tuple[Array, Array]:
    """Return times (n,), s, and the values (n, columns) of all channels."""
    try:
        declared = int(lines[0].removeprefix("Frames:"))
        interval = float(lines[1].removeprefix("Frame Time:"))
    except (ValueError, IndexError):
        raise ExchangeError(
            f"{file}: MOTION is not followed by 'Frames:' and 'Frame Time:' with a number each"
        ) from None
    rows = [line.split() for line in lines[2:] if line.strip()]
    if len(rows) != declared:
        raise ExchangeError(f"{file}: announces {declared} frames and holds {len(rows)}")
    for number, row in enumerate(rows, start=1):
        if len(row) != columns:
            raise ExchangeError(
                f"{file}: frame {number} holds {len(row)} values for {columns} channels"
            )
    try:
        values = np.array(rows, np.float64).reshape(declared, columns)
    except ValueError as error:
        raise ExchangeError(f"{file}: a value of MOTION is no number ({error})") from None
    if not (np.isfinite(values).all() and np.isfinite(interval) and interval > 0):
        raise ExchangeError(f"{file}: a value is not finite, or the frame time not above zero")
    time: Array = interval * np.arange(declared, dtype=np.float64)
    return time, values


def _positions(joints: list[_Joint], values: Array) -> Array:
    """Return where all joints are (n, m, 3)."""
    frames = values.shape[0]
    positions = np.zeros((frames, len(joints), 3))
    turns = np.tile(np.eye(3), (len(joints), frames, 1, 1))
    for k, joint in enumerate(joints):
        own = np.tile(np.array(joint.offset), (frames, 1))
        turn = np.tile(np.eye(3), (frames, 1, 1))
        for column, channel in enumerate(joint.channels, start=joint.column):
            axis = AXES[channel[0]]
            if channel.endswith("position"):
                own[:, axis] += values[:, column]
            else:
                turn = turn @ _rotation(axis, np.radians(values[:, column]))
        if joint.parent >= 0:
            above = turns[joint.parent]
            own = positions[:, joint.parent] + np.einsum("nij,nj->ni", above, own)
            turn = above @ turn
        positions[:, k], turns[k] = own, turn
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
