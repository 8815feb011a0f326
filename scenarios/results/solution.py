"""The solution of a replay: named outputs with units against time, on disk and in memory.

A run directory holds ``scenario.toml`` (everything resolved), ``motion.csv``, ``history.csv``,
``fields.h5``, ``summary.json`` and ``run.log``; :mod:`scenarios.results.writer` fills it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement
from scenarios.settings.tables import nearest

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

LIPS = ("upper", "lower")
IN_NECK_FRAME = ("upper_wall", "lower_wall", "package")
"""The outlines of a model that move with the neck."""


class SolutionError(DrinksimError):
    """A run directory does not hold what is asked of it."""


@dataclass(frozen=True)
class Quantity:
    """Name, unit and meaning of one output."""

    name: str
    unit: str
    meaning: str


HISTORY = (
    Quantity("time_s", "s", "time of the recording"),
    Quantity("relative_time", "", "0 at the start of the replay, 1 at its end"),
    Quantity("package_x_mm", "mm", "lower mark of the neck in the head frame, forward"),
    Quantity("package_y_mm", "mm", "lower mark of the neck in the head frame, up"),
    Quantity("package_theta_deg", "deg", "turn of the neck in the head frame"),
    Quantity("dermis_min_log_strain", "", "smallest principal logarithmic strain in the dermis"),
    Quantity("dermis_max_log_strain", "", "largest principal logarithmic strain in the dermis"),
    Quantity("dermis_max_mises_kpa", "kPa", "largest von Mises stress in the dermis"),
    Quantity("upper_lip_pressure_kpa", "kPa", "mean of the two most pressed surface elements"),
    Quantity("lower_lip_pressure_kpa", "kPa", "mean of the two most pressed surface elements"),
    Quantity("upper_lip_window_kpa", "kPa", "highest mean pressure over 0.5 mm of deformed lip"),
    Quantity("lower_lip_window_kpa", "kPa", "highest mean pressure over 0.5 mm of deformed lip"),
    Quantity("upper_lip_contact_mm", "mm", "deformed length of lip within 0.005 mm of the neck"),
    Quantity("lower_lip_contact_mm", "mm", "deformed length of lip within 0.005 mm of the neck"),
    Quantity("upper_lip_force_x_n", "N", "force of the upper lip on the neck, forward"),
    Quantity("upper_lip_force_y_n", "N", "force of the upper lip on the neck, up"),
    Quantity("lower_lip_force_x_n", "N", "force of the lower lip on the neck, forward"),
    Quantity("lower_lip_force_y_n", "N", "force of the lower lip on the neck, up"),
    Quantity("newton_iterations", "", "iterations of this increment, rejected trials included"),
    Quantity("cutbacks", "", "times this increment was cut back"),
)
"""The columns of history.csv, in order."""

ELEMENT_FIELDS = (
    Quantity("log_strain_min", "", "smallest principal logarithmic strain, element mean"),
    Quantity("log_strain_max", "", "largest principal logarithmic strain, element mean"),
    Quantity("von_mises_mpa", "MPa", "von Mises stress, element mean"),
)
CONTACT_FIELDS = (
    Quantity("pressure_mpa", "MPa", "contact pressure of the neck on the lip"),
    Quantity("shear_mpa", "MPa", "contact shear of the neck on the lip"),
    Quantity("gap_mm", "mm", "distance to the neck, negative where they overlap"),
    Quantity("neck_arc_mm", "mm", "place on the outline of the wall that is touched, or nan"),
)


@dataclass(frozen=True)
class Model:
    """The section as it was before anything touched it.

    Parameters
    ----------
    nodes
        (n, 2) positions in the head frame, mm.
    triangles
        (e, 6) nodes of quadratic triangles: corners 0, 1, 2, then the middles of 01, 12, 20.
    region, region_names
        (e,) index of the region of each triangle, and the names (``upper_dermis``, …).
    skin
        by lip, (m, 3) nodes (first, last, middle) of the edges that may touch, in order: the outer
        skin and the lip's free inner side. The arc length of contact fields starts at the first.
    outlines
        polylines (k, 2), mm. In the neck frame ``upper_wall``, ``lower_wall`` and ``package``, what
        one sees of it from the side; in the head frame ``upper_tooth``, ``lower_tooth``,
        ``upper_jaw``, ``lower_jaw`` and ``profile`` of the face. Any may be absent.
    """

    nodes: Array
    triangles: Integers
    region: Integers
    region_names: tuple[str, ...]
    skin: Mapping[str, Integers]
    outlines: Mapping[str, Array]


@dataclass(frozen=True)
class ContactField:
    """What happens along the free surface of one lip, at its nodes in order.

    All arrays are (s,): ``arc_mm`` on the undeformed surface, increasing, ``pressure_mpa``,
    ``shear_mpa``, ``gap_mm`` and ``neck_arc_mm``, the arc length along the wall outline touched
    (nan where none). Pressure and shear are linear along each edge and recovered from the forces
    of the nodes, so they may reach an edge beyond the last node that touches.
    """

    arc_mm: Array
    pressure_mpa: Array
    shear_mpa: Array
    gap_mm: Array
    neck_arc_mm: Array


@dataclass(frozen=True)
class Increment:
    """One converged step of a replay.

    Parameters
    ----------
    time_s, relative_time
        time of the recording, s, and 0…1 over the replay.
    placement
        the neck frame in the head frame.
    displacement
        (n, 2) mm.
    element
        by name of :data:`ELEMENT_FIELDS`, (e,) element means.
    contact
        by lip.
    history
        by name of :data:`HISTORY`; time, package and iteration columns may be left out, because
        they follow from the other members.
    newton_iterations, cutbacks
        what the step cost.
    state
        arrays by name that the solver needs besides the displacement to go on from here.
    """

    time_s: float
    relative_time: float
    placement: RigidPlacement
    displacement: Array
    element: Mapping[str, NDArray[Any]]
    contact: Mapping[str, ContactField]
    history: Mapping[str, float]
    newton_iterations: int
    cutbacks: int
    state: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def row(self) -> dict[str, float]:
        """Return the line of history.csv of this increment, by column."""
        known = {
            **self.history,
            "time_s": self.time_s,
            "relative_time": self.relative_time,
            "package_x_mm": self.placement.shift_mm[0],
            "package_y_mm": self.placement.shift_mm[1],
            "package_theta_deg": math.degrees(self.placement.angle_rad),
            "newton_iterations": self.newton_iterations,
            "cutbacks": self.cutbacks,
        }
        names = {quantity.name for quantity in HISTORY}
        if known.keys() != names:
            raise SolutionError(
                f"history columns missing: {sorted(names - known.keys())}, "
                f"unknown: {sorted(known.keys() - names)}"
            )
        return {quantity.name: float(known[quantity.name]) for quantity in HISTORY}


@dataclass(frozen=True)
class Output:
    """One output against time: ``values`` (k,) at ``time_s`` (k,), in ``quantity.unit``."""

    quantity: Quantity
    time_s: Array
    values: Array

    def at(self, time_s: float) -> float:
        """Return the value at a time, s, linear between increments, constant beyond the ends."""
        return float(np.interp(time_s, self.time_s, self.values))


@dataclass(frozen=True)
class Frame:
    """The section at one instant: placement of the neck, and fields as in :class:`Increment`.

    ``pressure_mpa`` holds (s,) contact pressures by lip.
    """

    time_s: float
    placement: RigidPlacement
    displacement: Array
    element: Mapping[str, Array]
    pressure_mpa: Mapping[str, Array]


@dataclass(frozen=True)
class ContactHistory:
    """Contact along one lip: ``arc_mm`` (s,), and (k, s) fields by name of CONTACT_FIELDS."""

    arc_mm: Array
    fields: Mapping[str, Array]


@dataclass(frozen=True)
class Solution:
    """A finished run: ``solution["upper_lip_pressure_kpa"]`` is an :class:`Output`.

    Displacements and element fields stay on disk and are read frame by frame.
    """

    folder: Path
    summary: Mapping[str, Any]
    model: Model
    time_s: Array
    angle_rad: Array
    shift_mm: Array
    history: Mapping[str, Array]
    contact: Mapping[str, ContactHistory]

    @classmethod
    def load(cls, folder: Path) -> Solution:
        """Return the solution of a run directory; :class:`SolutionError` if it is not one."""
        _check_run_directory(folder)
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        with h5py.File(folder / "fields.h5", "r") as store:
            placement = store["increments/placement"][:]
            return cls(
                folder=folder,
                summary=summary,
                model=_read_model(store),
                time_s=store["increments/time_s"][:],
                angle_rad=placement[:, 0],
                shift_mm=placement[:, 1:],
                history=read_history(folder / "history.csv"),
                contact={lip: _read_contact(store[f"contact/{lip}"]) for lip in store["contact"]},
            )

    def __getitem__(self, name: str) -> Output:
        for quantity in HISTORY:
            if quantity.name == name:
                return Output(quantity, self.time_s, self.history[name])
        raise SolutionError(
            f"no output {name!r}: {nearest(name, (quantity.name for quantity in HISTORY))}"
        )

    def frame(self, index: int) -> Frame:
        """Return the section at the increment ``index``."""
        with h5py.File(self.folder / "fields.h5", "r") as store:
            displacement = store["increments/displacement"][index]
            element = {
                quantity.name: store[f"element/{quantity.name}"][index].astype(float)
                for quantity in ELEMENT_FIELDS
            }
        return Frame(
            time_s=float(self.time_s[index]),
            placement=RigidPlacement(
                float(self.angle_rad[index]),
                (float(self.shift_mm[index, 0]), float(self.shift_mm[index, 1])),
            ),
            displacement=displacement,
            element=element,
            pressure_mpa={
                lip: history.fields["pressure_mpa"][index] for lip, history in self.contact.items()
            },
        )

    def at(self, time_s: float) -> Frame:
        """Return the section at a time, s, linear between increments, constant beyond the ends."""
        after = int(np.clip(np.searchsorted(self.time_s, time_s), 1, max(self.time_s.size - 1, 1)))
        if self.time_s.size == 1:
            return self.frame(0)
        first, second = self.frame(after - 1), self.frame(after)
        weight = (time_s - first.time_s) / (second.time_s - first.time_s)
        return _between(first, second, float(np.clip(weight, 0.0, 1.0)))


def peaks_in_words(summary: Mapping[str, Any]) -> str:
    """Return the extreme values of a run's summary in one line."""
    return (
        f"highest contact pressure {summary['upper_lip_pressure_kpa']:.0f} kPa on the upper lip, "
        f"{summary['lower_lip_pressure_kpa']:.0f} kPa on the lower lip; in the dermis log strain "
        f"{summary['dermis_min_log_strain']:.2f} to {summary['dermis_max_log_strain']:.2f}, "
        f"von Mises stress to {summary['dermis_max_mises_kpa']:.0f} kPa"
    )


def read_history(file: Path) -> dict[str, Array]:
    """Return the columns of a history.csv by name."""
    with file.open(encoding="utf-8") as stream:
        names = stream.readline().strip().split(",")
        rows = np.loadtxt(stream, delimiter=",", ndmin=2)
    expected = [quantity.name for quantity in HISTORY]
    if names != expected:
        raise SolutionError(f"{file} does not have the columns of a history: {','.join(expected)}")
    return {name: rows[:, column] for column, name in enumerate(names)}


def _check_run_directory(folder: Path) -> None:
    partial = folder.with_name(folder.name + ".partial")
    if not folder.is_dir():
        remedy = "finish it with --resume" if partial.is_dir() else "run drinksim replay first"
        raise SolutionError(f"no run directory {folder}: {remedy}")
    for name in ("summary.json", "history.csv", "fields.h5"):
        if not (folder / name).is_file():
            raise SolutionError(f"{folder} is not a run directory: {name} is missing")


def _read_model(store: h5py.File) -> Model:
    mesh = store["mesh"]
    return Model(
        nodes=mesh["nodes"][:],
        triangles=mesh["triangles6"][:],
        region=mesh["region"][:],
        region_names=tuple(str(name) for name in mesh["region"].attrs["regions"]),
        skin={lip: mesh[f"{lip}_skin"][:] for lip in LIPS if f"{lip}_skin" in mesh},
        outlines={name: line[:] for name, line in store["outlines"].items()},
    )


def _read_contact(group: h5py.Group) -> ContactHistory:
    return ContactHistory(
        arc_mm=group["arc_mm"][:],
        fields={quantity.name: group[quantity.name][:] for quantity in CONTACT_FIELDS},
    )


def _between(first: Frame, second: Frame, weight: float) -> Frame:
    def mixed(a: Array, b: Array) -> Array:
        return (1.0 - weight) * a + weight * b

    angle = float(mixed(np.array(first.placement.angle_rad), np.array(second.placement.angle_rad)))
    x, y = mixed(np.array(first.placement.shift_mm), np.array(second.placement.shift_mm))
    return Frame(
        time_s=(1.0 - weight) * first.time_s + weight * second.time_s,
        placement=RigidPlacement(angle, (float(x), float(y))),
        displacement=mixed(first.displacement, second.displacement),
        element={k: mixed(v, second.element[k]) for k, v in first.element.items()},
        pressure_mpa={k: mixed(v, second.pressure_mpa[k]) for k, v in first.pressure_mpa.items()},
    )
