"""fields.h5: the undeformed section, and displacements and fields of every increment.

Every dataset carries its unit and names its axes by dimension scales, as netCDF-4 does, so that
xarray reads each group with names; docs/reference/files.md lists them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from scenarios.results.fields import held_fields
from scenarios.results.increment import Increment, LipContact, SectionModel, SolutionError
from scenarios.results.quantities import (
    CONTACT_FIELDS,
    ELEMENT_FIELDS,
    IN_NECK_FRAME,
    LIPS,
    Quantity,
)

Array = NDArray[np.float64]

FIELDS_FILE = "fields.h5"

INDEX_ONLY = "This is a netCDF dimension but not a netCDF variable.{:10d}"
"""What netCDF-4 calls the scale of an axis that has a length and no values."""

ALONG = {
    "time_s": ("time_s",),
    "placement": ("time_s", "angle_x_y"),
    "displacement": ("time_s", "node", "axis"),
}
"""Names of the axes of what is in the group ``increments``."""


@dataclass(frozen=True)
class FieldsOnDisk:
    """The fields of a run directory, read increment by increment."""

    file: Path

    def displacement(self, index: int) -> Array:
        """Return the displacement (n, 2), mm, of an increment."""
        with opened(self.file) as store:
            displacement: Array = store["increments/displacement"][index]
        return displacement

    def element(self, index: int) -> Mapping[str, Array]:
        """Return the element fields (e,) of an increment, by name of ELEMENT_FIELDS."""
        with opened(self.file) as store:
            return {name: store[f"element/{name}"][index].astype(float) for name in self.names}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The element fields that are kept, in the order of ELEMENT_FIELDS."""
        with opened(self.file) as store:
            return held_fields(store["element"])

    def along(self, name: str) -> Array:
        """Return an element field in every increment, (k, e)."""
        with opened(self.file) as store:
            values: Array = store[f"element/{name}"][:].astype(float)
        return values


@contextmanager
def opened(file: Path) -> Iterator[h5py.File]:
    """Yield a file of fields to be read.

    Raises
    ------
    SolutionError
        If the file cannot be read, or the block finds a dataset missing or of another shape.
    """
    try:
        with h5py.File(file, "r") as store:
            yield store
    except (OSError, KeyError, TypeError, ValueError, RuntimeError) as error:
        if isinstance(error, DrinksimError):
            raise
        raise SolutionError(
            f"{file} is damaged, or not what drinksim wrote: replay the run again"
        ) from error


def read_model(store: h5py.File) -> SectionModel:
    """Return the undeformed section of an open file."""
    mesh = store["mesh"]
    return SectionModel(
        nodes=mesh["nodes"][:],
        triangles=mesh["triangles6"][:],
        region=mesh["region"][:],
        region_names=tuple(str(name) for name in mesh["region"].attrs["regions"]),
        skin={lip: mesh[f"{lip}_skin"][:] for lip in LIPS if f"{lip}_skin" in mesh},
        outlines={name: line[:] for name, line in store["outlines"].items()},
    )


def read_contact(store: h5py.File) -> dict[str, LipContact]:
    """Return the contact along each lip in an open file."""
    return {
        lip: LipContact(
            arc_mm=group["arc_mm"][:],
            fields={quantity.name: group[quantity.name][:] for quantity in CONTACT_FIELDS},
        )
        for lip, group in store["contact"].items()
    }


def write_model(store: h5py.File, model: SectionModel) -> None:
    """Write the undeformed section into a new file."""
    store.attrs["about"] = "drinksim replay; lengths in mm, stresses in MPa, head frame, y up"
    mesh = store.create_group("mesh")
    mesh["nodes"] = model.nodes
    mesh["nodes"].attrs["unit"] = "mm"
    mesh["triangles6"] = model.triangles
    mesh["triangles6"].attrs["order"] = "corners 0, 1, 2, then the middles of 01, 12, 20"
    mesh["region"] = model.region
    mesh["region"].attrs["regions"] = list(model.region_names)
    _name_axes(mesh["nodes"], "node", "axis")
    _name_axes(mesh["triangles6"], "triangle", "triangle_node")
    _name_axes(mesh["region"], "triangle")
    for lip, edges in model.skin.items():
        mesh[f"{lip}_skin"] = edges
        mesh[f"{lip}_skin"].attrs["order"] = "first, last, middle node of each edge"
        _name_axes(mesh[f"{lip}_skin"], f"{lip}_edge", "edge_node")
    for name, line in model.outlines.items():
        store[f"outlines/{name}"] = line
        store[f"outlines/{name}"].attrs["unit"] = "mm"
        store[f"outlines/{name}"].attrs["frame"] = "neck" if name in IN_NECK_FRAME else "head"
        _name_axes(store[f"outlines/{name}"], f"{name}_point", "axis")


def _name_axes(dataset: h5py.Dataset, *names: str) -> None:
    """Name the axes of a dataset by scales of the file's root, made where they are not there."""
    store = dataset.file
    for number, (name, length) in enumerate(zip(names, dataset.shape, strict=True)):
        if name not in store:
            store.create_dataset(name, (length,), ">f4").make_scale(INDEX_ONLY.format(length))
        dataset.dims[number].attach_scale(store[name])


class FieldRows:
    """Writes datasets with a row for each of ``count`` increments; the first makes them."""

    def __init__(self, store: h5py.File, count: int) -> None:
        self._store, self._count = store, count
        # Kept open: to find a dataset by its name again takes longer than to write its row.
        self._open: dict[str, h5py.Dataset] = {}

    def write(self, index: int, increment: Increment) -> None:
        """Write row ``index`` of every dataset."""
        if index == 0:
            self._name_instants()
        self._store["time_s"][index] = increment.time_s
        place = increment.placement
        times = Quantity("time_s", "s", "time of the recording")
        where = Quantity("placement", "rad, mm, mm", "neck frame in the head frame: angle, x, y")
        moved = Quantity("displacement", "mm", "of every node, head frame")
        placement = np.array([place.angle_rad, *place.shift_mm])
        for quantity, values in (
            (times, np.array(increment.time_s)),
            (where, placement),
            (moved, increment.displacement),
        ):
            self._row("increments", quantity, values, index, "f8", ALONG[quantity.name])
        axes = ("time_s", "triangle")
        held = held_fields(increment.element)
        for quantity in ELEMENT_FIELDS:
            if quantity.name in held:
                self._row("element", quantity, increment.element[quantity.name], index, "f4", axes)
        for lip, contact in increment.contact.items():
            group = f"contact/{lip}"
            if index == 0:
                self._store[f"{group}/arc_mm"] = contact.arc_mm
                self._store[f"{group}/arc_mm"].attrs["unit"] = "mm"
                self._store[f"{group}/arc_mm"].make_scale("arc_mm")
            axes = ("time_s", f"{group}/arc_mm")
            for quantity in CONTACT_FIELDS:
                self._row(group, quantity, getattr(contact, quantity.name), index, "f8", axes)

    def _name_instants(self) -> None:
        """Make the scale that the first axis of every field has."""
        scale = self._store.create_dataset("time_s", (self._count,), "f8")
        scale.attrs["unit"] = "s"
        scale.make_scale("time_s")

    def _row(
        self,
        group: str,
        quantity: Quantity,
        values: NDArray[Any],
        index: int,
        kind: str,
        axes: tuple[str, ...],
    ) -> None:
        path = f"{group}/{quantity.name}"
        if path not in self._open:
            packed = {"chunks": (1, *values.shape), "compression": "gzip", "compression_opts": 1}
            options = packed if values.ndim else {}
            shape = (self._count, *values.shape)
            self._open[path] = self._store.create_dataset(path, shape, kind, **options)
            self._open[path].attrs["unit"] = quantity.unit
            self._open[path].attrs["meaning"] = quantity.meaning
            _name_axes(self._open[path], *axes)
        self._open[path][index] = values
