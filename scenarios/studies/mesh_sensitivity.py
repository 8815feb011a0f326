"""How the suction test depends on type and size of elements."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem2d.materials.material import Material
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.progress import Progress
from scenarios.settings.tables import table_from
from scenarios.studies.files import write_table
from scenarios.studies.suction_curve import Aspiration, CurveOptions, aspirated

MESH_ELEMENTS = ("Q4", "Q4R", "Q4M", "Q8", "Q8R", "Q8M", "T6", "T6M")

MESH_EDGES_MM = (1.2, 0.8, 0.5, 0.35, 0.25)

REFERENCE_EDGE_MM = 0.12

REFERENCE_ELEMENT = "Q8R"

DISPLACEMENT_ERROR = 0.025

STRESS_ERROR = 0.05
"""The thesis' demands on its mesh."""


class MeshStudyError(DrinksimError):
    """A comparison of meshes was asked for that contradicts itself."""


@dataclass(frozen=True)
class MeshRow:
    """One mesh of the convergence study.

    Attributes
    ----------
    displacement_error, stress_error
        Relative, against the reference mesh.
    """

    element: str
    edge_mm: float
    elements: int
    apex_mm: float
    mises_kpa: float
    seconds: float
    displacement_error: float
    stress_error: float


def mesh_study(
    folder: Path,
    configuration: str,
    layers: Mapping[str, Material],
    options: CurveOptions,
    progress: Progress,
) -> tuple[str, ...]:
    """Compute the test on meshes of many kinds; write ``mesh.csv``, a picture; return messages.

    Raises
    ------
    MeshStudyError
        If the options choose an element or an edge length, which this study varies.
    """
    usual = CurveOptions()
    for name in ("element", "edge_mm"):
        if getattr(options, name) != getattr(usual, name):
            raise MeshStudyError(
                f"{name} = {getattr(options, name)} has no effect, as elements and their sizes are "
                "what is varied: leave it out"
            )
    progress(0.0, "reference")
    exact = aspirated(layers, _meshed(options, REFERENCE_ELEMENT, REFERENCE_EDGE_MM))
    rows: list[MeshRow] = []
    cases = [(element, edge) for element in MESH_ELEMENTS for edge in MESH_EDGES_MM]
    for number, (element, edge) in enumerate(cases, start=1):
        progress(number / (1 + len(cases)), f"{element}, {edge:g} mm")
        row = _row(layers, _meshed(options, element, edge), exact)
        if row is not None:
            rows.append(row)
    header = [field.name for field in dataclasses.fields(MeshRow)]
    write_table(folder / "mesh.csv", header, [dataclasses.astuple(row) for row in rows])
    _plot_mesh(folder / "mesh.png", configuration, rows)
    return tuple(_messages(rows, exact))


def _meshed(options: CurveOptions, element: str, edge_mm: float) -> CurveOptions:
    """Return the options with another mesh, checked like those of the command line."""
    values = {"element": element, "edge_mm": edge_mm}
    return table_from(CurveOptions, values, where="", base=options)


def _row(
    layers: Mapping[str, Material], options: CurveOptions, exact: Aspiration
) -> MeshRow | None:
    """Return what a mesh gives; None if it does not come to the end of the curve."""
    started = time.process_time()
    curve = aspirated(layers, options)
    seconds = time.process_time() - started
    if not np.isclose(curve.suction_kpa[-1], options.suction_kpa):
        return None
    apex, mises = float(curve.apex_mm[-1]), float(curve.max_mises_kpa[-1])
    return MeshRow(
        options.element,
        options.edge_mm,
        int(curve.model.fem_model.body.mesh.t.shape[1]),
        apex,
        mises,
        seconds,
        abs(apex / float(exact.apex_mm[-1]) - 1),
        abs(mises / float(exact.max_mises_kpa[-1]) - 1),
    )


def _messages(rows: Sequence[MeshRow], exact: Aspiration) -> Iterator[str]:
    yield (
        f"reference: {REFERENCE_ELEMENT}, {REFERENCE_EDGE_MM:g} mm, apex {exact.apex_mm[-1]:.4f} "
        f"mm, von Mises {exact.max_mises_kpa[-1]:.3f} kPa"
    )
    for element in MESH_ELEMENTS:
        row = _coarsest_good([row for row in rows if row.element == element])
        if row is None:
            yield f"{element} is not within the limits on any of these meshes"
        else:
            yield (
                f"{element} is within {100 * DISPLACEMENT_ERROR:g} % in displacement and "
                f"{100 * STRESS_ERROR:g} % in stress with {row.elements} elements of "
                f"{row.edge_mm:g} mm: {row.seconds:.1f} s of processor time"
            )


def _coarsest_good(rows: Sequence[MeshRow]) -> MeshRow | None:
    """Return the coarsest mesh that, like all finer ones, is within the limits; None if none is."""
    found = None
    for row in sorted(rows, key=lambda r: r.edge_mm):
        if row.displacement_error > DISPLACEMENT_ERROR or row.stress_error > STRESS_ERROR:
            break
        found = row
    return found


def _plot_mesh(path: Path, configuration: str, rows: Sequence[MeshRow]) -> None:
    from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled

    figure = blank_figure(11.0, 3.8)
    left, middle, right = figure.subplots(1, 3)
    for colour, element in zip(COLOURS, MESH_ELEMENTS, strict=False):
        mine = [row for row in rows if row.element == element]
        count = [row.elements for row in mine]
        for axes, values in (
            (left, [100 * max(row.displacement_error, 1e-6) for row in mine]),
            (middle, [100 * max(row.stress_error, 1e-6) for row in mine]),
            (right, [row.seconds for row in mine]),
        ):
            axes.loglog(count, values, "o-", color=colour, markersize=3, label=element)
    left.axhline(100 * DISPLACEMENT_ERROR, color="0.6", linestyle="--", linewidth=0.8)
    middle.axhline(100 * STRESS_ERROR, color="0.6", linestyle="--", linewidth=0.8)
    labelled(left, "elements", "error of the apex displacement (%)")
    labelled(middle, "elements", "error of the largest von Mises stress (%)")
    labelled(right, "elements", "processor time (s)")
    right.legend(frameon=False, fontsize=8)
    figure.suptitle(f"Meshes for the aspiration of {configuration}")
    finish(figure, path)
