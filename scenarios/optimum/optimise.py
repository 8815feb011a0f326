"""The best dimensions of a neck for a panel of people."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import ProgressOption, chosen_progress, no_progress
from geometry2d.neck import neck_section
from scenarios.campaign.engine import Engine, opened_engine
from scenarios.campaign.necks import NamedNeck
from scenarios.campaign.panel import Panel, panel_of
from scenarios.campaign.plan import plan_for
from scenarios.campaign.sip import WHOLE, solved_sip
from scenarios.campaign.study import Solver, carried_out, study_directory
from scenarios.campaign.table import Row, check_tables
from scenarios.campaign.variation import StudyError
from scenarios.optimum.files import write_optimum
from scenarios.optimum.found import Optimum, package_of, rounded, sign_of
from scenarios.optimum.search import (
    JOURNAL_FILE,
    ImpossibleError,
    SearchSpace,
    Trial,
    TrialResult,
    Values,
    front,
    searched,
)
from scenarios.optimum.settings import (
    OptimumSettings,
    optimum_from,
    read_optimum,
)
from scenarios.results.quantities import LIPS

SETTINGS_RECORD = "optimum.json"

LEAST_WHOLE = 0.75
"""Share of the people whose sip has to be replayed to its end for a neck to count."""


def optimise(
    settings: OptimumSettings | Mapping[str, Any] | Path | str,
    out: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    solver: Solver = solved_sip,
    progress: ProgressOption = None,
) -> Optimum:
    """Search the best dimensions of a neck and return what was found.

    Parameters
    ----------
    settings
        A file, or what a file holds.
    out
        The directory of journal, sips, table, and drawings of the best necks.
    workers, scheduler, resume, progress
        As of :func:`scenarios.decision.run.run_study`.
    solver
        Computes a sip.

    Raises
    ------
    DrinksimError
        If the settings contradict themselves, or ``out`` holds something else.
    """
    wanted, folder = _settings_of(settings), Path(out)
    check_tables()
    space = SearchSpace(wanted.bounds, len(wanted.objectives), wanted.search.seed)
    with (
        chosen_progress(progress, f"optimise {wanted.study.name}") as show,
        study_directory(wanted.study, folder, resume=resume),
        opened_engine(
            workers=workers, scheduler=scheduler, memory_mb=wanted.study.limits.memory_mb
        ) as engine,
    ):
        _keep_settings(wanted, folder)
        panel = panel_of(wanted.study, folder, no_progress)

        def evaluate(values: Values) -> TrialResult:
            return _evaluated(wanted, values, panel, engine, solver)

        def after(trial: Trial) -> None:
            share = trial.number / wanted.search.trials
            show(share, f"{trial.number} of {wanted.search.trials} necks")

        trials = searched(
            space, evaluate, trials=wanted.search.trials, journal=folder / JOURNAL_FILE, after=after
        )
        found = Optimum(wanted, trials, front(trials), folder)
        write_optimum(found)
    return found


def _settings_of(settings: OptimumSettings | Mapping[str, Any] | Path | str) -> OptimumSettings:
    if isinstance(settings, OptimumSettings):
        return settings
    if isinstance(settings, Mapping):
        return optimum_from(settings, folder=Path.cwd(), name="optimum")
    return read_optimum(Path(settings))


def _keep_settings(wanted: OptimumSettings, folder: Path) -> None:
    """Keep what a journal belongs to; refuse another one's."""
    record = {
        "neck": wanted.neck,
        "bounds": {name: list(ends) for name, ends in wanted.bounds.items()},
        "objectives": list(wanted.objectives),
        "constraints": str(wanted.constraints),
        "seed": wanted.search.seed,
        "version": version("drinksim"),
    }
    file = folder / SETTINGS_RECORD
    if file.is_file() and json.loads(file.read_text(encoding="utf-8")) != record:
        raise StudyError(f"{folder} holds another optimisation: give another --out")
    with file_at_once(file) as partial:
        partial.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _evaluated(
    wanted: OptimumSettings, values: Values, panel: Panel, engine: Engine, solver: Solver
) -> TrialResult:
    """Let the panel drink from the neck of some values."""
    tried = rounded(values)
    measurements = wanted.measurements(tried)
    try:
        neck_section(measurements)
        plan = plan_for(panel, [NamedNeck("tried", package_of(wanted, tried))])
    except ImpossibleError:
        raise
    except ValueError as error:
        raise ImpossibleError(str(error)) from error
    result = carried_out(plan, panel.out, engine, solver=solver, progress=no_progress)
    whole = [row for row in result.rows if row["status"] == WHOLE]
    if len(whole) < LEAST_WHOLE * len(result.rows):
        reason = next(row["reason"] for row in result.rows if row["status"] != WHOLE)
        raise ImpossibleError(f"only {len(whole)} of {len(result.rows)} drink from it: {reason}")
    return TrialResult(
        tuple(_mean(whole, name) * sign_of(name) for name in wanted.objectives),
        _violations(wanted, whole),
        max((doubt for row in whole if (doubt := row["mesh_doubt"]) is not None), default=None),
    )


def _mean(rows: Sequence[Row], measure: str) -> float:
    if any(measure not in row for row in rows):
        raise StudyError(f"objective {measure} is not measured in these sips: it needs [liquid]")
    return float(np.mean([row[measure] for row in rows]))


def _violations(wanted: OptimumSettings, rows: Sequence[Row]) -> dict[str, float]:
    least = wanted.constraints.least_seal_kpa
    if least is None:
        return {}
    return {
        f"seal of the {lip} lip": least - _mean(rows, f"{lip}_lip_seal_margin_kpa") for lip in LIPS
    }
