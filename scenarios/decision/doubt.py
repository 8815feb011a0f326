"""One sip with sampled motions: how far its numbers follow from the recording."""

from __future__ import annotations

from pathlib import Path

from geometry2d.foundation.progress import ProgressOption
from scenarios.campaign.settings import DoubtSettings, MeetingSettings, StudySettings
from scenarios.campaign.study import StudyOutcome
from scenarios.campaign.variation import StudyError
from scenarios.decision.run import run_study
from scenarios.results.doubt import DOUBT_FOLDER, SHARE, Doubt
from scenarios.results.quantities import LIPS
from scenarios.settings.files import SCENARIO_FILE


def doubt_study(
    run: Path, draws: int, *, workers: int | None = None, progress: ProgressOption = None
) -> StudyOutcome:
    """Replay the sip of a run with sampled motions, and keep what comes out beside the run.

    Parameters
    ----------
    run
        A run directory.
    draws
        How many motions; those that are there already are not computed again.
    workers, progress
        As of :func:`scenarios.decision.run.run_study`.

    Raises
    ------
    DrinksimError
        If the run's motion has no standard errors.
    """
    if draws < 2:
        raise StudyError(f"--doubt {draws}: a band needs at least 2 samples, and says more with 20")
    study = StudySettings(
        base=str((run / SCENARIO_FILE).resolve()),
        folder=run.resolve(),
        doubt=DoubtSettings(draws=draws),
        meeting=MeetingSettings(hand="recorded"),
        keep="histories",
        name=f"{run.name}, doubt",
    )
    return run_study(study, run / DOUBT_FOLDER, workers=workers, resume=True, progress=progress)


def doubt_message(run: Path) -> str:
    """Return what sampled motions do to the highest pressures of a run, in one line."""
    doubt = Doubt.of(run)
    if doubt is None:
        return "no sampled motion was replayed: see the failures in doubt/study.html"
    said = []
    for lip in LIPS:
        low, high = doubt.peak(f"{lip}_lip_window_kpa")
        said.append(f"{lip} lip {low:.0f} to {high:.0f} kPa")
    return (
        f"{100 * SHARE:.0f} % of {doubt.count} motions that the recording allows give at most "
        f"{', '.join(said)}"
    )
