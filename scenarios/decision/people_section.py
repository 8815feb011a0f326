"""What a study's page shows of the people: their sections, and their measurements."""

from __future__ import annotations

import numpy as np

from geometry2d.anatomy.population import NORMS
from scenarios.campaign.study import StudyOutcome
from scenarios.decision.figures import people_figure
from scenarios.decision.parts import Part, figure
from scenarios.views.page.hypertext import tag
from scenarios.views.page.tables import ABSENT, scrolled


def people_sections(result: StudyOutcome) -> list[Part]:
    """Return the section of the people; none if the filmed person drinks."""
    people = result.plan.people
    if not people:
        return []
    rejected = [reason for person in people for reason in person.rejected]
    told = (
        f"{len(rejected)} of {len(people) + len(rejected)} draws made no head, and were sampled "
        "anew."
        if rejected
        else "Every draw made a head."
    )
    rows = []
    for name, norm in NORMS.items():
        cells = []
        for sex in ("female", "male"):
            values = [getattr(p.measurements, name) for p in people if p.sex == sex]
            mean, spread = norm.of("female" if sex == "female" else "male")
            sample = (
                f"{np.mean(values):.1f} ± {np.std(values, ddof=1):.1f}"
                if len(values) > 1
                else ABSENT
            )
            cells += [sample, f"{mean:.1f} ± {spread:.1f}"]
        cells.append(norm.source)
        rows.append(tag("tr", tag("th", name, scope="row"), *(tag("td", cell) for cell in cells)))
    names = ("measurement", "women here", "women", "men here", "men", "source")
    table = tag(
        "table",
        tag("thead", tag("tr", *(tag("th", name, scope="col") for name in names))),
        tag("tbody", *rows),
    )
    return [
        Part.of(
            "people",
            "Who drinks",
            tag("p", f"{told} Measurements of one face go together as in the how-to of studies."),
            figure(people_figure(people)),
            tag(
                "details",
                tag("summary", "Their measurements beside the population's"),
                scrolled("measurements", table),
            ),
        )
    ]
