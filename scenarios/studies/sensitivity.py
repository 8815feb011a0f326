"""What the suction test depends on: layer thickness, material parameters, and the mesh.

Thesis sections 3.1.2 and 3.2.2: layers thin, standard and thick (Table 3.4, Figures 3.15 to 3.17),
every parameter ± 10 % (Figures 3.18 and 3.19), and elements of several types and sizes
(Figure 3.10).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem2d.materials.library import MaterialCard, configuration_cards
from fem2d.materials.material import Material
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.settings.tables import table_from
from scenarios.studies.files import StudyResult, write_summary, write_table
from scenarios.studies.fit import layers_with, number_of, parameters_of
from scenarios.studies.mesh_sensitivity import mesh_study
from scenarios.studies.suction_curve import Aspiration, CurveOptions, aspirated

Array = NDArray[np.float64]


KINDS = ("thickness", "parameters", "mesh")

THICKNESS_MM: Mapping[str, tuple[float, float, float]] = {
    "dermis": (0.7851, 1.195, 1.6044),
    "hypodermis": (1.55, 2.87, 4.19),
}
"""Thin, standard, thick: thesis Table 3.4, ± 2 standard deviations."""


CHANGE = 0.1
"""By which share parameters are changed, up and down."""


class SensitivityError(DrinksimError):
    """A sensitivity was asked for that does not exist."""


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


@dataclass(frozen=True)
class _Case:
    """A test to compute: name and factor of its :class:`Variation`, materials, and options."""

    name: str
    factor: str
    layers: Mapping[str, Material]
    options: CurveOptions


def sensitivity_study(
    configuration: str,
    kind: str,
    out: Path,
    options: CurveOptions | None = None,
    *,
    progress: Progress = no_progress,
) -> StudyResult:
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
    chosen = options or CurveOptions()
    cards = configuration_cards(configuration)
    chosen.refuse_ineffective(list(cards))
    layers = {name: card.material for name, card in cards.items()}
    if kind not in KINDS:
        raise SensitivityError(f"sensitivity to {kind!r} is unknown: choose {', '.join(KINDS)}")
    with directory_at_once(out) as folder:
        if kind == "mesh":
            messages = mesh_study(folder, configuration, layers, chosen, progress)
        else:
            standard = aspirated(layers, chosen)
            cases = (_thickness_cases if kind == "thickness" else _parameter_cases)(cards, chosen)
            variations = list(_varied(list(cases), standard, progress))
            messages = _written(folder, configuration, kind, standard, variations)
        write_summary(
            folder,
            {
                "configuration": configuration,
                "kind": kind,
                "options": dataclasses.asdict(chosen),
                "remarks": messages,
            },
        )
    return StudyResult(out, messages)


def _thickness_cases(cards: Mapping[str, MaterialCard], options: CurveOptions) -> Iterator[_Case]:
    """Yield each layer thinner and thicker."""
    layers = [layer for layer in list(cards)[:-1] if layer in THICKNESS_MM]
    if not layers:
        raise SensitivityError(
            f"{' and '.join(cards)} is a single layer: its thickness is the slab's, vary "
            "slab_height_mm with aspirate"
        )
    materials = {name: card.material for name, card in cards.items()}
    for layer in layers:
        for word, thickness in zip(("thin", "thick"), THICKNESS_MM[layer][::2], strict=True):
            changed = table_from(CurveOptions, {f"{layer}_mm": thickness}, where="", base=options)
            yield _Case(f"{word} {layer}, {thickness:g} mm", layer, materials, changed)


def _parameter_cases(cards: Mapping[str, MaterialCard], options: CurveOptions) -> Iterator[_Case]:
    """Yield each material parameter smaller and larger."""
    for parameter in parameters_of(cards):
        value = number_of(cards[parameter.layer].parameters[parameter.key])
        for factor in (1 - CHANGE, 1 + CHANGE):
            layers = layers_with(cards, (parameter,), [value * factor])
            name = f"{100 * factor:.0f} % {parameter.name}"
            yield _Case(name, parameter.name, layers, options)


def _varied(
    cases: Sequence[_Case], standard: Aspiration, progress: Progress
) -> Iterator[Variation]:
    for number, case in enumerate(cases):
        progress(number / len(cases), case.name)
        curve = aspirated(case.layers, case.options)
        yield Variation(case.name, case.factor, curve, standard.difference(curve))


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
