"""The single-element study: what one cube of a material answers to being pulled and pressed.

Thesis section 3.1.1: a unit cube on rollers, displacements from −0.9 to +3.0 mm, nominal and true
stress against stretch and logarithmic strain, for one material or as the comparisons of the
thesis' Figures 3.7, 3.8 and 3.9.
"""

from __future__ import annotations

import csv
import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast

import numpy as np

from fem2d.analyses.homogeneous import Curve, Mode, homogeneous_response
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.library import material_card, material_named
from fem2d.materials.material import Material, poisson_ratio
from fem2d.materials.ogden import Ogden
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, no_progress
from geometry2d.foundation.settings import setting
from scenarios.studies.element_types import element_type_rows
from scenarios.studies.files import StudyResult, write_summary

COLUMNS = ("stretch", "log_strain", "nominal_stress_mpa", "cauchy_stress_mpa")
AXES = ("x", "y", "z")
FIBRE_ANGLE_DEG = 41.0
"""Of both families to the Langer lines, as in ``ni-annaidh-2012/dermis``."""

FILE_CHARACTERS = {
    " − ": "-minus-",
    " + ": "-plus-",
    " %": "",
    ", ": "-",
    " ": "-",
    "μ": "mu",
    "α": "alpha",
}


class ElementStudyError(DrinksimError):
    """A single-element study was asked for that makes no sense."""


@dataclass(frozen=True)
class ElementOptions:
    """How the cube is loaded."""

    mode: Literal["uniaxial", "equibiaxial", "planar", "compression"] = setting(
        default="uniaxial",
        description="uniaxial, equibiaxial, planar (pure shear), or compression only",
    )
    direction: Literal["x", "y", "z"] = setting(default="x", description="loaded axis of the cube")
    from_mm: float = setting(
        default=-0.9,
        unit="mm",
        minimum=-0.999,
        maximum=100.0,
        description="first displacement of the unit cube's face",
        source="thesis section 3.1.1",
    )
    to_mm: float = setting(
        default=3.0,
        unit="mm",
        minimum=-0.999,
        maximum=100.0,
        description="last displacement (compression: at most 0)",
        source="thesis section 3.1.1",
    )
    points: int = setting(
        default=391, minimum=2, maximum=100_000, description="displacements, evenly spaced"
    )


def element_study(material: str, out: Path, options: ElementOptions | None = None) -> StudyResult:
    """Load a cube of a material and write ``element.csv``, ``element.png`` and ``summary.json``.

    Parameters
    ----------
    material
        Library name or TOML file, see :mod:`fem2d.materials.library`.
    out
        Directory for the results, written whole or not at all.
    options
        Mode, axis and displacements; the thesis' if absent.

    Raises
    ------
    MaterialError, ElementStudyError, OutputError
        If the material, the displacements or the directory cannot be used.
    """
    chosen = options if options is not None else ElementOptions()
    card = material_card(material)
    curve = cube_curve(card.material, chosen)
    messages = tuple(curve.warnings())
    with directory_at_once(out) as folder:
        _write_csv(folder / "element.csv", curve)
        _plot(folder / "element.png", {card.name: curve}, f"{card.name}, {chosen.mode}")
        write_summary(
            folder,
            {
                "material": card.name,
                "parameters": dict(card.parameters),
                "source": card.source,
                "reading": card.reading,
                "poisson": _poisson(card.material),
                "options": dataclasses.asdict(chosen),
                "remarks": messages,
                "unstable_log_strain_compression": _number(curve.unstable_log_strain[0]),
                "unstable_log_strain_tension": _number(curve.unstable_log_strain[1]),
            },
        )
    return StudyResult(out, messages)


def cube_curve(material: Material, options: ElementOptions) -> Curve:
    """Return the response of a unit cube over the displacements of ``options``."""
    low, high = options.from_mm, options.to_mm
    if options.mode == "compression" and 0.0 < high != ElementOptions().to_mm:
        raise ElementStudyError(
            f"to_mm = {high:g} mm has no effect in compression: give 0 mm or less"
        )
    if options.mode == "compression":
        low, high = min(low, 0.0), min(high, 0.0)
    if not low < high:
        raise ElementStudyError(
            f"displacements from {low:g} to {high:g} mm: the first must be below the last"
            + (" and, in compression, below 0" if options.mode == "compression" else "")
        )
    return homogeneous_response(
        material,
        Mode[options.mode.upper()],
        1 + np.linspace(low, high, options.points),
        axis=AXES.index(options.direction),
    )


def thesis_figures(out: Path, *, progress: Progress = no_progress) -> StudyResult:
    """Redo the studies behind the thesis' Figures 3.7, 3.8 and 3.9, and that of element types.

    ``figure-3.7.png`` … with ``figure-3.7-<curve>.csv`` beside, and ``element-types.csv`` as
    :mod:`scenarios.studies.element_types` describes it; arguments and errors as of
    :func:`element_study`.
    """
    options = ElementOptions(direction="z")
    messages: list[str] = []
    progress(0.0, "cubes")
    with directory_at_once(out) as folder:
        for figure, (title, materials) in figure_materials().items():
            curves = {name: cube_curve(law, options) for name, law in materials.items()}
            for name, curve in curves.items():
                _write_csv(folder / f"figure-{figure}-{_file_name(name)}.csv", curve)
                messages += [f"figure {figure}, {name}: {warning}" for warning in curve.warnings()]
            _plot(folder / f"figure-{figure}.png", curves, title)
        rows = [dataclasses.asdict(row) for row in element_type_rows(progress=progress)]
        with (folder / "element-types.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        write_summary(folder, {"options": dataclasses.asdict(options), "remarks": messages})
    return StudyResult(out, tuple(messages))


def figure_materials() -> dict[str, tuple[str, dict[str, Material]]]:
    """Return ``{figure: (title, {curve: material})}``, all loaded along z.

    Figure 3.8's cube is pulled along z. Families lie at ± 41° to an axis: in the xy plane to x, in
    the xz plane to z ("parallel") or to x ("orthogonal").
    """
    skin = cast(HolzapfelGasserOgden, material_named("ni-annaidh-2012/dermis"))
    ogden = cast(Ogden, material_named("L2-Ogden/dermis"))
    c, s = math.cos(math.radians(FIBRE_ANGLE_DEG)), math.sin(math.radians(FIBRE_ANGLE_DEG))

    def fibres(*directions: tuple[float, float, float]) -> Material:
        return dataclasses.replace(skin, fibres=directions)

    def changed(mu: float, alpha: float) -> Material:
        poisson = _poisson(ogden)
        return Ogden(
            tuple(m * mu for m in ogden.mu_mpa),
            tuple(a * alpha for a in ogden.alpha),
            poisson=poisson,
        )

    return {
        "3.7": (
            "Neo-Hookean: three subjects",
            {
                f"C10 {law.shear_modulus_mpa / 2 * 1e3:.1f} kPa": law
                for law in (
                    material_named(f"luboz-2014/{subject}")
                    for subject in ("softest", "mean", "stiffest")
                )
            },
        ),
        "3.8": (
            "Holzapfel–Gasser–Ogden: where the fibres lie",
            {
                "xz plane, parallel": fibres((s, 0.0, c), (-s, 0.0, c)),
                "xz plane, orthogonal": fibres((c, 0.0, s), (c, 0.0, -s)),
                "xy plane": fibres((c, s, 0.0), (c, -s, 0.0)),
                "isotropic": material_named("ni-annaidh-2012/isotropic"),
            },
        ),
        "3.9": (
            "Ogden: μ and α ± 10 %",
            {
                "standard": ogden,
                "μ − 10 %": changed(0.9, 1.0),
                "μ + 10 %": changed(1.1, 1.0),
                "α − 10 %": changed(1.0, 0.9),
                "α + 10 %": changed(1.0, 1.1),
            },
        ),
    }


def _poisson(material: Material) -> float:
    return poisson_ratio(material.shear_modulus_mpa, material.bulk_modulus_mpa)


def _file_name(curve: str) -> str:
    """Return a curve's name in characters that every file system takes."""
    for character, written in FILE_CHARACTERS.items():
        curve = curve.replace(character, written)
    return curve


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _write_csv(path: Path, curve: Curve) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        columns = (curve.stretch, curve.log_strain, curve.nominal_mpa, curve.cauchy_mpa)
        writer.writerows([[f"{x:.15g}" for x in row] for row in zip(*columns, strict=True)])


def _plot(path: Path, curves: Mapping[str, Curve], title: str) -> None:
    """Draw nominal stress against stretch and true stress against logarithmic strain.

    Stress grows over decades, so its axis is an inverse hyperbolic sine: linear around zero,
    logarithmic far out.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    linear = 1e3 * min(_typical(curve) for curve in curves.values())
    for name, curve in curves.items():
        left.plot(curve.stretch, curve.nominal_mpa * 1e3, label=name, linewidth=1.4)
        right.plot(curve.log_strain, curve.cauchy_mpa * 1e3, label=name, linewidth=1.4)
        for strain in curve.unstable_log_strain:
            if math.isfinite(strain):
                at = float(np.interp(strain, curve.log_strain, curve.cauchy_mpa)) * 1e3
                right.plot([strain], [at], "x", color="black", markersize=5)
    for axes, x, y in (
        (left, "stretch", "nominal stress (kPa)"),
        (right, "logarithmic strain", "true stress (kPa)"),
    ):
        axes.set_yscale("asinh", linear_width=linear)
        low, high = (max(abs(y), linear) for y in axes.get_ylim())
        decades = [10.0**n for n in range(math.ceil(math.log10(linear)), 12)]
        axes.set_yticks(
            [-d for d in reversed(decades) if d < low] + [0.0] + [d for d in decades if d < high]
        )
        axes.minorticks_off()
        axes.set_xlabel(x)
        axes.set_ylabel(y)
        axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
        axes.spines[["top", "right"]].set_visible(False)
    if any(math.isfinite(s) for curve in curves.values() for s in curve.unstable_log_strain):
        right.plot([], [], "x", color="black", markersize=5, label="becomes unstable")
    right.legend(frameon=False, fontsize=8)
    figure.suptitle(title, fontsize=11)
    figure.savefig(path, dpi=150)


def _typical(curve: Curve) -> float:
    """Return the size of stress at small strain: where the linear part of the axis ends."""
    small = np.abs(curve.log_strain) < 0.1
    return float(np.max(np.abs(curve.nominal_mpa[small]), initial=1e-6))
