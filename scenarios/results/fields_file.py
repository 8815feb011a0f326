"""fields.h5: the undeformed section, and displacements and fields of every increment.

Every dataset carries its unit; docs/run-directory.md lists them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from scenarios.results.increment import Increment, LipContact, SectionModel
from scenarios.results.quantities import (
    CONTACT_FIELDS,
    ELEMENT_FIELDS,
    IN_NECK_FRAME,
    LIPS,
    Quantity,
)

Array = NDArray[np.float64]

FIELDS_FILE = "fields.h5"


@dataclass(frozen=True)
class FieldsOnDisk:
    """The fields of a run directory, read increment by increment."""

    file: Path

    def displacement(self, index: int) -> Array:
        """Return the displacement (n, 2), mm, of an increment."""
        with h5py.File(self.file, "r") as store:
            displacement: Array = store["increments/displacement"][index]
        return displacement

    def element(self, index: int) -> Mapping[str, Array]:
        """Return the element fields (e,) of an increment, by name of ELEMENT_FIELDS."""
        with h5py.File(self.file, "r") as store:
            return {
                quantity.name: store[f"element/{quantity.name}"][index].astype(float)
                for quantity in ELEMENT_FIELDS
            }


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
    for lip, edges in model.skin.items():
        mesh[f"{lip}_skin"] = edges
        mesh[f"{lip}_skin"].attrs["order"] = "first, last, middle node of each edge"
    for name, line in model.outlines.items():
        store[f"outlines/{name}"] = line
        store[f"outlines/{name}"].attrs["unit"] = "mm"
        store[f"outlines/{name}"].attrs["frame"] = "neck" if name in IN_NECK_FRAME else "head"


class FieldRows:
    """Writes datasets with a row for each of ``count`` increments; the first makes them."""

    def __init__(self, store: h5py.File, count: int) -> None:
        self._store, self._count = store, count
        # Kept open: to find a dataset by its name again takes longer than to write its row.
        self._open: dict[str, h5py.Dataset] = {}

    def write(self, index: int, increment: Increment) -> None:
        """Write row ``index`` of every dataset."""
        place = increment.placement
        times = Quantity("time_s", "s", "time of the recording")
        where = Quantity("placement", "rad, mm, mm", "neck frame in the head frame: angle, x, y")
        moved = Quantity("displacement", "mm", "of every node, head frame")
        placement = np.array([place.angle_rad, *place.shift_mm])
        self._row("increments", times, np.array(increment.time_s), index, "f8")
        self._row("increments", where, placement, index, "f8")
        self._row("increments", moved, increment.displacement, index, "f8")
        for quantity in ELEMENT_FIELDS:
            self._row("element", quantity, increment.element[quantity.name], index, "f4")
        for lip, contact in increment.contact.items():
            group = f"contact/{lip}"
            if index == 0:
                self._store[f"{group}/arc_mm"] = contact.arc_mm
                self._store[f"{group}/arc_mm"].attrs["unit"] = "mm"
            for quantity in CONTACT_FIELDS:
                self._row(group, quantity, getattr(contact, quantity.name), index, "f8")

    def _row(
        self, group: str, quantity: Quantity, values: NDArray[Any], index: int, kind: str
    ) -> None:
        path = f"{group}/{quantity.name}"
        if path not in self._open:
            packed = {"chunks": (1, *values.shape), "compression": "gzip", "compression_opts": 1}
            options = packed if values.ndim else {}
            shape = (self._count, *values.shape)
            self._open[path] = self._store.create_dataset(path, shape, kind, **options)
            self._open[path].attrs["unit"] = quantity.unit
            self._open[path].attrs["meaning"] = quantity.meaning
        self._open[path][index] = values
