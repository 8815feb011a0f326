"""Functions of the front door: values out, and nothing on disk unless it is asked for."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geometry2d.foundation.progress import ProgressOption, chosen_progress

if TYPE_CHECKING:
    from mocap.motion.motion import Motion
    from scenarios.campaign.study import StudyOutcome
    from scenarios.results.solution import Solution
    from scenarios.views.page.notebook import Explorer


class RecordingWarning(UserWarning):
    """What a reader must know of a recording and of what was measured in it."""


def convert(
    video: Path | str,
    *,
    markers: Path | str | None = None,
    out: Path | str | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    tracks: Path | str | None = None,
    fps: float | None = None,
    progress: ProgressOption = None,
) -> Motion:
    """Return the motion of head and package in a video, with its standard errors.

    What a reader must know of the recording is warned of (:class:`RecordingWarning`).

    Parameters
    ----------
    video, markers
        The recording, and the file that says where its markers are; coded stickers need none.
    out
        A directory for tables, chart and overlay too; None writes nothing.
    start_s, end_s, tracks, fps
        As in :class:`mocap.convert.ConvertOptions`.
    progress
        True shows a line on the terminal or in the notebook; a function is called with the share
        that is done and what is being done.

    Raises
    ------
    DrinksimError
        If an input cannot be used, or ``out`` cannot be written.
    """
    from mocap.convert import convert as converted

    result = converted(
        video,
        markers,
        out=out,
        start_s=start_s,
        end_s=end_s,
        tracks=tracks,
        fps=fps,
        progress=progress,
    )
    for text in result.warnings:
        warnings.warn(text, RecordingWarning, stacklevel=2)
    return result.motion


def explore(
    solutions: Solution | Path | str | Sequence[Solution | Path | str], *, height_px: int = 900
) -> Explorer:
    """Return the moving part of a report for a notebook: a slider for section, imprint and curves.

    Parameters
    ----------
    solutions
        One, or several, each once; run directories are loaded. Two lie side by side with their
        difference.
    height_px
        Of the frame in the notebook.

    Raises
    ------
    DrinksimError
        If a solution lacks what is to be shown, or if one is given twice.
    """
    from scenarios.results.solution import Solution, loaded
    from scenarios.views.page.notebook import explored

    several = [solutions] if isinstance(solutions, Solution | Path | str) else solutions
    return explored([loaded(solution) for solution in several], height_px)


def report(
    solutions: Sequence[Solution | Path | str],
    out: Path | str,
    *,
    progress: ProgressOption = None,
) -> Path:
    """Write one self-contained page about one solution, or comparing several, and return its path.

    Parameters
    ----------
    solutions
        Each once; run directories are loaded.
    out
        The page, ending in ``.html``.
    progress
        As of :func:`convert`.

    Raises
    ------
    DrinksimError
        If a solution lacks what is to be shown, if one is given twice, or if ``out`` has another
        ending or cannot be written.
    """
    from scenarios.results.solution import loaded
    from scenarios.views.page.report import write_report

    with chosen_progress(progress, "report") as show:
        write_report([loaded(solution) for solution in solutions], Path(out), progress=show)
    return Path(out)


def study(
    study: Mapping[str, Any] | Path | str,
    out: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    progress: ProgressOption = None,
) -> StudyOutcome:
    """Compare necks on many people, and return the study; its page and tables are in ``out``.

    Parameters
    ----------
    study
        A study file, or what such a file holds.
    out
        The study's directory.
    workers
        That many processes of one thread each on this machine; None computes in this process.
    scheduler
        Address of a Dask scheduler whose workers see the same files.
    resume
        Go on with an unfinished study in ``out``, or use what it has of another one.
    progress
        As of :func:`convert`.

    Raises
    ------
    DrinksimError
        If the study contradicts itself, or ``out`` holds something else.
    """
    from scenarios.decision.run import run_study

    return run_study(
        study, out, workers=workers, scheduler=scheduler, resume=resume, progress=progress
    )
