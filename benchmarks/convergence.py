"""What moves in a sip when mesh and steps are refined.

    python benchmarks/convergence.py [A38-F ...] [--resolutions coarse standard fine thesis]
                                     [--halved standard]

Replays each scenario at each resolution, and once more at the resolution named by ``--halved`` with
steps of half the length and half the travel. A row has the largest value of each output over the
sip, but the mean length of contact over the time in which a lip touches: its largest value is that
of an instant at which a second place just touches.

The extremes of the dermis are pointwise and need not converge where a thread's edge presses. Beside
them stands what does not depend on points: the values that 0.1 mm² of the dermis exceed.

Below the rows, the change from the second finest mesh to the finest, and from whole to halved
steps, in percent. Times are those of the clock and of the processor; memory is the largest that the
process ever held.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem2d.march import StepSettings
from scenarios.drinking import replay
from scenarios.run import convert_recording
from scenarios.solution import LIPS, Increment, Model
from scenarios.spec import library_names, read_scenario

COLUMNS = (
    "upper force, N",
    "lower force, N",
    "upper contact, mm",
    "lower contact, mm",
    "upper window, kPa",
    "lower window, kPa",
    "least log strain",
    "largest log strain",
    "von Mises, kPa",
    "log strain fallen below by 0.1 mm²",
    "log strain exceeded by 0.1 mm²",
    "von Mises exceeded by 0.1 mm², kPa",
)

AREA_MM2 = 0.1


class Extended:
    """Histories of the measures that do not depend on points."""

    def __init__(self) -> None:
        self.rows: list[dict[str, float]] = []

    def begin(self, model: Model) -> None:
        """Remember the dermis and the size of its elements."""
        self._dermis = np.array([name.endswith("dermis") for name in model.region_names])[
            model.region
        ]
        a, b, c = (model.nodes[model.triangles[:, k]] for k in range(3))
        across, along = b - a, c - a
        self._area = 0.5 * np.abs(across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0])

    def add(self, increment: Increment) -> None:
        """Add the line of an increment."""
        row = increment.row()
        element = increment.element
        row["strain_min"] = -self._exceeded(-element["log_strain_min"])
        row["strain_max"] = self._exceeded(element["log_strain_max"])
        row["mises_kpa"] = 1e3 * self._exceeded(element["von_mises_mpa"])
        self.rows.append(row)

    def _exceeded(self, values: NDArray[np.float64]) -> float:
        """Return the value that ``AREA_MM2`` of the dermis exceeds."""
        chosen, area = values[self._dermis], self._area[self._dermis]
        order = np.argsort(-chosen)
        above = np.cumsum(area[order]) - 0.5 * area[order]
        return float(np.interp(AREA_MM2, above, chosen[order]))


def outputs(rows: list[dict[str, float]]) -> list[float]:
    """Return each of ``COLUMNS`` for the lines of a sip's history."""
    time_s = np.array([row["time_s"] for row in rows])

    def top(*names: str) -> float:
        values = [[row[name] for name in names] for row in rows]
        return float(np.linalg.norm(values, axis=1).max())

    def touching(name: str) -> float:
        values = np.array([row[name] for row in rows])
        lasts = np.trapezoid((values > 0).astype(float), time_s)
        return float(np.trapezoid(values, time_s) / lasts)

    return [
        *(top(f"{lip}_lip_force_x_n", f"{lip}_lip_force_y_n") for lip in LIPS),
        *(touching(f"{lip}_lip_contact_mm") for lip in LIPS),
        *(top(f"{lip}_lip_window_kpa") for lip in LIPS),
        top("dermis_min_log_strain"),
        top("dermis_max_log_strain"),
        top("dermis_max_mises_kpa"),
        top("strain_min"),
        top("strain_max"),
        top("mises_kpa"),
    ]


def measured(
    name: str, motion: Path, resolution: str, steps: StepSettings, label: str
) -> list[float]:
    """Replay once, print a row and return its values."""
    scenario = read_scenario(name, [f"solver.resolution={resolution}"]).with_motion(motion)
    told = Extended()
    began, started = time.perf_counter(), time.process_time()
    outcome = replay(scenario, on_model=told.begin, on_increment=told.add, steps=steps)
    wall, seconds = time.perf_counter() - began, time.process_time() - started
    values = outputs(told.rows)
    iterations = int(sum(row["newton_iterations"] for row in told.rows))
    size = outcome.about["elements"]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    ended = "" if outcome.finished else f" ({outcome.sentence})"
    row = [
        f"{label}{ended}",
        f"{size:,}",
        f"{len(told.rows)}, {iterations}",
        *(f"{value:.4g}" for value in values),
        f"{wall:.0f}, {seconds:.0f}",
        f"{memory:.0f}",
    ]
    print("| " + " | ".join(row) + " |", flush=True)
    return values


def changed(label: str, before: list[float], after: list[float]) -> None:
    """Print by how many percent ``after`` differs from ``before``."""
    percent = [f"{100 * (b / a - 1):+.1f} %" for a, b in zip(before, after, strict=True)]
    print("| " + " | ".join([label, "", "", *percent, "", ""]) + " |", flush=True)


def main() -> None:
    """Run the scenarios and print a table for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=library_names())
    parser.add_argument(
        "--resolutions", nargs="+", default=["coarse", "standard", "fine", "thesis"]
    )
    parser.add_argument("--halved", default="standard")
    options = parser.parse_args()
    whole = StepSettings()
    half = replace(
        whole,
        longest_s=whole.longest_s / 2,
        travel_mm=whole.travel_mm / 2,
        accuracy_mm=whole.accuracy_mm / 4,  # an error of foresight grows with the step's square
    )
    head = ["run", "triangles", "increments, iterations", *COLUMNS, "clock, processor s", "MB"]
    for name in options.scenarios:
        print(f"\n{name}\n\n| {' | '.join(head)} |\n|{'---|' * len(head)}")
        with tempfile.TemporaryDirectory() as scratch:
            recording = read_scenario(name).recording
            if recording is None:
                raise SystemExit(f"{name} has no recording")
            motion = convert_recording(
                recording, Path(scratch) / "motion", progress=lambda share, what: None
            ).motion
            runs = {
                resolution: measured(name, motion, resolution, whole, resolution)
                for resolution in options.resolutions
            }
            if len(runs) > 1:
                coarser, finest = options.resolutions[-2:]
                changed(f"{coarser} → {finest}", runs[coarser], runs[finest])
            if options.halved in runs:
                label = f"{options.halved}, steps halved"
                halved = measured(name, motion, options.halved, half, label)
                changed("steps → halved", runs[options.halved], halved)


if __name__ == "__main__":
    main()
