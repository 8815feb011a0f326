"""study.html: one file, offline, with the answer on top and every number's origin below."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.text import counted
from scenarios.campaign.measures import HEADLINE
from scenarios.campaign.plan import Plan
from scenarios.campaign.sip import WHOLE
from scenarios.campaign.study import StudyOutcome
from scenarios.campaign.table import PARQUET_FILE, Row
from scenarios.decision.comparison import (
    CONFIDENCE,
    factor_columns,
)
from scenarios.decision.figures import (
    effects_figure,
    indices_figure,
)
from scenarios.decision.indices import effects, indices
from scenarios.decision.messages import (
    headline,
)
from scenarios.decision.moved_sips import MovedSips
from scenarios.decision.notes import gathered, mesh_sentence
from scenarios.decision.pair_section import pair_sections
from scenarios.decision.parts import Part, body, contents, figure
from scenarios.decision.people_section import people_sections
from scenarios.results.doubt import STUDY_TABLE
from scenarios.results.quantities import LIPS
from scenarios.views.page.embedded import data_address
from scenarios.views.page.hypertext import Markup, joined, tag
from scenarios.views.page.tables import ABSENT, scrolled

PAGE_FILE = "study.html"


def write_page(result: StudyOutcome, out: Path) -> Path:
    """Write the page of a study into a directory and return its path."""
    plan, rows = result.plan, result.rows
    moved = MovedSips.of(result)
    parts = [
        _answer(result),
        *pair_sections(result),
        *moved.parts,
        *_sensitivity(rows),
        *people_sections(result),
        _rule(result),
        *_notes(rows),
        _failures(result),
        _sips(rows),
        _trust(),
        _repeat(result),
    ]
    shown = joined(_header(result, parts), body(parts))
    title = f"{plan.settings.name}: {', '.join(neck.name for neck in plan.necks)}"
    file = out / PAGE_FILE
    with file_at_once(file) as partial:
        partial.write_text(moved.document(title, shown), encoding="utf-8")
    return file


def _header(result: StudyOutcome, parts: Sequence[Part]) -> Markup:
    plan = result.plan
    whole = len(result.rows) - len(result.failed)
    people = counted(len(plan.people), "person", "people") if plan.people else "the filmed person"
    necks = counted(len(plan.necks), "neck", "necks")
    sips = counted(len(result.rows), "sip", "sips")
    said = f"{necks}, {people}, {sips}, {whole} of them replayed to the end"
    return tag(
        "header",
        tag("p", "drinksim study", class_="quiet"),
        tag("h1", plan.settings.name),
        tag("p", said, class_="lead"),
        contents(parts),
    )


def _answer(result: StudyOutcome) -> Part:
    said = headline(result.plan, result.rows)
    parts = [tag("p", tag("strong", said), class_="answer")]
    left = len(result.failed)
    if left:
        parts.append(
            tag(
                "p",
                f"{left} of {len(result.rows)} sips failed and are left out, with those they would "
                "be compared with.",
                class_="warning",
            )
        )
    rough = mesh_sentence(result.rows)
    if rough is not None:
        parts.append(tag("p", rough, class_="warning"))
    parts.append(
        tag(
            "p",
            "The model is a plane section of passive lips: its pressures compare openings, "
            "they are not yet a person's.",
            class_="quiet",
        )
    )
    return Part.of("answer", "In a sentence", *parts)


def _sensitivity(rows: Sequence[Row]) -> list[Part]:
    label = "highest pressure, kPa"
    found, shares = effects(rows, HEADLINE), indices(rows, HEADLINE)
    parts: list[Markup] = []
    if shares is not None:
        parts += [
            figure(indices_figure(shares, label)),
            tag(
                "p",
                "Upper points: the share that a setting causes alone; lower points: with all "
                f"others together. {shares.samples} samples, bootstrapped {100 * CONFIDENCE:.0f} % "
                "intervals.",
            ),
        ]
    if found:
        parts += [
            figure(effects_figure(found, label)),
            tag("p", "What each setting changes, all else being the same, with its interval."),
        ]
    return [Part.of("sensitivity", "What matters", *parts)] if parts else []


def _rule(result: StudyOutcome) -> Part:
    plan = result.plan
    texts = []
    for film in plan.films:
        meets = film.meeting
        where = (
            f"{film.name}: in the filmed sip the rim's lower edge reaches the lower lip "
            f"{meets.place_mm:.1f} mm from its margin, at {meets.time_s:.2f} s."
        )
        texts.append(where)
    if plan.people and plan.settings.meeting.at == "lower_lip":
        texts.append(
            "Each person meets the neck there on his or her own lower lip: the whole path of the "
            f"neck is shifted, its directions in the head stay. {_shifts(plan)}"
        )
    elif plan.people:
        texts.append("Each person meets the neck where the film has it in the head.")
    mode = plan.films[0].base.hand.mode
    texts.append(
        {
            "force": "From the first touch on, each lip bears the force that it bears in the "
            f"filmed sip{_held(result.rows)}.",
            "same": "The hand bears what it bears in the filmed sip, and yields to more.",
            "recorded": "The neck follows the film, whatever force that takes.",
        }[mode]
    )
    return Part.of("rule", "How they meet", *(tag("p", text) for text in texts))


def _shifts(plan: Plan) -> str:
    """Return how far the path of the neck is shifted for the people, in words."""
    meeting = plan.films[0].meeting
    placements = [meeting.met_by(person.measurements).placement for person in plan.people]
    filmed = meeting.scenario.placement
    spans = []
    for name, words in (("shift_x_mm", "forward"), ("shift_y_mm", "up")):
        away = [float(getattr(p, name)) - float(getattr(filmed, name)) for p in placements]
        spans.append(f"{min(away):+.1f} to {max(away):+.1f} mm {words}".replace("-", "−"))
    return (
        f"That moves it by {' and '.join(spans)}: so far from their lips' places the people would "
        "meet it where the film has it."
    )


def _held(rows: Sequence[Row]) -> str:
    """Return how well forces were held over the whole sips, in words."""
    parts = []
    for lip in LIPS:
        values = [row[f"{lip}_lip_force_n_peak"] for row in rows if row["status"] == WHOLE]
        if values:
            parts.append(f"{lip} {1e3 * min(values):.1f} to {1e3 * max(values):.1f} mN")
    return (
        f" (largest forces over all sips: {', '.join(parts)}, of a section 1 mm thick)"
        if parts
        else ""
    )


def _notes(rows: Sequence[Row]) -> list[Part]:
    entries = [
        tag("li", f"{note.count} of {len(rows)} sips, first {note.first}: {note.text}.")
        for note in gathered(rows)
    ]
    return [Part.of("notes", "What to mind", tag("ul", *entries))] if entries else []


def _failures(result: StudyOutcome) -> Part:
    if not result.failed:
        return Part.of("failures", "Failures", tag("p", "None."))
    factors = factor_columns(result.rows)
    entries = [
        tag(
            "li",
            f"{', '.join(str(row.get(name)) for name in factors)}: ",
            f"{row['status']}, {row['reason']} (",
            tag("a", "run", href=str(row["run"])),
            ")",
        )
        for row in result.failed
    ]
    return Part.of("failures", "Failures", tag("ul", *entries))


def _sips(rows: Sequence[Row]) -> Part:
    names = [*factor_columns(rows), "status", "seconds", HEADLINE]
    lines = [
        tag(
            "tr",
            *(tag("td", _cell(row.get(name))) for name in names),
            tag("td", tag("a", "run", href=str(row["run"]))),
        )
        for row in rows
    ]
    head = tag("thead", tag("tr", *(tag("th", name, scope="col") for name in (*names, ""))))
    table = scrolled("every sip", tag("table", head, tag("tbody", *lines)))
    return Part.of("sips", "Every sip", tag("details", tag("summary", "The table"), table))


def _cell(value: object) -> str:
    if value is None:
        return ABSENT
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _trust() -> Part:
    limits = (
        "An interval holds what differs among people, motions and settings of the study. It does "
        "not hold what the model leaves out: the third dimension, lips that act, other films.",
        "People are sampled from norms of faces, with correlations of a morphable face; nobody was "
        "measured for this study.",
        "Pressure at a coarse mesh is rougher than the table's digits: rank with it, decide with a "
        "finer one.",
    )
    return Part.of("trust", "How far to trust it", tag("ul", *(tag("li", text) for text in limits)))


def _repeat(result: StudyOutcome) -> Part:
    table = (result.folder / STUDY_TABLE).read_bytes()
    return Part.of(
        "repeat",
        "How to repeat it",
        tag(
            "p",
            "All columns: ",
            tag("a", STUDY_TABLE, href=data_address(table, "text/csv"), download=STUDY_TABLE),
            f" (in this page), {PARQUET_FILE} beside it. Each sip's directory holds its scenario: ",
            tag("code", "drinksim replay runs/…/scenario.toml --out again"),
            " computes it anew, with all its fields.",
        ),
    )
