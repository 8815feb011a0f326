"""The aspiration study: how far a suction cup lifts layered tissue, and when it lets go.

Thesis section 3.1.2: the LASTIC test of Luboz et al. (2014) as a model. The result is the curve of
apex displacement against suction, the extreme strains of the dermis, and the suction at which
equilibrium is lost.
"""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.load import Load
from fem2d.materials.library import configuration_cards
from fem2d.materials.material import Material
from fem2d.solvers.static import StaticResult, eigenvalue_nearest_zero, kept_at, solve_static
from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress
from geometry2d.foundation.settings import setting
from scenarios.studies.suction import MPA_PER_KPA, SuctionModel, SuctionOptions

Array = NDArray[np.float64]

COLUMNS = ("pressure_kpa", "apex_mm", "dermis_min_log_strain", "dermis_max_log_strain")
CONFIGURATIONS = ("L1", "L2-GOH", "L2-Ogden", "L3")
THESIS_HIGHEST_KPA: Mapping[str, float] = {
    "L1": 12.0, "L2-GOH": 21.9, "L2-Ogden": 17.5, "L3": 21.9,
}  # fmt: skip
"""Thesis section 3.1.2 and Figure 3.14."""
SEARCH_STEP_KPA = 2.5
ROUND_STEP_MM = 0.02
SHORTEST_ROUND_STEP_MM = 1e-4
ROUND_STEPS = 60


@dataclass(frozen=True)
class AspirationOptions(SuctionOptions):
    """Sizes of the test, and how hard is sucked."""

    suction_kpa: float = setting(
        default=7.3, unit="kPa", minimum=0.01, maximum=101.3,
        description="largest suction", source="Luboz et al. 2014",
    )  # fmt: skip
    points: int = setting(
        default=10, minimum=1, maximum=1000, description="suctions of the curve, evenly spaced"
    )
    search_kpa: float = setting(
        default=25.0, unit="kPa", minimum=0.0, maximum=101.3,
        description="up to where to search for the loss of equilibrium; 101.3 is a vacuum",
    )  # fmt: skip


@dataclass(frozen=True)
class Loss:
    """Where equilibrium is lost.

    Attributes
    ----------
    suction_kpa
        The highest suction at which an equilibrium was found.
    apex_mm
        The apex displacement there.
    physical
        Whether the body loses equilibrium, not the solver.
    sentence
        What shows it.
    path
        (k, 3) beyond the last step of the suction: apex displacement, mm; suction, kPa; eigenvalue
        of the tangent nearest to zero over its first value.
    """

    suction_kpa: float
    apex_mm: float
    physical: bool
    sentence: str
    path: Array


@dataclass(frozen=True)
class Aspiration:
    """A suction test as computed.

    Attributes
    ----------
    suction_kpa, apex_mm, min_log_strain, max_log_strain
        (k,) the curve from rest on; strains are the extremes in the dermis.
    max_mises_kpa
        (k,) largest von Mises stress in the dermis under the aperture.
    softest
        (k,) eigenvalue of the tangent nearest to zero, N/mm.
    last
        The last equilibrium found.
    model
        What was sucked.
    loss
        Where equilibrium is lost; None if it is not, up to where it was searched.
    """

    suction_kpa: Array
    apex_mm: Array
    min_log_strain: Array
    max_log_strain: Array
    max_mises_kpa: Array
    softest: Array
    last: StaticResult
    model: SuctionModel
    loss: Loss | None

    @property
    def nonlinearity(self) -> float:
        """Largest distance of the curve from the chord between its ends, over its range."""
        chord = self.apex_mm[-1] * self.suction_kpa / self.suction_kpa[-1]
        return float(np.max(np.abs(self.apex_mm - chord)) / self.apex_mm[-1])

    def difference(self, other: Aspiration) -> float:
        """Return the RMS difference of two curves of the same suctions over this one's range."""
        gap = self.apex_mm[1:] - other.apex_mm[1:]
        return float(np.sqrt(np.mean(gap**2)) / self.apex_mm[-1])


def aspirated(
    layers: Mapping[str, Material],
    options: AspirationOptions,
    *,
    progress: Progress = lambda share, text: None,
) -> Aspiration:
    """Return the suction test on layers of material, outermost first.

    Raises
    ------
    SuctionError
        If device, slab and layers do not fit one another.
    """
    model = SuctionModel.of(layers, options)
    wanted = np.linspace(0.0, options.suction_kpa, options.points + 1)[1:]
    rest = kept_at(model.system)
    found = [rest]
    loss = None
    for result in model.solve_at_suctions(wanted, start=rest):
        if not result.converged:
            loss = _loss(model, found[-1])
            break
        found.append(result)
        progress(0.8 * len(found) / len(wanted), f"{suction_of(result):.2f} kPa")
    if loss is None and options.search_kpa > options.suction_kpa:
        loss = _searched(model, found[-1], options.search_kpa, progress)
    suction, apex, low, high, mises, softest = np.array([_row(model, s) for s in found]).T
    return Aspiration(suction, apex, low, high, mises, softest, found[-1], model, loss)


def suction_of(result: StaticResult) -> float:
    """Return the suction of an equilibrium, kPa."""
    return -result.load.pressure_mpa / MPA_PER_KPA


def _row(model: SuctionModel, result: StaticResult) -> tuple[float, ...]:
    fields = model.system.body.fields(result.displacement)
    strain = fields.log_strain[model.upper]
    mises = fields.von_mises[model.sucked]
    return (
        suction_of(result) + 0.0,
        model.apex_mm(result),
        float(strain.min()),
        float(strain.max()),
        float(mises.max()) / MPA_PER_KPA,
        eigenvalue_nearest_zero(result, solver=model.solver),
    )


def _searched(
    model: SuctionModel, start: StaticResult, to_kpa: float, progress: Progress
) -> Loss | None:
    """Return where equilibrium is lost between ``start`` and a suction, None if nowhere."""
    last = start
    first = suction_of(start)
    steps = max(1, int(np.ceil((to_kpa - first) / SEARCH_STEP_KPA)))
    for suction in np.linspace(first, to_kpa, steps + 1)[1:]:
        load = Load(pressure_mpa=-suction * MPA_PER_KPA)
        last = solve_static(
            model.system, load, start=last, solver=model.solver, threads=model.threads
        )
        if not last.converged:
            return _loss(model, last)
        progress(0.8 + 0.2 * suction / to_kpa, f"{suction:.1f} kPa, searching for the loss")
    return None


def _loss(model: SuctionModel, last: StaticResult) -> Loss:
    """Return what happens where the suction could not be raised any further.

    The apex is raised instead, and the suction solved for: a limit point is gone round, and the
    eigenvalue nearest to zero shows whether the tangent becomes singular.
    """
    path, state, step = [_step_of_path(model, last)], last, ROUND_STEP_MM
    for _ in range(ROUND_STEPS):
        (raised,) = model.raised_to([model.apex_mm(state) + step], start=state)
        if raised.converged and 0 < suction_of(raised) < 2 * path[0][1]:
            state, step = raised, min(1.5 * step, ROUND_STEP_MM)
            path.append(_step_of_path(model, state))
        elif step > SHORTEST_ROUND_STEP_MM:
            step /= 2
        else:
            break
    apex, suction, softest = np.array(path).T
    softest = softest / softest[0]
    top = int(np.argmax(suction))
    turned = top < len(path) - 1
    singular = bool(np.min(softest) < 0.5)
    if turned:
        sentence = (
            f"a limit point: raising the apex beyond {apex[top]:.2f} mm lowers the suction, to "
            f"{suction[-1]:.2f} kPa at {apex[-1]:.2f} mm"
        )
    elif singular:
        sentence = (
            f"the tangent becomes singular: its eigenvalue nearest to zero falls to "
            f"{np.min(softest):.2f} of its value within {suction[-1] - suction[0]:.2f} kPa"
        )
    else:
        sentence = (
            "the solver gave up: no limit point was passed and the tangent's eigenvalue nearest to "
            f"zero only falls to {np.min(softest):.2f} of its value"
        )
    return Loss(
        float(suction[top]), float(apex[top]), turned or singular, sentence,
        np.column_stack([apex, suction, softest]),
    )  # fmt: skip


def _step_of_path(model: SuctionModel, result: StaticResult) -> tuple[float, float, float]:
    softest = eigenvalue_nearest_zero(result, solver=model.solver)
    return model.apex_mm(result), suction_of(result), softest


@dataclass(frozen=True)
class AspirationResult:
    """Where the study's files are, and what must be said about it."""

    folder: Path
    sentences: tuple[str, ...]
    complete: bool


def aspiration_study(
    configuration: str,
    out: Path,
    options: AspirationOptions | None = None,
    *,
    progress: Progress = lambda share, text: None,
) -> AspirationResult:
    """Suck at a configuration; write ``aspiration.csv``, pictures and ``summary.json``.

    Parameters
    ----------
    configuration
        A library name (``L1``, ``L2-GOH``, ``L2-Ogden``, ``L3``) or a TOML file with one table a
        layer, outermost first.
    out
        Directory for the results, written whole or not at all.
    options
        Sizes and suction; the defaults if absent.
    progress
        Told how far it is.

    Raises
    ------
    MaterialError, SuctionError, OutputError
        If the configuration, the sizes or the directory cannot be used.
    """
    chosen = options or AspirationOptions()
    cards = configuration_cards(configuration)
    with directory_at_once(out) as folder:
        result = aspirated({k: c.material for k, c in cards.items()}, chosen, progress=progress)
        sentences = said(configuration, result, chosen)
        write_curve(folder / "aspiration.csv", result)
        _plot_curve(folder / "aspiration.png", configuration, result)
        _plot_field(folder / "field.png", configuration, result, chosen)
        write_summary(
            folder,
            {
                "configuration": configuration,
                "layers": {k: dict(c.parameters) for k, c in cards.items()},
                "options": dataclasses.asdict(chosen),
                "elements": int(result.model.system.body.mesh.t.shape[1]),
                "nonlinearity": result.nonlinearity,
                "tangent_eigenvalue_nearest_zero_n_per_mm": result.softest.tolist(),
                "loss": loss_table(result.loss),
                "remarks": sentences,
            },
        )
    reached = bool(np.isclose(result.suction_kpa[-1], chosen.suction_kpa))
    return AspirationResult(out, sentences, reached)


def thesis_comparison(
    out: Path,
    options: AspirationOptions | None = None,
    *,
    progress: Progress = lambda share, text: None,
) -> AspirationResult:
    """Redo Figures 3.11 to 3.14: the four printed optima, to 7.3 kPa and to the highest suctions.

    Writes ``aspiration-<configuration>.csv`` to 7.3 kPa, ``high-<configuration>.csv`` beyond,
    ``comparison.png`` and ``summary.json``.
    """
    chosen = options or AspirationOptions(search_kpa=0.0)
    curves: dict[str, Aspiration] = {}
    high: dict[str, Aspiration] = {}
    with directory_at_once(out) as folder:
        for number, name in enumerate(CONFIGURATIONS):
            layers = {k: c.material for k, c in configuration_cards(name).items()}
            progress(number / len(CONFIGURATIONS), name)
            curves[name] = aspirated(layers, dataclasses.replace(chosen, search_kpa=0.0))
            far = dataclasses.replace(chosen, suction_kpa=THESIS_HIGHEST_KPA[name], points=20)
            high[name] = aspirated(layers, far)
            write_curve(folder / f"aspiration-{name}.csv", curves[name])
            write_curve(folder / f"high-{name}.csv", high[name])
        sentences: list[str] = []
        for name in CONFIGURATIONS:
            sentences += [f"{name}: {s}" for s in said(name, high[name], chosen)]
        differences = {n: curves["L1"].difference(c) for n, c in curves.items()}
        sentences += [
            f"{n} differs from L1 by {100 * d:.2f} % RMS of L1's range up to 7.3 kPa"
            for n, d in differences.items()
            if n != "L1"
        ]
        _plot_comparison(folder / "comparison.png", curves, high)
        write_summary(
            folder,
            {
                "options": dataclasses.asdict(chosen),
                "rms_difference_from_L1": differences,
                "nonlinearity": {n: c.nonlinearity for n, c in curves.items()},
                "loss": {n: loss_table(c.loss) for n, c in high.items()},
                "remarks": sentences,
            },
        )
    return AspirationResult(out, tuple(sentences), all(c.loss is None for c in high.values()))


def said(name: str, result: Aspiration, options: AspirationOptions) -> tuple[str, ...]:
    """Return what a reader must know of a curve, in sentences."""
    softest = result.softest
    sentences = [
        f"apex {result.apex_mm[-1]:.3f} mm at {result.suction_kpa[-1]:.2f} kPa; the curve leaves "
        f"its chord by {100 * result.nonlinearity:.1f} % of its range"
    ]
    if result.loss is None:
        upto = max(options.search_kpa, float(result.suction_kpa[-1]))
        sentences.append(
            f"equilibrium is not lost up to {upto:g} kPa; up to {result.suction_kpa[-1]:g} kPa the "
            "tangent's eigenvalue nearest to zero stays above "
            f"{softest.min() / softest[0]:.2f} of its value at rest"
        )
    else:
        sentences.append(
            f"equilibrium is lost at {result.loss.suction_kpa:.2f} kPa, apex "
            f"{result.loss.apex_mm:.2f} mm: {result.loss.sentence}"
        )
    return tuple(sentences)


def loss_table(loss: Loss | None) -> dict[str, Any] | None:
    """Return a loss as a table for JSON."""
    if loss is None:
        return None
    return {
        "suction_kpa": loss.suction_kpa,
        "apex_mm": loss.apex_mm,
        "physical": loss.physical,
        "sentence": loss.sentence,
        "path": {
            "apex_mm": loss.path[:, 0].tolist(),
            "suction_kpa": loss.path[:, 1].tolist(),
            "relative_eigenvalue": loss.path[:, 2].tolist(),
        },
    }


def write_curve(path: Path, result: Aspiration) -> None:
    """Write a curve as ``aspiration.csv``."""
    columns = (result.suction_kpa, result.apex_mm, result.min_log_strain, result.max_log_strain)
    write_table(path, COLUMNS, list(zip(*columns, strict=True)))


def write_table(path: Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write rows of numbers and words as CSV; numbers read back to the same bits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow([repr(float(x)) if isinstance(x, float) else x for x in row])


def write_summary(folder: Path, content: Mapping[str, Any]) -> None:
    """Write ``summary.json``, which marks a directory as a result."""
    text = json.dumps(content, indent=2, ensure_ascii=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")


def _plot_curve(path: Path, name: str, result: Aspiration) -> None:
    from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled

    figure = blank_figure(9.5, 4.0)
    left, right = figure.subplots(1, 2)
    left.plot(result.suction_kpa, result.apex_mm, "o-", color=COLOURS[0], markersize=3)
    if result.loss is not None:
        left.plot([result.loss.suction_kpa], [result.loss.apex_mm], "x", color=COLOURS[1],
                  label="equilibrium lost")  # fmt: skip
        left.legend(frameon=False)
    labelled(left, "suction (kPa)", "apex displacement (mm)")
    right.plot(result.suction_kpa, result.max_log_strain, "+-", color=COLOURS[3], label="largest")
    right.plot(result.suction_kpa, result.min_log_strain, "x-", color=COLOURS[2], label="smallest")
    labelled(right, "suction (kPa)", "principal log strain in the dermis")
    right.legend(frameon=False)
    figure.suptitle(f"Aspiration of {name}")
    finish(figure, path)


def _plot_field(path: Path, name: str, result: Aspiration, options: AspirationOptions) -> None:
    from scenarios.studies.plots import blank_figure, draw_field, finish, labelled

    body = result.model.system.body
    fields = body.fields(result.last.displacement)
    strain = np.average(fields.log_strain[..., 2], axis=1, weights=fields.volume)
    figure = blank_figure(9.0, 4.6)
    axes = labelled(figure.subplots(), "distance from the axis (mm)", "height (mm)")
    colours = draw_field(axes, body, result.last.displacement, strain, mirrored=True)
    cup = options.cup.sampled(0.1)
    for side in (1.0, -1.0):
        axes.fill(side * cup[:, 0], cup[:, 1], facecolor="0.82", edgecolor="0.35", linewidth=0.8)
    reach = 1.9 * options.aperture_radius_mm
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-0.8 * reach, max(0.3 * reach, 1.3 * result.apex_mm[-1]))
    figure.colorbar(colours, ax=axes, label="largest principal log strain", shrink=0.8)
    axes.set_title(f"{name} at {result.suction_kpa[-1]:.2f} kPa, true scale")
    finish(figure, path)


def _plot_comparison(
    path: Path, curves: Mapping[str, Aspiration], high: Mapping[str, Aspiration]
) -> None:
    from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled

    figure = blank_figure(10.0, 4.2)
    left, right = figure.subplots(1, 2)
    shown: list[tuple[Any, Mapping[str, Aspiration], Callable[[str], str]]] = [
        (left, curves, lambda n: n),
        (right, high, lambda n: f"{n}, to {THESIS_HIGHEST_KPA[n]:g} kPa"),
    ]
    for axes, results, label in shown:
        for colour, (name, result) in zip(COLOURS, results.items(), strict=False):
            axes.plot(result.suction_kpa, result.apex_mm, color=colour, label=label(name))
            if result.loss is not None:
                axes.plot([result.loss.suction_kpa], [result.loss.apex_mm], "x", color=colour)
        labelled(axes, "suction (kPa)", "apex displacement (mm)")
        axes.legend(frameon=False)
    left.set_title("up to 7.3 kPa (Figures 3.11 to 3.13)", fontsize=10)
    right.set_title("high suction (Figure 3.14)", fontsize=10)
    finish(figure, path)
