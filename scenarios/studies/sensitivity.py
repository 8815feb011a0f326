"""What the suction test depends on: layer thickness, material parameters, and the mesh.

Thesis sections 3.1.2 and 3.2.2: layers thin, standard and thick (Table 3.4, Figures 3.15 to 3.17),
every parameter ± 10 % (Figures 3.18 and 3.19), and elements of several types and sizes
(Figure 3.10).
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem2d.materials.library import MaterialCard, configuration_cards
from fem2d.materials.material import Material
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress
from scenarios.settings.tables import table_from
from scenarios.studies.aspiration import (
    Aspiration,
    AspirationOptions,
    aspirated,
    write_summary,
    write_table,
)
from scenarios.studies.calibration import layers_with, parameters_of

Array = NDArray[np.float64]

KINDS = ("thickness", "parameters", "mesh")
THICKNESS_MM: Mapping[str, tuple[float, float, float]] = {
    "dermis": (0.7851, 1.195, 1.6044),
    "hypodermis": (1.55, 2.87, 4.19),
}
"""Thin, standard, thick: thesis Table 3.4, ± 2 standard deviations."""
CHANGE = 0.1
MESH_ELEMENTS = ("Q4", "Q4R", "Q4M", "Q8", "Q8R", "Q8M", "T6", "T6M")
MESH_EDGES_MM = (1.2, 0.8, 0.5, 0.35, 0.25)
REFERENCE_EDGE_MM = 0.12
REFERENCE_ELEMENT = "Q8R"
DISPLACEMENT_ERROR = 0.025
STRESS_ERROR = 0.05
"""The thesis' demands on its mesh."""


class SensitivityError(DrinksimError):
    """A sensitivity was asked for that does not exist."""


@dataclass(frozen=True)
class SensitivityResult:
    """Where the study's files are, and what must be said about it."""

    folder: Path
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Variation:
    """One changed suction test beside the standard one.

    Attributes
    ----------
    name
        What was changed and to what.
    factor
        Of the change: what was changed, whichever way.
    curve
        The changed test.
    effect
        RMS difference from the standard curve over its range.
    """

    name: str
    factor: str
    curve: Aspiration
    effect: float


def sensitivity_study(
    configuration: str,
    kind: str,
    out: Path,
    options: AspirationOptions | None = None,
    *,
    progress: Progress = lambda share, text: None,
) -> SensitivityResult:
    """Vary one thing after another; write CSV files, a picture and a ranked table.

    ``curves.csv`` has one row a suction and a column a variation, ``ranking.csv`` the factors by
    their effect, the strongest first; for ``mesh`` there is ``mesh.csv`` instead.

    Parameters
    ----------
    configuration
        A library name or a TOML file with one table a layer.
    kind
        ``thickness``, ``parameters`` or ``mesh``.
    out
        Directory for the results, written whole or not at all.
    options
        The standard test; the defaults if absent.
    progress
        Told how far it is.

    Raises
    ------
    SensitivityError, MaterialError, SuctionError, OutputError
        If there is nothing to vary, or configuration, options or directory cannot be used.
    """
    chosen = dataclasses.replace(options or AspirationOptions(), search_kpa=0.0)
    cards = configuration_cards(configuration)
    if kind not in KINDS:
        raise SensitivityError(f"sensitivity to {kind!r} is unknown: choose {', '.join(KINDS)}")
    with directory_at_once(out) as folder:
        if kind == "mesh":
            sentences = _mesh_study(folder, configuration, cards, chosen, progress)
        else:
            standard = aspirated(_materials(cards), chosen)
            vary = _thickness if kind == "thickness" else _parameters
            variations = vary(cards, chosen, standard, progress)
            sentences = _written(folder, configuration, kind, standard, variations)
        write_summary(
            folder,
            {
                "configuration": configuration,
                "kind": kind,
                "options": dataclasses.asdict(chosen),
                "remarks": sentences,
            },
        )
    return SensitivityResult(out, sentences)


def _materials(cards: Mapping[str, MaterialCard]) -> dict[str, Material]:
    return {name: card.material for name, card in cards.items()}


def _changed(options: AspirationOptions, values: Mapping[str, object]) -> AspirationOptions:
    """Return the options with some values changed, checked like those of the command line."""
    return table_from(AspirationOptions, values, where="", base=options)


def _thickness(
    cards: Mapping[str, MaterialCard],
    options: AspirationOptions,
    standard: Aspiration,
    progress: Progress,
) -> list[Variation]:
    layers = [layer for layer in list(cards)[:-1] if layer in THICKNESS_MM]
    if not layers:
        raise SensitivityError(
            f"{' and '.join(cards)} is a single layer: its thickness is the slab's, vary "
            "slab_height_mm with aspirate"
        )
    cases = [
        (layer, word, thickness)
        for layer in layers
        for word, thickness in zip(("thin", "thick"), THICKNESS_MM[layer][::2], strict=True)
    ]
    found: list[Variation] = []
    for layer, word, thickness in cases:
        progress(len(found) / len(cases), f"{word} {layer}")
        changed = _changed(options, {f"{layer}_mm": thickness})
        curve = aspirated(_materials(cards), changed)
        effect = standard.difference(curve)
        found.append(Variation(f"{word} {layer}, {thickness:g} mm", layer, curve, effect))
    return found


def _parameters(
    cards: Mapping[str, MaterialCard],
    options: AspirationOptions,
    standard: Aspiration,
    progress: Progress,
) -> list[Variation]:
    parameters = parameters_of(cards)
    found: list[Variation] = []
    for parameter in parameters:
        written = cards[parameter.layer].parameters[parameter.key]
        value = float(written[0] if isinstance(written, list) else written)
        for sign in (-1, 1):
            progress(len(found) / (2 * len(parameters)), parameter.name)
            layers = layers_with(cards, (parameter,), [value * (1 + sign * CHANGE)])
            curve = aspirated(layers, options)
            name = f"{100 * (1 + sign * CHANGE):.0f} % {parameter.name}"
            found.append(Variation(name, parameter.name, curve, standard.difference(curve)))
    return found


def _written(
    folder: Path,
    configuration: str,
    kind: str,
    standard: Aspiration,
    variations: Sequence[Variation],
) -> tuple[str, ...]:
    curves = [standard.apex_mm, *(v.curve.apex_mm for v in variations)]
    write_table(
        folder / "curves.csv",
        ("pressure_kpa", "standard_mm", *(f"{v.name.replace(', ', ' ')} (mm)" for v in variations)),
        list(zip(standard.suction_kpa, *curves, strict=True)),
    )
    factors = list(dict.fromkeys(v.factor for v in variations))
    strength = {f: max(v.effect for v in variations if v.factor == f) for f in factors}
    ranked = sorted(factors, key=lambda f: -strength[f])
    end = standard.apex_mm[-1]
    rows = []
    for rank, factor in enumerate(ranked, start=1):
        low, high = (v.curve.apex_mm[-1] / end - 1 for v in variations if v.factor == factor)
        rows.append((rank, factor, 100 * strength[factor], 100 * float(low), 100 * float(high)))
    write_table(
        folder / "ranking.csv",
        ("rank", "factor", "largest_rms_percent", "end_lower_percent", "end_upper_percent"),
        rows,
    )
    _plot(folder / "sensitivity.png", f"{configuration}: {kind}", standard, variations, rows)
    unit = "thin and thick" if kind == "thickness" else "90 % and 110 %"
    return tuple(
        f"{factor}: the curve changes by up to {rms:.3g} % RMS of its range; its end by {low:+.3g} "
        f"and {high:+.3g} % ({unit})"
        for _, factor, rms, low, high in rows
    )


def _plot(
    path: Path,
    title: str,
    standard: Aspiration,
    variations: Sequence[Variation],
    rows: Sequence[tuple[int, str, float, float, float]],
) -> None:
    from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled

    figure = blank_figure(10.5, 4.2)
    left, right = figure.subplots(1, 2)
    left.plot(standard.suction_kpa, standard.apex_mm, color=COLOURS[0], linewidth=2)
    factors = [row[1] for row in rows]
    for variation in variations:
        colour = COLOURS[1 + factors.index(variation.factor) % (len(COLOURS) - 1)]
        left.plot(variation.curve.suction_kpa, variation.curve.apex_mm, color=colour, linewidth=0.9)
    labelled(left, "suction (kPa)", "apex displacement (mm)")
    for place, (_, factor, _, low, high) in enumerate(rows):
        colour = COLOURS[1 + factors.index(factor) % (len(COLOURS) - 1)]
        right.barh(place, high, color=colour, alpha=0.9)
        right.barh(place, low, color=colour, alpha=0.5)
    right.set_yticks(range(len(rows)), factors)
    right.invert_yaxis()
    right.axvline(0, color="0.4", linewidth=0.8)
    labelled(right, "change of the last displacement (%): pale less, strong more", "")
    figure.suptitle(title)
    finish(figure, path)


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


def _mesh_study(
    folder: Path,
    configuration: str,
    cards: Mapping[str, MaterialCard],
    options: AspirationOptions,
    progress: Progress,
) -> tuple[str, ...]:
    finest = {"element": REFERENCE_ELEMENT, "edge_mm": REFERENCE_EDGE_MM}
    reference = _changed(options, finest)
    progress(0.0, "reference")
    exact = aspirated(_materials(cards), reference)
    rows: list[MeshRow] = []
    cases = [(element, edge) for element in MESH_ELEMENTS for edge in MESH_EDGES_MM]
    for element, edge in cases:
        progress((1 + len(rows)) / (1 + len(cases)), f"{element}, {edge:g} mm")
        changed = _changed(options, {"element": element, "edge_mm": edge})
        started = time.process_time()
        curve = aspirated(_materials(cards), changed)
        seconds = time.process_time() - started
        if not np.isclose(curve.suction_kpa[-1], options.suction_kpa):
            continue
        apex, mises = float(curve.apex_mm[-1]), float(curve.max_mises_kpa[-1])
        rows.append(
            MeshRow(
                element,
                edge,
                int(curve.model.system.body.mesh.t.shape[1]),
                apex,
                mises,
                seconds,
                abs(apex / float(exact.apex_mm[-1]) - 1),
                abs(mises / float(exact.max_mises_kpa[-1]) - 1),
            )
        )
    header = [field.name for field in dataclasses.fields(MeshRow)]
    write_table(folder / "mesh.csv", header, [dataclasses.astuple(row) for row in rows])
    _plot_mesh(folder / "mesh.png", configuration, rows)
    sentences = [
        f"reference: {REFERENCE_ELEMENT}, {REFERENCE_EDGE_MM:g} mm, apex {exact.apex_mm[-1]:.4f} "
        f"mm, von Mises {exact.max_mises_kpa[-1]:.3f} kPa"
    ]
    for element in MESH_ELEMENTS:
        row = _coarsest_good([row for row in rows if row.element == element])
        if row is not None:
            sentences.append(
                f"{element} is within {100 * DISPLACEMENT_ERROR:g} % in displacement and "
                f"{100 * STRESS_ERROR:g} % in stress with {row.elements} elements of "
                f"{row.edge_mm:g} mm: {row.seconds:.1f} s of processor time"
            )
        else:
            sentences.append(f"{element} is not within the limits on any of these meshes")
    return tuple(sentences)


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
