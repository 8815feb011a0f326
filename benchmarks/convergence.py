"""What moves in a sip when mesh and steps are refined.

    python -m benchmarks.convergence [A38-F ...] [--resolutions coarse standard fine thesis]
                                     [--halved standard]

Replays each scenario at each resolution, and once more at the resolution named by ``--halved`` with
steps of half the length and half the travel. A row has the largest value of each output over the
sip, but the length of contact is a mean over the load (its time integral, each instant weighted by
the force on that lip, over the force's): the largest is that of an instant at which a second place
just touches, and a mean over time depends on when the last point lets go. Strain and stress are
told twice: at the integration point where they are largest, and as the largest mean over discs of
0.5 mm in the undeformed dermis, what a window is to pressure.

Below the rows, the change from the second finest mesh to the finest, and from whole to halved
steps, in percent. Times are those of the clock and of the processor; memory is the largest that the
process ever held.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fem2d.solvers.step_control import StepSettings
from scenarios.results.increment import Increment, SectionModel
from scenarios.results.quantities import LIPS
from scenarios.settings.files import recorded_names
from scenarios.settings.scenario import load_scenario
from scenarios.sip.replay import replay
from scenarios.sip.run import convert_recording

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
    "least log strain, disc",
    "largest log strain, disc",
    "von Mises, disc, kPa",
)

DISC_RADIUS_MM = 0.25
"""Of the discs over which strain and stress are averaged."""


class DiscMeans:
    """Largest means of the dermis' strain and stress over discs, so far in a sip."""

    _SIGNED = (("log_strain_min", -1.0), ("log_strain_max", 1.0), ("von_mises_mpa", 1e3))

    def __init__(self) -> None:
        self.values = [0.0] * len(self._SIGNED)

    def model(self, model: SectionModel) -> None:
        """Look up which triangles' centroids lie in the disc around each triangle's."""
        names = np.array(model.region_names)
        self._dermis = np.flatnonzero(np.char.endswith(names[model.region], "dermis"))
        corners = model.nodes[model.triangles[self._dermis, :3]]
        area = 0.5 * np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
        near = cKDTree(corners.mean(axis=1))
        pairs = near.sparse_distance_matrix(near, DISC_RADIUS_MM, output_type="coo_matrix")
        inside = sp.csr_matrix(
            (area[pairs.col], (pairs.row, pairs.col)), shape=(len(area), len(area))
        )
        self._mean = sp.diags(1.0 / inside.sum(axis=1).A1) @ inside

    def increment(self, increment: Increment) -> None:
        """Take note of an increment's means."""
        for k, (name, sign) in enumerate(self._SIGNED):
            field: NDArray[np.float64] = sign * increment.element[name][self._dermis]
            self.values[k] = max(self.values[k], float((self._mean @ field).max()))


def outputs(rows: list[dict[str, float]]) -> list[float]:
    """Return the first of ``COLUMNS``, all but those of discs, for a sip's history."""
    time_s = np.array([row["time_s"] for row in rows])

    def top(*names: str) -> float:
        values = [[row[name] for name in names] for row in rows]
        return float(np.linalg.norm(values, axis=1).max())

    def length(lip: str) -> float:
        force = np.hypot(
            [row[f"{lip}_lip_force_x_n"] for row in rows],
            [row[f"{lip}_lip_force_y_n"] for row in rows],
        )
        contact = np.array([row[f"{lip}_lip_contact_mm"] for row in rows])
        return float(np.trapezoid(contact * force, time_s) / np.trapezoid(force, time_s))

    return [
        *(top(f"{lip}_lip_force_x_n", f"{lip}_lip_force_y_n") for lip in LIPS),
        *(length(lip) for lip in LIPS),
        *(top(f"{lip}_lip_window_kpa") for lip in LIPS),
        top("dermis_min_log_strain"),
        top("dermis_max_log_strain"),
        top("dermis_max_mises_kpa"),
    ]


def measured(
    name: str, motion: Path, resolution: str, steps: Mapping[str, float], label: str
) -> list[float]:
    """Replay once, print a row and return its values."""
    numerics = {"resolution": resolution, "steps": steps}
    scenario = load_scenario(name).with_(motion=motion, numerics=numerics)
    rows: list[dict[str, float]] = []
    discs = DiscMeans()

    def keep(increment: Increment) -> None:
        rows.append(increment.row())
        discs.increment(increment)

    began, started = time.perf_counter(), time.process_time()
    outcome = replay(scenario, on_model=discs.model, on_increment=keep)
    wall, seconds = time.perf_counter() - began, time.process_time() - started
    values = [*outputs(rows), *discs.values]
    iterations = int(sum(row["newton_iterations"] for row in rows))
    size = outcome.about["elements"]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    ended = "" if outcome.finished else f" ({outcome.message})"
    row = [
        f"{label}{ended}",
        f"{size:,}",
        f"{len(rows)}, {iterations}",
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
    parser.add_argument("scenarios", nargs="*", default=recorded_names())
    parser.add_argument(
        "--resolutions", nargs="+", default=["coarse", "standard", "fine", "thesis"]
    )
    parser.add_argument("--halved", default="standard")
    options = parser.parse_args()
    usual = StepSettings()
    whole: dict[str, float] = {}
    half = {
        "longest_s": usual.longest_s / 2,
        "travel_mm": usual.travel_mm / 2,
        "accuracy_mm": usual.accuracy_mm / 4,  # a predictor's error grows with the step's square
    }
    head = ["run", "triangles", "increments, iterations", *COLUMNS, "clock, processor s", "MB"]
    for name in options.scenarios:
        print(f"\n{name}\n\n| {' | '.join(head)} |\n|{'---|' * len(head)}")
        with tempfile.TemporaryDirectory() as scratch:
            recording = load_scenario(name).recording
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
