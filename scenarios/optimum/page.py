"""optimum.html: what was found, the best necks drawn, and everything that was tried."""

from __future__ import annotations

from pathlib import Path

from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.text import counted
from geometry2d.neck import NECKS, neck_section
from scenarios.decision.messages import meaning
from scenarios.decision.pair_section import LABELS
from scenarios.decision.parts import Part, body, contents, figure
from scenarios.optimum.figures import neck_figure, search_figure
from scenarios.optimum.found import (
    PAGE_FILE,
    TRIALS_FILE,
    Optimum,
    mesh_sentence,
    rounded,
    sign_of,
)
from scenarios.optimum.search import Trial
from scenarios.views.page.embedded import image
from scenarios.views.page.hypertext import Markup, joined, page, tag
from scenarios.views.page.style import STYLE
from scenarios.views.page.tables import scrolled

MOST_DRAWN = 12
"""Best necks that are drawn; the table has all."""

ENDINGS = (".dxf", ".svg", ".toml")

CARDS = """
.best { display: grid; gap: 1rem; list-style: none; padding: 0;
  grid-template-columns: repeat(auto-fill, minmax(min(22rem, 100%), 1fr)); }
.best > li { background: var(--panel); border: 1px solid var(--line); border-radius: 8px;
  padding: .8rem 1rem; }
.best h3 { margin: 0 0 .4rem; }
.best th, .best td { min-width: 0 !important; padding: .24rem .4rem; }
.best th[scope=row] { white-space: normal; }
.best img { background: white; border-radius: 4px; width: 100%; }
"""


def write_page(found: Optimum) -> Path:
    """Write the page of a search into its folder and return its path."""
    parts = [_answer(found), _front(found), _best(found), _tried(found), _trust(found)]
    title = f"{found.settings.study.name}: {found.settings.neck}"
    header = tag(
        "header",
        tag("p", "drinksim optimise", class_="quiet"),
        tag("h1", found.settings.study.name),
        tag("p", _lead(found), class_="lead"),
        contents(parts),
    )
    file = found.folder / PAGE_FILE
    with file_at_once(file) as partial:
        whole = page(title, STYLE + CARDS, joined(header, body(parts)))
        partial.write_text(whole, encoding="utf-8")
    return file


def _lead(found: Optimum) -> str:
    people = found.settings.study.people
    who = "the filmed person" if people is None else counted(people.count, "person", "people")
    tried = counted(len(found.trials), "neck", "necks")
    bounds = ", ".join(found.settings.bounds)
    return f"{bounds} of {found.settings.neck}, {tried} tried by {who}"


def _answer(found: Optimum) -> Part:
    names = found.settings.objectives
    if not found.best:
        said = f"None of {len(found.trials)} necks meets every constraint."
    elif len(names) == 1:
        (best, *_) = found.best
        said = (
            f"Neck {best.number} is best of {len(found.trials)}: "
            f"{meaning(names[0])} is {found.measures(best)[names[0]]:.4g}, the panel's mean."
        )
    else:
        said = (
            f"{len(found.best)} of {len(found.trials)} necks are such that no other one is better "
            f"in all of: {'; '.join(meaning(name) for name in names)}."
        )
    parts = [tag("p", tag("strong", said))]
    if (rough := mesh_sentence(found)) is not None:
        parts.append(tag("p", rough, class_="warning"))
    return Part.of("answer", "In a sentence", *parts)


def _front(found: Optimum) -> Part:
    names = found.settings.objectives
    picture = search_figure(found.trials, found.best, names, [sign_of(name) for name in names])
    title = "The front" if len(names) > 1 else "The search"
    return Part.of("front", title, figure(picture))


def _best(found: Optimum) -> Part:
    cards = [_card(found, trial) for trial in found.best[:MOST_DRAWN]]
    left = len(found.best) - len(cards)
    about = f"The lower wall near the opening; dashed, {found.settings.neck} as it was."
    parts = [tag("p", about), tag("ul", *cards, class_="best")]
    if left > 0:
        parts.append(tag("p", f"{left} more are in the table, and in the folder best."))
    return Part.of("best", "The best necks", *(parts if cards else [tag("p", "None.")]))


def _card(found: Optimum, trial: Trial) -> Markup:
    values, place = rounded(trial.values), found.place(trial)
    base = NECKS[found.settings.neck]
    rows = [
        tag(
            "tr",
            tag("th", name, scope="row"),
            tag("td", f"{value:g}"),
            tag("td", f"{getattr(base, name):g}"),
        )
        for name, value in values.items()
    ]
    results = [
        tag("tr", tag("th", _title(name), scope="row"), tag("td", f"{value:.4g}"), tag("td"))
        for name, value in found.measures(trial).items()
    ]
    head = tag("tr", tag("td"), *(tag("th", n, scope="col") for n in ("here", found.settings.neck)))
    links = [tag("a", ending[1:].upper(), href=f"{place}{ending}") for ending in ENDINGS]
    shows = ", ".join(f"{name} {value:g}" for name, value in values.items())
    table = tag("table", tag("thead", head), tag("tbody", *rows, *results))
    return tag(
        "li",
        tag("h3", f"Neck {trial.number}"),
        image(
            neck_figure(found.section(trial), neck_section(base), f"Neck {trial.number}: {shows}")
        ),
        scrolled(f"neck {trial.number}", table),
        tag("p", *(part for link in links for part in (link, " "))),
    )


def _title(measure: str) -> str:
    return LABELS.get(measure, measure)


def _tried(found: Optimum) -> Part:
    bounds, names = list(found.settings.bounds), list(found.settings.objectives)
    columns = ("neck", *bounds, *map(_title, names), "constraints hold", "best")
    rows = [
        tag(
            "tr",
            tag("th", str(trial.number), scope="row"),
            *(tag("td", f"{rounded(trial.values)[name]:g}") for name in bounds),
            *(tag("td", f"{found.measures(trial)[name]:.4g}") for name in names),
            tag("td", "yes" if trial.evaluation.is_feasible else "no"),
            tag("td", "yes" if trial in found.best else ""),
        )
        for trial in found.trials
    ]
    head = tag("thead", tag("tr", *(tag("th", name, scope="col") for name in columns)))
    table = scrolled("every neck", tag("table", head, tag("tbody", *rows)))
    return Part.of(
        "tried",
        "Every neck",
        tag("details", tag("summary", "The table"), table),
        tag("p", "The same as ", tag("a", TRIALS_FILE, href=TRIALS_FILE), ", lengths in mm."),
    )


def _trust(found: Optimum) -> Part:
    limits = (
        "The best neck of a search has seen its own panel, and the noise of its mesh: compare it "
        "with the old one in a study of other people (another seed), at a finer mesh, before it is "
        "believed.",
        "What is neither objective nor constraint was not looked at: moulding, closing, holding.",
        "The model is a plane section: its pressures compare openings, they are not a person's.",
    )
    command = f"drinksim replay {found.place(found.best[0])}.toml --out run" if found.best else ""
    parts = [tag("ul", *(tag("li", text) for text in limits))]
    if command:
        parts.append(tag("p", "With all its fields: ", tag("code", command)))
    return Part.of("trust", "How far to trust it", *parts)
