"""Points that a trained network found in pictures, in HDF5: SLEAP's analysis files, DeepLabCut's.

SLEAP: data sets ``tracks``, ``node_names`` and ``track_names``; ``tracks`` is stored as (track,
axis, node, frame), or as (frame, track, node, axis) in the order that later versions offer. Frame 0
is the film's first. Source: SLEAP's and sleap-io's documentation of "analysis HDF5".

DeepLabCut: a pandas table (``format="table"``) whose rows are frames, with the scorer, the animal
if there are several, the point, and x, y, likelihood as labels of its columns; what was labelled by
hand is in :mod:`mocap.formats.hand_labels_h5`. Source: pandas, "HDF5 (PyTables)", and DeepLabCut's
own reader.
"""

from __future__ import annotations

import math
import pickletools
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.text import quoted, short
from mocap.formats.hand_labels_h5 import BLOCK_VALUES, read_hand_labels
from mocap.formats.marker_table import ExchangeError, MarkerTable, checked_table, refuse_size
from mocap.formats.pose_tables import label_parts, points_of_columns

Array: TypeAlias = NDArray[np.float64]

MOST_BYTES = 2_000_000_000
TABLE = "table"
LABELS = "values_block_0_kind"
VALUES = "values_block_0"


def read_pose_h5(path: Path | str) -> MarkerTable:
    """Return the points of a file, px.

    Raises
    ------
    ExchangeError
        If the file is no HDF5 file, or of neither program.
    """
    import h5py

    file = Path(path)
    try:
        if file.stat().st_size > MOST_BYTES:
            raise ExchangeError(f"{file}: is larger than {MOST_BYTES / 1e9:g} GB; export a part")
        with h5py.File(file, "r") as data:
            if "tracks" in data and "node_names" in data:
                return _sleap(file, data)
            for group in data.values():
                if isinstance(group, h5py.Group) and TABLE in group:
                    return _deeplabcut(file, group[TABLE])
                if isinstance(group, h5py.Group) and BLOCK_VALUES in group:
                    return read_hand_labels(file, group)
    except ExchangeError:
        raise
    except UnicodeDecodeError:
        raise ExchangeError(f"{file}: a name in it is no text; export it again") from None
    except (OSError, LookupError, TypeError, ValueError, RuntimeError) as error:
        raise ExchangeError(
            f"{file}: cannot be read as HDF5 of points ({short(str(error))})"
        ) from None
    raise ExchangeError(
        f"{file}: holds neither the tracks of a SLEAP analysis nor a table of DeepLabCut"
    )


def _sleap(file: Path, data: Any) -> MarkerTable:
    nodes = [_text(name) for name in data["node_names"][:]]
    shape = data["tracks"].shape
    # A data set that was never filled announces any size and holds nothing.
    refuse_size(file, shape[-1], math.prod(shape[:-1]), data["tracks"].id.get_storage_size())
    tracks: Array = np.asarray(data["tracks"][:], np.float64)
    if tracks.ndim == 4 and shape[1:3] == (2, len(nodes)):
        tracks = np.transpose(tracks, (3, 0, 2, 1))
    elif not (tracks.ndim == 4 and shape[2:] == (len(nodes), 2)):
        raise ExchangeError(
            f"{file}: its tracks are {shape} for {len(nodes)} nodes, not (track, 2, node, frame)"
        )
    count = tracks.shape[1]
    names = [_text(name) for name in data["track_names"][:]] if "track_names" in data else []
    names += [f"track_{k + 1}" for k in range(len(names), count)]
    flat = tracks.reshape(len(tracks), count * len(nodes), 2)
    positions: Array = np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=2)
    positions[~np.isfinite(flat).all(axis=2)] = np.nan
    titles = nodes if count == 1 else [f"{name}_{node}" for name in names[:count] for node in nodes]
    frames = np.arange(len(tracks))
    times = frames.astype(np.float64)
    return checked_table(file, times, titles, positions, "px", frame=frames)


def _deeplabcut(file: Path, table: Any) -> MarkerTable:
    labels = _labels(file, bytes(table.attrs[LABELS]))
    refuse_size(file, table.shape[0], len(labels), table.id.get_storage_size())
    rows = table[:]
    values = np.asarray(rows[VALUES], float)
    frames = np.asarray(rows["index"])
    if frames.dtype.kind not in "iu" or values.shape != (frames.size, len(labels)):
        raise ExchangeError(
            f"{file}: its rows are not numbered frames with {len(labels)} values each; export the "
            "CSV of the same name"
        )
    order = np.argsort(frames, kind="stable")
    titles = [label[-1].lower() for label in labels]
    names, positions = points_of_columns(file, label_parts(labels), titles, values[order])
    return checked_table(
        file, frames[order] * 1.0, names, positions, "px", frame=frames[order].astype(int)
    )


def _labels(file: Path, stored: bytes) -> list[tuple[str, ...]]:
    """Return the labels of columns that PyTables stored as a pickle of tuples of texts.

    The pickle is read, not run: only texts, tuples and lists of them are understood.
    """
    stack: list[Any] = []
    marks: list[int] = []
    memo: dict[int, Any] = {}
    try:
        for operation, argument, _ in pickletools.genops(stored):
            name = operation.name
            if name == "MARK":
                marks.append(len(stack))
            elif name.endswith("UNICODE") or name in ("STRING", "SHORT_BINSTRING", "BINSTRING"):
                stack.append(str(argument))
            elif name in ("PUT", "BINPUT", "LONG_BINPUT", "MEMOIZE"):
                memo[len(memo) if argument is None else int(str(argument))] = stack[-1]
            elif name in ("GET", "BINGET", "LONG_BINGET"):
                stack.append(memo[int(str(argument))])
            elif name in ("TUPLE1", "TUPLE2", "TUPLE3"):
                stack.append(tuple(_taken(stack, len(stack) - int(name[-1]))))
            elif name in ("TUPLE", "LIST"):
                items = _taken(stack, marks.pop())
                stack.append(tuple(items) if name == "TUPLE" else items)
            elif name == "EMPTY_LIST":
                stack.append([])
            elif name in ("APPEND", "APPENDS"):
                items = _taken(stack, marks.pop() if name == "APPENDS" else len(stack) - 1)
                stack[-1].extend(items)
            elif name not in ("PROTO", "FRAME", "STOP"):
                raise ValueError(name)
        (labels,) = stack
        if not all(isinstance(one, tuple) and len(one) in (3, 4) for one in labels):
            raise ValueError("labels")
    except (ValueError, IndexError, KeyError, AttributeError, TypeError) as error:
        raise ExchangeError(
            f"{file}: the labels of its columns are not understood ({quoted(str(error))}); export "
            "the CSV of the same name"
        ) from None
    return [tuple(str(part) for part in label) for label in labels]


def _taken(stack: list[Any], start: int) -> list[Any]:
    """Take everything from ``start`` on off a stack."""
    items = stack[start:]
    del stack[start:]
    return items


def _text(name: Any) -> str:
    return name.decode("utf-8") if isinstance(name, bytes) else str(name)
