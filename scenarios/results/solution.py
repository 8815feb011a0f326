"""The solution of a replay: named outputs against time, and the section at any instant.

A solution is the same in memory and on disk. It holds what a run directory holds, to the same
digits: element fields in single precision, history to nine significant digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import partial_directory
from geometry2d.foundation.provided import Provided
from geometry2d.rigid import UNMOVED, RigidPlacement
from mocap.motion.motion import Motion
from scenarios.results.fields import FieldsInMemory, FieldStore, held_fields
from scenarios.results.fields_file import (
    FIELDS_FILE,
    FieldsOnDisk,
    opened,
    read_contact,
    read_model,
)
from scenarios.results.frames import data_set, history_table
from scenarios.results.history_file import COLUMNS, HISTORY_FILE, as_written, read_history
from scenarios.results.increment import Increment, LipContact, SectionModel, SolutionError
from scenarios.results.integrity import checked_summary
from scenarios.results.quantities import (
    CONTACT_FIELDS,
    HISTORY,
    JAW_HINGE,
    Quantity,
)
from scenarios.results.summary import SUMMARY_FILE
from scenarios.settings.files import SCENARIO_FILE
from scenarios.settings.names import nearest
from scenarios.settings.person import Jaw
from scenarios.settings.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

HistoryPlot: TypeAlias = "Callable[[History, Axes | None], Axes]"
SnapshotPlot: TypeAlias = "Callable[[Snapshot, str, Axes | None], Axes]"
NotebookMarkup: TypeAlias = "Callable[[Solution], str]"

HISTORY_PLOT: Provided[HistoryPlot] = Provided("History.plot")
SNAPSHOT_PLOT: Provided[SnapshotPlot] = Provided("Snapshot.plot")
NOTEBOOK_MARKUP: Provided[NotebookMarkup] = Provided("Solution._repr_html_")


@dataclass(frozen=True)
class History:
    """One output against time: ``values`` (k,) at ``time_s`` (k,), in ``quantity.unit``."""

    quantity: Quantity
    time_s: Array
    values: Array

    def __repr__(self) -> str:
        low, high = float(self.values.min()), float(self.values.max())
        unit = f" {self.quantity.unit}" if self.quantity.unit else ""
        return (
            f"<History {self.quantity.name}: {low:.4g} to {high:.4g}{unit}, "
            f"{self.time_s[0]:.2f} to {self.time_s[-1]:.2f} s>"
        )

    def at(self, time_s: float) -> float:
        """Return the value at a time, s, linear between increments, constant beyond the ends."""
        return float(np.interp(time_s, self.time_s, self.values))

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the values against time and return the axes, new ones of pyplot by default."""
        return HISTORY_PLOT.function(self, axes)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The section at one instant.

    Attributes
    ----------
    model
        The undeformed section.
    time_s
        When, s.
    placement, displacement, element
        As in :class:`Increment`.
    jaw
        Placement of the lower jaw, from where it is in the model.
    arc_mm, pressure_mpa
        By lip, (s,) places on its undeformed surface, and the contact pressures there.
    """

    model: SectionModel

    time_s: float
    placement: RigidPlacement
    displacement: Array
    element: Mapping[str, Array]
    arc_mm: Mapping[str, Array]
    pressure_mpa: Mapping[str, Array]
    jaw: RigidPlacement = UNMOVED

    def plot(self, field: str = "von_mises", axes: Axes | None = None) -> Axes:
        """Draw the section in the head frame and return the axes, new ones of pyplot by default.

        ``field`` colours the tissue: ``von_mises``, ``log_strain_max``, ``log_strain_min``,
        ``thickness_stretch`` or ``activation``.
        """
        return SNAPSHOT_PLOT.function(self, field, axes)

    def __repr__(self) -> str:
        highest = 1e3 * max(float(pressure.max()) for pressure in self.pressure_mpa.values())
        return f"<Snapshot at {self.time_s:.3f} s, contact pressure to {highest:.1f} kPa>"


@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """A replay: ``solution["upper_lip_window_kpa"]`` is a :class:`History`.

    Two solutions are equal if model, histories and fields are, wherever they are kept.

    Attributes
    ----------
    summary
        Peaks, extremes and how the replay ended: what summary.json holds.
    model
        The undeformed section.
    time_s
        (k,) of the increments.
    angle_rad, shift_mm
        (k,), (k, 2) placement of the neck frame in the head frame.
    history
        (k,) by name of :data:`HISTORY`.
    contact
        By lip.
    fields
        Displacements and element fields; :meth:`snapshot` reads them.
    folder
        The run directory; None if the solution is in memory only.
    replayed
        The scenario, if it is known without reading the run directory; see :attr:`scenario`.
    """

    summary: Mapping[str, Any]
    model: SectionModel
    time_s: Array
    angle_rad: Array
    shift_mm: Array
    history: Mapping[str, Array]
    contact: Mapping[str, LipContact]
    fields: FieldStore
    folder: Path | None = None
    replayed: Scenario | None = None

    @classmethod
    def of(
        cls,
        scenario: Scenario,
        model: SectionModel,
        increments: Sequence[Increment],
        summary: Mapping[str, Any],
    ) -> Solution:
        """Return the solution of a replay, in memory.

        Parameters
        ----------
        scenario
            What was replayed.
        model
            The undeformed section.
        increments
            At least one.
        summary
            Of :func:`scenarios.results.summary.run_summary`.
        """
        rows = [as_written(increment.row()) for increment in increments]
        columns = np.array(rows, dtype=float).T
        return cls(
            summary=summary,
            model=model,
            time_s=np.array([increment.time_s for increment in increments]),
            angle_rad=np.array([increment.placement.angle_rad for increment in increments]),
            shift_mm=np.array([increment.placement.shift_mm for increment in increments]),
            history=dict(zip(COLUMNS, columns, strict=True)),
            contact={lip: _lip_contact(increments, lip) for lip in increments[0].contact},
            fields=FieldsInMemory(
                [increment.displacement for increment in increments],
                [_in_single_precision(increment.element) for increment in increments],
            ),
            replayed=scenario,
        )

    @classmethod
    def load(cls, folder: Path | str) -> Solution:
        """Return the solution of a run directory; :class:`SolutionError` if it is not one."""
        folder = Path(folder)
        _check_run_directory(folder)
        summary = checked_summary(folder)
        with _written_by(summary, folder):
            history = read_history(folder / HISTORY_FILE)
        with opened(folder / FIELDS_FILE) as store:
            if store["increments/time_s"].shape != history["time_s"].shape:
                raise SolutionError(
                    f"{folder}: {HISTORY_FILE} and {FIELDS_FILE} hold different numbers of "
                    "increments; replay the run again"
                )
            placement = store["increments/placement"][:]
            return cls(
                summary=summary,
                model=read_model(store),
                time_s=store["increments/time_s"][:],
                angle_rad=placement[:, 0],
                shift_mm=placement[:, 1:],
                history=history,
                contact=read_contact(store),
                fields=FieldsOnDisk(folder / FIELDS_FILE),
                folder=folder,
            )

    @property
    def name(self) -> str:
        """The scenario's name, or the folder's where a run does not say it."""
        folder = "" if self.folder is None else self.folder.name
        return str(self.summary.get("scenario", folder))

    @property
    def finished(self) -> bool:
        """Whether the whole motion was replayed."""
        return bool(self.summary["finished"])

    @property
    def message(self) -> str:
        """How the replay ended."""
        return str(self.summary["sentence"])

    @cached_property
    def scenario(self) -> Scenario:
        """What was replayed."""
        if self.replayed is not None:
            return self.replayed
        assert self.folder is not None  # a solution without a folder knows its scenario
        with _written_by(self.summary, self.folder):
            return load_scenario(str(self.folder / SCENARIO_FILE))

    @cached_property
    def motion(self) -> Motion:
        """The motion that was replayed."""
        return self.scenario.known_motion()

    def __repr__(self) -> str:
        whole = "" if self.finished else ", unfinished"
        where = "in memory" if self.folder is None else str(self.folder)
        return (
            f"<Solution {self.name}: {self.time_s.size} increments, {self.time_s[0]:.2f} to "
            f"{self.time_s[-1]:.2f} s{whole}, {where}>"
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Solution):
            return NotImplemented
        return all(
            same_values(getattr(self, name), getattr(other, name))
            for name in ("model", "time_s", "angle_rad", "shift_mm", "history", "contact")
        ) and all(
            same_values(self.fields.displacement(index), other.fields.displacement(index))
            and same_values(self.fields.element(index), other.fields.element(index))
            for index in range(self.time_s.size)
        )

    __hash__ = None  # type: ignore[assignment]

    def __getitem__(self, name: str) -> History:
        for quantity in HISTORY:
            if quantity.name == name:
                return History(quantity, self.time_s, self.history[name])
        raise SolutionError(f"no output {name!r}: {nearest(name, COLUMNS)}")

    def snapshot(self, index: int) -> Snapshot:
        """Return the section at the increment ``index``."""
        x, y = self.shift_mm[index].tolist()
        return Snapshot(
            model=self.model,
            time_s=float(self.time_s[index]),
            jaw=self._jaw_at(float(self.time_s[index])),
            placement=RigidPlacement(float(self.angle_rad[index]), (x, y)),
            displacement=self.fields.displacement(index),
            element=self.fields.element(index),
            arc_mm={lip: contact.arc_mm for lip, contact in self.contact.items()},
            pressure_mpa={
                lip: contact.fields["pressure_mpa"][index] for lip, contact in self.contact.items()
            },
        )

    @cached_property
    def _jaw_course(self) -> Jaw | None:
        return self.scenario.head.jaw_course()

    def _jaw_at(self, time_s: float) -> RigidPlacement:
        hinge, jaw = self.model.outlines.get(JAW_HINGE), self._jaw_course
        if jaw is None or hinge is None:
            return UNMOVED
        turn_deg = jaw.opening_deg[0] - jaw.amplitude.at(time_s)
        return RigidPlacement.turned_about(hinge[0], float(np.deg2rad(turn_deg)))

    def at(self, time_s: float) -> Snapshot:
        """Return the section at a time, s, linear between increments, constant beyond the ends."""
        after = int(np.clip(np.searchsorted(self.time_s, time_s), 1, max(self.time_s.size - 1, 1)))
        if self.time_s.size == 1:
            return self.snapshot(0)
        first, second = self.snapshot(after - 1), self.snapshot(after)
        weight = (time_s - first.time_s) / (second.time_s - first.time_s)
        snapshot = _between(first, second, float(np.clip(weight, 0.0, 1.0)))
        return replace(snapshot, jaw=self._jaw_at(snapshot.time_s))

    def to_dataframe(self) -> pd.DataFrame:
        """Return the histories as a pandas table; see :mod:`scenarios.results.frames`."""
        return history_table(self.history)

    def to_xarray(self) -> xr.Dataset:
        """Return everything as an xarray data set; see :mod:`scenarios.results.frames`."""
        return data_set(
            self.model,
            time_s=self.time_s,
            history=self.history,
            contact=self.contact,
            fields=self.fields,
            name=self.name,
        )

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return str(NOTEBOOK_MARKUP.function(self))


def loaded(run: Solution | Path | str) -> Solution:
    """Return a solution, or load it from its run directory.

    Raises
    ------
    SolutionError
        If it is not a run directory.
    """
    return run if isinstance(run, Solution) else Solution.load(run)


def same_values(one: Any, other: Any) -> bool:
    """Return whether two values are equal, arrays, mappings and dataclasses member by member."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=np.asarray(one).dtype.kind == "f")
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(same_values(one[k], other[k]) for k in one)
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same_values(getattr(one, item.name), getattr(other, item.name)) for item in fields(one)
        )
    return bool(one == other)


@contextmanager
def _written_by(summary: Mapping[str, Any], folder: Path) -> Iterator[None]:
    """Name the version that wrote a run if it is another one and the run cannot be read."""
    try:
        yield
    except DrinksimError as error:
        earlier, here = summary["version"], version("drinksim")
        if earlier == here:
            raise
        raise SolutionError(
            f"{folder} was made by drinksim {earlier}, and drinksim {here} cannot read it: replay "
            f"it again, or open it with the version that made it ({error})"
        ) from error


def _lip_contact(increments: Sequence[Increment], lip: str) -> LipContact:
    return LipContact(
        arc_mm=increments[0].contact[lip].arc_mm,
        fields={
            quantity.name: np.array([getattr(i.contact[lip], quantity.name) for i in increments])
            for quantity in CONTACT_FIELDS
        },
    )


def _in_single_precision(element: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[np.float32]]:
    return {name: np.asarray(element[name], np.float32) for name in held_fields(element)}


def _check_run_directory(folder: Path) -> None:
    partial = partial_directory(folder.absolute())
    if not folder.is_dir():
        remedy = "finish it with --resume" if partial.is_dir() else "run drinksim replay first"
        raise SolutionError(f"no run directory {folder}: {remedy}")
    for name in (SUMMARY_FILE, HISTORY_FILE, FIELDS_FILE):
        if not (folder / name).is_file():
            raise SolutionError(f"{folder} is not a run directory: {name} is missing")


def _between(first: Snapshot, second: Snapshot, weight: float) -> Snapshot:
    def mixed(a: Array, b: Array) -> Array:
        return (1.0 - weight) * a + weight * b

    angle = float(mixed(np.array(first.placement.angle_rad), np.array(second.placement.angle_rad)))
    x, y = mixed(np.array(first.placement.shift_mm), np.array(second.placement.shift_mm))
    return replace(
        first,
        time_s=(1.0 - weight) * first.time_s + weight * second.time_s,
        placement=RigidPlacement(angle, (float(x), float(y))),
        displacement=mixed(first.displacement, second.displacement),
        element={k: mixed(v, second.element[k]) for k, v in first.element.items()},
        pressure_mpa={k: mixed(v, second.pressure_mpa[k]) for k, v in first.pressure_mpa.items()},
    )
