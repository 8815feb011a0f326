"""Files of other programs, made here as these write them."""

from __future__ import annotations

import pickle
from pathlib import Path

import h5py
import numpy as np

FRAMES, NODES = 6, ("ear", "nose")
PLACES = np.random.default_rng(4).uniform(10, 200, (FRAMES, len(NODES), 2))
PLACES[3, 1] = np.nan


KVA = """<?xml version="1.0" encoding="utf-8"?>
<KinoveaVideoAnalysis>
  <FormatVersion>2.0</FormatVersion>
  <ImageSize>1280;720</ImageSize>
  <AverageTimeStampsPerFrame>512</AverageTimeStampsPerFrame>
  <FirstTimeStamp>1024</FirstTimeStamp>
  <Tracks>
    <Track id="1" name="ear">
      <TimePosition>1024</TimePosition>
      <TrackPointList Count="3">
        <TrackPoint>100.5;50.25;1024</TrackPoint>
        <TrackPoint>101.5;51;1536</TrackPoint>
        <TrackPoint>103;52;2560</TrackPoint>
      </TrackPointList>
      <MainLabel Text="not this"/>
    </Track>
    <Track id="2">
      <TrackPointList Count="1"><TrackPoint>9;8;1536</TrackPoint></TrackPointList>
      <MainLabel Text="the nose"/>
    </Track>
    <Track id="3" name="empty"><TrackPointList Count="0"/></Track>
  </Tracks>
</KinoveaVideoAnalysis>
"""
"""As Kinovea saves annotations, in its format 2."""


def sleap_h5(file: Path, *, tracks: int = 1, later: bool = False) -> Path:
    """As SLEAP's "Export analysis HDF5" writes it, or as sleap-io does with preset "standard"."""
    all_tracks = np.stack([PLACES + 100 * k for k in range(tracks)], axis=1)
    with h5py.File(file, "w") as data:
        data["tracks"] = all_tracks if later else np.transpose(all_tracks, (1, 3, 2, 0))
        data["node_names"] = np.array([name.encode() for name in NODES])
        data["track_names"] = np.array([f"mouse{k}".encode() for k in range(tracks)])
        data["track_occupancy"] = np.ones((FRAMES, tracks))
    return file


def deeplabcut_h5(file: Path, *, animals: tuple[str, ...] = (), protocol: int = 0) -> Path:
    """As ``DataFrame.to_hdf(key="df_with_missing", format="table")`` writes it through PyTables."""
    levels = [(animal,) for animal in animals] or [()]
    labels = [
        ("net", *level, part, coordinate)
        for level in levels
        for part in NODES
        for coordinate in ("x", "y", "likelihood")
    ]
    rows = np.zeros(FRAMES, [("index", "<i8"), ("values_block_0", "<f8", (len(labels),))])
    rows["index"] = [0, 1, 2, 5, 9, 10]
    columns = [np.column_stack([PLACES[:, k], [0.9, 0.9, 0.2, 0.9, 0.9, 0.9]]) for k in range(2)]
    rows["values_block_0"] = np.column_stack(columns * len(levels))
    with h5py.File(file, "w") as data:
        table = data.create_group("df_with_missing").create_dataset("table", data=rows)
        table.attrs["values_block_0_kind"] = np.void(pickle.dumps(labels, protocol))
    return file


def hand_labels_h5(
    file: Path, pictures: list[tuple[str, ...]], values: np.ndarray, *, animal: str = ""
) -> Path:
    """As ``DataFrame.to_hdf(key="df_with_missing")`` writes labels set by hand in DeepLabCut.

    Each picture is one text or folder, film and file; values (pictures, 4) are x and y of both
    points. The last column is a block of its own, as whole numbers are.
    """
    middle = (animal,) if animal else ()
    labels = [("me", *middle, part, letter) for part in NODES for letter in "xy"]
    with h5py.File(file, "w") as data:
        group = data.create_group("df_with_missing")
        _levels(group, "axis0", labels)
        if len(pictures[0]) == 1:
            group["axis1"] = np.array([picture[0].encode() for picture in pictures])
        else:
            _levels(group, "axis1", pictures)
        for name, columns in (("block0", slice(0, 3)), ("block1", slice(3, 4))):
            _levels(group, f"{name}_items", labels[columns])
            group[f"{name}_values"] = values[:, columns]
    return file


def _levels(group: h5py.Group, axis: str, labels: list[tuple[str, ...]]) -> None:
    """Write labels as pandas numbers them: sorted names of each level, and numbers into them."""
    for level, names in enumerate(zip(*labels, strict=True)):
        known = sorted(set(names))
        group[f"{axis}_level{level}"] = np.array([name.encode() for name in known])
        group[f"{axis}_label{level}"] = np.array([known.index(name) for name in names], np.int8)
