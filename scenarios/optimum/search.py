"""The search for the best values of a few numbers, with a journal that resumes.

Optuna proposes (a tree-structured Parzen estimator, Watanabe 2023) and keeps the journal. What it
proposes next depends on the seed and on the trials that are complete and on nothing else: a search
that was interrupted goes on as if it had not been.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.campaign.engine import INSTALL
from scenarios.campaign.variation import StudyError

Values = Mapping[str, float]

FEWEST_STARTS, STARTS_A_NUMBER = 6, 3
"""Trials that are proposed at random before the search learns."""

JOURNAL_FILE = "journal.log"
MOST_REJECTED = 50
"""Proposals in a row that may be impossible before a search gives up."""

VIOLATIONS, MESH_DOUBT = "violations", "mesh_doubt"
"""What the journal keeps of a trial beside its objectives."""


@dataclass(frozen=True)
class TrialResult:
    """What came out of a trial.

    Attributes
    ----------
    objectives
        The numbers that are to be small.
    violations
        By constraint, by how much it is missed; 0 or less where it holds.
    mesh_doubt
        By which share two measures of the highest pressure differ, in the panel's worst sip.
    """

    objectives: tuple[float, ...]
    violations: Mapping[str, float]
    mesh_doubt: float | None = None

    @property
    def is_feasible(self) -> bool:
        """Whether every constraint holds."""
        return all(value <= 0 for value in self.violations.values())


@dataclass(frozen=True)
class Trial:
    """Values that were tried, and what came out."""

    number: int
    values: Values
    evaluation: TrialResult


@dataclass(frozen=True)
class SearchSpace:
    """Bounds of the numbers, by name, and the seed of what is proposed."""

    bounds: Mapping[str, tuple[float, float]]
    objectives: int
    seed: int


Evaluate = Callable[[Values], TrialResult]


class ImpossibleError(StudyError):
    """Values that describe nothing that could be tried; another proposal takes their place."""


def searched(
    space: SearchSpace,
    evaluate: Evaluate,
    *,
    trials: int,
    journal: Path,
    after: Callable[[Trial], None] = lambda trial: None,
) -> tuple[Trial, ...]:
    """Return the complete trials of a search, the earlier ones from its journal.

    Parameters
    ----------
    space
        What is searched.
    evaluate
        Tries values; raises :class:`ImpossibleError` for those that cannot be tried.
    trials
        How many there shall be.
    journal
        The file that remembers them.
    after
        Told of every new trial.

    Raises
    ------
    StudyError
        If Optuna is not installed, or nothing proposed is possible.
    """
    optuna = _optuna()
    study = _opened(optuna, space, journal)
    for stale in study.get_trials(states=[optuna.trial.TrialState.RUNNING]):
        study.tell(stale.number, state=optuna.trial.TrialState.FAIL)
    rejected = 0
    while len(done := _complete(study, optuna)) < trials:
        failed = _count(study, optuna.trial.TrialState.PRUNED)
        # Interrupted trials do not count: the same values are proposed again after them.
        study.sampler = _sampler(optuna, space, len(done), failed)
        proposed = study.ask(
            {
                name: optuna.distributions.FloatDistribution(low, high)
                for name, (low, high) in space.bounds.items()
            }
        )
        try:
            found = evaluate(proposed.params)
        except ImpossibleError as error:
            study.tell(proposed, state=optuna.trial.TrialState.PRUNED)
            rejected += 1
            if rejected == MOST_REJECTED:
                raise StudyError(
                    f"{MOST_REJECTED} proposals in a row are impossible, the last as {error}: "
                    "narrow [bounds]"
                ) from error
            continue
        rejected = 0
        proposed.set_user_attr(VIOLATIONS, dict(found.violations))
        proposed.set_user_attr(MESH_DOUBT, found.mesh_doubt)
        for name, value in found.violations.items():
            proposed.set_constraint(name, value)
        study.tell(proposed, list(found.objectives))
        after(_complete(study, optuna)[-1])
    return tuple(done)


def front(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return the feasible trials that no other feasible one beats in every objective."""
    feasible = [trial for trial in trials if trial.evaluation.is_feasible]
    return tuple(
        trial
        for trial in feasible
        if not any(_beats(other.evaluation, trial.evaluation) for other in feasible)
    )


def _beats(one: TrialResult, other: TrialResult) -> bool:
    pairs = list(zip(one.objectives, other.objectives, strict=True))
    return all(a <= b for a, b in pairs) and any(a < b for a, b in pairs)


def _opened(optuna: Any, space: SearchSpace, journal: Path) -> Any:
    journal.parent.mkdir(parents=True, exist_ok=True)
    backend = optuna.storages.journal.JournalFileBackend(str(journal))
    return optuna.create_study(
        study_name="search",
        storage=optuna.storages.JournalStorage(backend),
        directions=["minimize"] * space.objectives,
        load_if_exists=True,
    )


def _sampler(optuna: Any, space: SearchSpace, done: int, failed: int) -> Any:
    """Return what proposes the next trial, its random numbers decided by what there is."""
    seed = (space.seed * 1_000_003 + done * 1009 + failed) % 2**31
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        return optuna.samplers.TPESampler(
            seed=seed,
            multivariate=True,
            n_startup_trials=max(FEWEST_STARTS, STARTS_A_NUMBER * len(space.bounds)),
        )


def _complete(study: Any, optuna: Any) -> list[Trial]:
    """Return the complete trials, in their order."""
    found = study.get_trials(deepcopy=False, states=[optuna.trial.TrialState.COMPLETE])
    return [
        Trial(
            number,
            dict(trial.params),
            TrialResult(
                tuple(map(float, trial.values)),
                dict(trial.user_attrs[VIOLATIONS]),
                trial.user_attrs.get(MESH_DOUBT),
            ),
        )
        for number, trial in enumerate(found, start=1)
        if all(map(math.isfinite, trial.values))
    ]


def _count(study: Any, state: Any) -> int:
    return len(study.get_trials(deepcopy=False, states=[state]))


def _optuna() -> Any:
    try:
        import optuna
    except ImportError:
        raise StudyError(f"optuna is not installed, which a search needs: {INSTALL}") from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna
