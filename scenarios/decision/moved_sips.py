"""The sips that a study's page moves through: a usual person's, and the farthest from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from scenarios.campaign.sip import RUN_FOLDER
from scenarios.campaign.study import StudyOutcome
from scenarios.decision.difference_table import runs_of_units
from scenarios.decision.messages import compared_necks
from scenarios.results.summary import SUMMARY_FILE
from scenarios.views.page.reported import Reported, reported_runs

USUAL = (
    "Two people with both necks: {usual}, whose difference is nearest to the mean, and {farthest}, "
    "whose is farthest from it. Choose two sips to lie side by side."
)
ONE = "{usual} with both necks, whose difference is nearest to the mean."
NOT_KEPT = (
    'The sips themselves were not kept. With keep = "runs" in the study\'s file this page moves '
    "through those of a usual person and of the farthest from it."
)


def moved_sips(result: StudyOutcome) -> tuple[str, list[Reported]]:
    """Return what is said of the sips that are moved through, and those sips.

    There are none unless the study keeps runs.
    """
    pairs = compared_necks(result.plan, result.rows)
    if not pairs:
        return "", []
    pair = pairs[0]
    away = np.abs(pair.differences - pair.mean)
    usual, farthest = pair.units[int(away.argmin())], pair.units[int(away.argmax())]
    places = runs_of_units(result.rows, pair)
    labels = {
        result.folder / places[neck, name] / RUN_FOLDER: f"{neck}, {name}"
        for name in dict.fromkeys((usual, farthest))
        for neck in (str(pair.first), str(pair.second))
        if (neck, name) in places
    }
    there = [folder for folder in labels if (folder / SUMMARY_FILE).is_file()]
    if not there:
        return NOT_KEPT, []
    said = (ONE if usual == farthest else USUAL).format(usual=usual, farthest=farthest)
    runs = reported_runs(there)
    return said, [replace(run, label=labels[_folder(run)]) for run in runs]


def _folder(run: Reported) -> Path:
    assert run.solution.folder is not None  # it was loaded from there
    return run.solution.folder
