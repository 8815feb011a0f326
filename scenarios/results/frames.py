"""Solutions as tables of pandas and as data sets of xarray, for those who have them."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from scenarios.results.fields import FieldStore
from scenarios.results.increment import LipContact, SectionModel, SolutionError
from scenarios.results.quantities import CONTACT_FIELDS, ELEMENT_FIELDS, HISTORY

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Array = NDArray[np.float64]


def history_table(history: Mapping[str, Array]) -> pd.DataFrame:
    """Return the histories as columns, a row an increment; ``attrs["units"]`` holds the units.

    Raises
    ------
    SolutionError
        If pandas is not installed.
    """
    table: pd.DataFrame = _imported("pandas").DataFrame(dict(history))
    table.attrs["units"] = {quantity.name: quantity.unit for quantity in HISTORY}
    return table


def data_set(
    model: SectionModel,
    *,
    time_s: Array,
    history: Mapping[str, Array],
    contact: Mapping[str, LipContact],
    fields: FieldStore,
    name: str,
) -> xr.Dataset:
    """Return everything of a solution, with units and meanings as attributes.

    Histories, displacements, element fields and contact fields lie along ``time_s``; the undeformed
    section is beside them. All is read into memory. The arguments are the members of a
    :class:`scenarios.results.solution.Solution`.

    Raises
    ------
    SolutionError
        If xarray is not installed.
    """
    xarray = _imported("xarray")
    times = range(time_s.size)
    data: dict[str, Any] = {
        quantity.name: (
            "time_s",
            history[quantity.name],
            {"units": quantity.unit, "long_name": quantity.meaning},
        )
        for quantity in HISTORY
        if quantity.name != "time_s"
    }
    moved = np.array([fields.displacement(index) for index in times])
    data["displacement_mm"] = (("time_s", "node", "axis"), moved, {"units": "mm"})
    for quantity in ELEMENT_FIELDS:
        if quantity.name in fields.names:
            about = {"units": quantity.unit, "long_name": quantity.meaning}
            data[quantity.name] = (("time_s", "element"), fields.along(quantity.name), about)
    for lip, along in contact.items():
        for quantity in CONTACT_FIELDS:
            about = {"units": quantity.unit, "long_name": quantity.meaning}
            place = ("time_s", f"{lip}_lip_arc_mm")
            data[f"{lip}_lip_{quantity.name}"] = (place, along.fields[quantity.name], about)
    data["nodes_mm"] = (("node", "axis"), model.nodes, {"units": "mm"})
    data["triangles"] = (("element", "corner"), model.triangles)
    coordinates = {
        "time_s": ("time_s", time_s, {"units": "s"}),
        "axis": ["x", "y"],
        "region": ("element", np.array(model.region_names)[model.region]),
    }
    for lip, along in contact.items():
        arc = f"{lip}_lip_arc_mm"
        coordinates[arc] = (arc, along.arc_mm, {"units": "mm"})
    dataset: xr.Dataset = xarray.Dataset(data, coordinates, attrs={"scenario": name})
    return dataset


def _imported(package: str) -> ModuleType:
    """Return an optional package.

    Raises
    ------
    SolutionError
        If it is not installed.
    """
    try:
        return import_module(package)
    except ImportError as error:
        raise SolutionError(
            f"{package} is not installed: pip install 'drinksim[notebook]'"
        ) from error
