"""The sips that a study's page moves through: a usual person's, and the farthest from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenarios.campaign.study import StudyOutcome
from scenarios.decision.difference_table import runs_of_units
from scenarios.decision.messages import compared_necks
from scenarios.decision.parts import Part
from scenarios.decision.style import STUDY_STYLE
from scenarios.results.doubt import RUN_FOLDER
from scenarios.results.summary import SUMMARY_FILE
from scenarios.views.page.explore import explorer
from scenarios.views.page.hypertext import Markup, page, tag
from scenarios.views.page.report import document
from scenarios.views.page.reported import Reported, reported_runs
from scenarios.views.page.style import STYLE

USUAL = (
    "Two people with both necks: {usual}, whose difference is nearest to the mean, and {farthest}, "
    "whose is farthest from it. Choose two sips to lie side by side."
)
ONE = "{usual} with both necks, whose difference is nearest to the mean."
NOT_KEPT = (
    'The sips themselves were not kept. With keep = "runs" in the study\'s file this page moves '
    "through those of a usual person and of the farthest from it."
)


@dataclass(frozen=True)
class MovedSips:
    """Sips that a page moves through; there are none unless the study keeps runs.

    ``about`` says which they are, or that there are none.
    """

    about: str
    runs: tuple[Reported, ...]

    @classmethod
    def of(cls, result: StudyOutcome) -> MovedSips:
        """Return those of the first pair of necks of a study."""
        pairs = compared_necks(result.plan, result.rows)
        if not pairs:
            return cls("", ())
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
        there = {folder: n for folder, n in labels.items() if (folder / SUMMARY_FILE).is_file()}
        if not there:
            return cls(NOT_KEPT, ())
        said = (ONE if usual == farthest else USUAL).format(usual=usual, farthest=farthest)
        runs = zip(reported_runs(list(there)), there.values(), strict=True)
        return cls(said, tuple(replace(run, label=label) for run, label in runs))

    @property
    def parts(self) -> list[Part]:
        """The section in which they move, or what is said in its place."""
        if not self.about:
            return []
        title = "Move through the sip"
        if not self.runs:
            return [Part.of("explore", title, tag("p", self.about, class_="quiet"))]
        return [Part("explore", title, explorer(self.runs, self.about), is_scripted=True)]

    def document(self, title: str, shown: Markup) -> str:
        """Return the whole page, with the scripts and data that move the sips."""
        if not self.runs:
            return page(title, STYLE + STUDY_STYLE, shown)
        return document(title, self.runs, shown, style=STUDY_STYLE)
