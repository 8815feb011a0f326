"""A run as pictures for slides: six instants, all of them in a row, histories and imprint."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.results.solution import Solution
from scenarios.views.animation import SHEET_FRAMES, animate, telling_times
from scenarios.views.plots import plot_histories, plot_imprint


def export_pictures(run: Path, out: Path, *, progress: Progress = no_progress) -> None:
    """Write PNG pictures of a run directory into the directory ``out``.

    ``instant_1.png`` to ``instant_6.png`` fill a slide of 16 to 9; ``six_instants.png``,
    ``histories.png`` and ``imprint.png`` stand beside them.

    Raises
    ------
    DrinksimError
        If ``run`` is not a run directory or ``out`` may not be replaced.
    """
    solution = Solution.load(run)
    times = telling_times(solution, SHEET_FRAMES)
    start, end = solution.time_s[[0, -1]]
    shares = np.clip((times - start) / max(end - start, 1e-12), 0.0, 1.0)
    with directory_at_once(out) as partial:
        for number, share in enumerate(shares.tolist(), start=1):
            progress((number - 1) / (SHEET_FRAMES + 2), f"instant {number}")
            animate(solution, partial / f"instant_{number}.png", at=share)
        animate(solution, partial / "six_instants.png")
        progress((SHEET_FRAMES + 1) / (SHEET_FRAMES + 2), "histories and imprint")
        plot_histories([run], partial / "histories.png")
        plot_imprint(run, partial / "imprint.png")
        # What holds this file is known as a result, and may be replaced by the next export.
        (partial / "summary.json").write_bytes((run / "summary.json").read_bytes())
