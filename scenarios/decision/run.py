"""A study from its file to its page, as the command and the front door run it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from geometry2d.foundation.progress import Progress, ProgressOption, chosen_progress
from geometry2d.foundation.text import counted
from scenarios.campaign.engine import opened_engine
from scenarios.campaign.plan import Plan, planned
from scenarios.campaign.settings import StudySettings, read_study, study_from
from scenarios.campaign.study import (
    StudyOutcome,
    carried_out,
    duration,
    plan_of,
    study_directory,
)
from scenarios.campaign.table import check_tables
from scenarios.decision.messages import headline
from scenarios.decision.notes import mesh_sentence
from scenarios.decision.page import write_page
from scenarios.settings.hand import HandSettings

SECONDS = {"quick": 8.0, "coarse": 35.0, "standard": 90.0, "fine": 200.0, "thesis": 400.0}
"""Time of a sip on one thread of a machine of 2020, s, by resolution; for the estimate only."""

PREVIEWS = "previews"


@dataclass(frozen=True)
class DryRun:
    """What a study would compute.

    Attributes
    ----------
    plan
        Its cases.
    seconds
        About how long that takes.
    pictures
        A preview of each neck on the filmed head.
    """

    plan: Plan
    seconds: float
    pictures: tuple[Path, ...]


def settings_of_study(study: StudySettings | Mapping[str, Any] | Path | str) -> StudySettings:
    """Return the settings of a study given as such, as a document, or as a file."""
    if isinstance(study, StudySettings):
        return study
    if isinstance(study, Mapping):
        return study_from(study, folder=Path.cwd(), name="study")
    return read_study(Path(study))


def run_study(
    study: StudySettings | Mapping[str, Any] | Path | str,
    out: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    progress: ProgressOption = None,
) -> StudyOutcome:
    """Carry out a study and return it; tables and page are in its directory then.

    Parameters
    ----------
    study
        A file, or what a file holds; relative paths of the latter start from the current directory.
    out
        The study's directory. What it holds of the study's sips is not computed again.
    workers
        That many processes on this machine; None or 0 computes in this process.
    scheduler
        Address of a Dask scheduler whose workers see the same files.
    resume
        Go on with an unfinished study in ``out``, or add to another one.
    progress
        As of :func:`scenarios.sip.run.solve`.

    Raises
    ------
    DrinksimError
        If the study contradicts itself, or ``out`` holds something else.
    """
    settings, folder = settings_of_study(study), Path(out)
    check_tables()
    with (
        chosen_progress(progress, f"study {settings.name}") as show,
        study_directory(settings, folder, resume=resume),
    ):
        plan = plan_of(settings, folder, show)
        with opened_engine(
            workers=workers, scheduler=scheduler, memory_mb=settings.limits.memory_mb
        ) as engine:
            result = carried_out(plan, folder, engine, progress=show)
        write_page(result, folder)
    return result


def dry_run(
    study: StudySettings | Mapping[str, Any] | Path | str,
    out: Path | str,
    *,
    workers: int | None = None,
    progress: Progress,
) -> DryRun:
    """Return what a study would compute; pictures of its necks are in its directory then.

    Arguments and errors are those of :func:`run_study`.
    """
    from scenarios.views.preview import write_preview

    settings, folder = settings_of_study(study), Path(out)
    with study_directory(settings, folder, resume=True):
        plan = planned(settings, folder, progress)
        pictures = []
        for neck in plan.necks:
            film = plan.films[0]
            shown = film.base.with_(package=neck.package) if neck.package else film.base
            file = folder / PREVIEWS / f"{_file_name(neck.name)}.png"
            # The run that a hand follows is not there yet, and moves nothing in a preview.
            shown = replace(shown, name=f"{film.name}, {neck.name}", hand=HandSettings())
            write_preview(shown, file, progress=progress)
            pictures.append(file)
    each = SECONDS.get(plan.films[0].base.numerics.resolution, SECONDS["standard"])
    seconds = each * len({case.identity for case in plan.cases}) / max(workers or 1, 1)
    return DryRun(plan, seconds, tuple(pictures))


def _file_name(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)


def dry_run_message(found: DryRun, workers: int | None) -> str:
    """Return what a dry run found, in lines."""
    plan = found.plan
    who = counted(len(plan.people), "person", "people") if plan.people else "the filmed person"
    necks = counted(len(plan.necks), "neck", "necks")
    rejected = sum(len(person.rejected) for person in plan.people)
    lines = [
        f"{counted(len(plan.cases), 'sip', 'sips')}: {necks}, {who}, "
        f"{counted(len(plan.films), 'motion', 'motions')}",
        *(f"  varied: {each.about()}" for each in plan.settings.vary),
        f"about {duration(found.seconds)} with {max(workers or 1, 1)} at once, at "
        f"{plan.films[0].base.numerics.resolution} resolution",
    ]
    if plan.people:
        lines.append(f"{rejected} draws of heads were rejected and sampled anew")
    lines += [f"{picture}" for picture in found.pictures]
    return "\n".join(lines)


def study_message(result: StudyOutcome) -> str:
    """Return what a study found, in lines."""
    failed = len(result.failed)
    said = counted(len(result.rows), "sip", "sips") + (
        f", {failed} of them failed" if failed else ""
    )
    files = f"{result.folder}: study.html, results.parquet, results.csv; {said}"
    lines = [files, headline(result.plan, result.rows), mesh_sentence(result.rows)]
    return "\n".join(line for line in lines if line is not None)
