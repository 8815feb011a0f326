"""Check that known parameters are recovered within the stated confidence intervals.

Forty times, a suction curve of L2-Ogden with known parameters and independent Gaussian noise is
calibrated from the printed first guesses. Written into the directory given: ``recovery.csv`` (one
row a trial and parameter), ``recovery.png`` and the coverage on the screen.

    python -m benchmarks.calibration_recovery out

About ten minutes on one core; the mesh is coarse, because truth and fit share it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from fem2d.materials.library import configuration_cards
from scenarios.studies.curve_gradient import SuctionCurve
from scenarios.studies.files import write_table
from scenarios.studies.fit import CalibrationOptions, fitted, layers_with, parameters_of
from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled
from scenarios.studies.suction import SuctionModel

TRUTH = {"dermis.mu_mpa": 0.02, "dermis.alpha": 8.0, "bulk.C10_mpa": 0.0045}
NOISE_MM = 0.001
SUCTIONS_KPA = np.linspace(0.0, 14.6, 21)[1:]
TRIALS = 40
SEED = 20140
COARSE_MM = 0.5


def main(folder: Path) -> None:
    options = CalibrationOptions(edge_mm=COARSE_MM)
    cards = configuration_cards("L2-Ogden")
    parameters = parameters_of(cards)
    model = SuctionModel.of({name: card.material for name, card in cards.items()}, options)
    curve = SuctionCurve(model, lambda v: layers_with(cards, parameters, v), SUCTIONS_KPA)
    truth = np.array([TRUTH[p.name] for p in parameters])
    exact = curve.at(np.log(truth)).apex_mm
    noise = np.random.default_rng(SEED).normal(0.0, NOISE_MM, (TRIALS, len(exact)))
    rows: list[tuple[object, ...]] = []
    for trial in range(TRIALS):
        fit = fitted(curve.at, parameters, exact + noise[trial], options)
        interval = fit.identifiability.interval
        for parameter, value, true, (low, high) in zip(
            parameters, fit.values, truth, interval, strict=True
        ):
            inside = bool(low <= true <= high)
            rows.append((trial, parameter.name, float(true), float(value), float(low),
                         float(high), inside, fit.solves))  # fmt: skip
        print(trial, fit.solves, fit.values.round(5).tolist(), flush=True)
    folder.mkdir(parents=True, exist_ok=True)
    header = ("trial", "parameter", "truth", "estimate", "low", "high", "inside", "solves")
    write_table(folder / "recovery.csv", header, rows)
    for parameter in parameters:
        inside = [row[6] for row in rows if row[1] == parameter.name]
        print(f"{parameter.name}: {sum(map(bool, inside))} of {TRIALS} inside")
    inside = [row[6] for row in rows]
    print(f"all parameters: {100 * np.mean(np.array(inside, float)):.1f} % inside")
    _plot(folder / "recovery.png", rows, [p.name for p in parameters])


def _plot(path: Path, rows: list[tuple[object, ...]], names: list[str]) -> None:
    figure = blank_figure(10.5, 3.6)
    for axes, name in zip(figure.subplots(1, len(names)), names, strict=True):
        mine = [row for row in rows if row[1] == name]
        trial, true, value, low, high = (
            np.array([row[k] for row in mine], float) for k in (0, 2, 3, 4, 5)
        )
        missed = np.array([not row[6] for row in mine])
        for some, colour in ((~missed, COLOURS[1]), (missed, COLOURS[2])):
            axes.vlines(trial[some], low[some], high[some], color=colour, linewidth=1.2)
            axes.plot(trial[some], value[some], ".", color=colour, markersize=3)
        axes.axhline(true[0], color=COLOURS[0], linewidth=0.8)
        labelled(axes, "trial", "")
        axes.set_title(f"{name}: {np.sum(~missed)} of {len(mine)}", fontsize=10)
    finish(figure, path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
