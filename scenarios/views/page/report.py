"""A report: one page that holds all of a run, or of several beside each other.

The page is a single file that loads nothing: pictures, data and scripts are embedded. What comes
from files (names, descriptions, settings) is escaped by :mod:`scenarios.views.page.hypertext`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from geometry2d.foundation.output import check_writable, file_at_once
from geometry2d.foundation.progress import Progress, no_progress, part_of
from scenarios.messages.lines import lips_message
from scenarios.results.history_file import HISTORY_FILE
from scenarios.results.quantities import LIPS
from scenarios.results.run_inputs import REFERENCE_FOLDER
from scenarios.results.solution import Solution
from scenarios.results.texts import history_bytes, repeating_files
from scenarios.settings.files import SCENARIO_FILE
from scenarios.views.limits import upper_limit
from scenarios.views.page.embedded import data_address
from scenarios.views.page.explore import explorer
from scenarios.views.page.histories import histories
from scenarios.views.page.hypertext import Markup, folded, joined, page, tag
from scenarios.views.page.key_numbers import key_numbers
from scenarios.views.page.moving import moving_page
from scenarios.views.page.reported import Reported, ReportError, reported_runs
from scenarios.views.page.run_section import run_section
from scenarios.views.page.scripts import (
    data_element,
    explorer_style,
    library_style,
    page_script,
    script_element,
    script_policy,
)
from scenarios.views.page.style import STYLE
from scenarios.views.page.verdicts import verdicts
from scenarios.views.plots import imprint


def write_report(
    runs: Sequence[Solution | Path],
    out: Path,
    *,
    progress: Progress = no_progress,
) -> None:
    """Write one self-contained page about one solution, or comparing several.

    Parameters
    ----------
    runs
        Solutions or their run directories, each once.
    out
        The page, ending in ``.html``.

    Raises
    ------
    DrinksimError
        If a run lacks what is to be shown, if one is given twice or if the ending is another.
    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise ReportError(f"--out {out} must end in .html")
    check_writable(out)
    reported = reported_runs(runs)
    highest = upper_limit(
        float(imprint(run.solution, lip)[1].max()) for run in reported for lip in LIPS
    )
    pictures = []
    for index, run in enumerate(reported):
        part = part_of(
            progress, index / len(reported), (index + 1) / len(reported), title=run.label
        )
        pictures.append(run_section(run, highest, part))
    sections = [
        verdicts(reported),
        explorer(reported),
        key_numbers(reported),
        histories(reported),
        _pictures(pictures),
        _trust(reported),
        _repeat(reported),
    ]
    with file_at_once(out) as partial:
        shown = joined(_header(reported), tag("main", *sections))
        whole = document(_title(reported), reported, shown)
        partial.write_text(whole, encoding="utf-8")


def document(title: str, runs: Sequence[Reported], shown: Markup, *, style: str = "") -> str:
    """Return a whole page: what is shown, the data of its moving part, and the script.

    Parameters
    ----------
    title
        Of the window.
    runs
        What is moved through.
    shown
        What the page shows; it holds :func:`scenarios.views.page.explore.explorer` once.
    style
        CSS beside that of a report.
    """
    script = page_script()
    body = joined(
        shown,
        data_element("moving", moving_page(runs)),
        script_element(script),
    )
    whole = STYLE + library_style() + explorer_style() + style
    return page(title, whole, body, scripts=script_policy(script))


def _title(runs: Sequence[Reported]) -> str:
    return runs[0].label if len(runs) == 1 else " · ".join(run.label for run in runs)


def _header(runs: Sequence[Reported]) -> Markup:
    if len(runs) == 1:
        title, lead = runs[0].label, runs[0].scenario.description
    else:
        title, lead = f"{len(runs)} sips compared", _title(runs)
    links = [("#numbers", "Key numbers"), ("#histories", "Histories")]
    links += [(f"#{run.anchor}", run.label) for run in runs]
    links += [("#trust", "How far to trust it"), ("#repeat", "Repeat it")]
    entries = [tag("li", tag("a", text, href=target)) for target, text in links]
    moving = tag("a", "Move through the sip", href="#explore")
    entries.insert(0, tag("li", moving, class_="scripted", hidden="hidden"))
    return tag(
        "header",
        tag("p", "drinksim report", class_="quiet"),
        tag("h1", title),
        tag("p", lead, class_="lead"),
        tag("nav", tag("ul", *entries), aria_label="Contents"),
    )


def _pictures(of_runs: Sequence[Markup]) -> Markup:
    title = tag("h2", "Six instants and the imprint", id="pictures")
    return tag("section", title, *of_runs, aria_labelledby="pictures")


def _trust(runs: Sequence[Reported]) -> Markup:
    limits = (
        lips_message(
            [run.scenario.muscle is not None for run in runs],
            [run.scenario.muscles is not None for run in runs],
        ),
        "The section is plane: what happens beside it is not seen, and forces are per mm of width.",
        "Skin parameters come from one aspiration experiment.",
        "Pressure at a point depends on the size of elements and on sharp corners of the neck; "
        "the mean over 0.5 mm is what should be compared.",
        "The pain thresholds were measured on legs with blunt probes, the tearing strain on "
        "excised skin from the back: they give the scale, not a limit for lips.",
    )
    return tag(
        "section",
        tag("h2", "How far to trust it", id="trust"),
        tag("ul", *(tag("li", text) for text in limits)),
        aria_labelledby="trust",
    )


def _repeat(runs: Sequence[Reported]) -> Markup:
    return tag(
        "section",
        tag("h2", "How to repeat it", id="repeat"),
        folded("Settings, motion and history of each run", *(_repeat_one(run) for run in runs)),
        aria_labelledby="repeat",
    )


def _repeat_one(run: Reported) -> Markup:
    version = run.solution.summary.get("version", "")
    files = repeating_files(run.solution)
    scenario_toml = files[SCENARIO_FILE].decode("utf-8")
    links = [
        tag("a", name, href=data_address(data, _media_type(name)), download=name)
        for name, data in {**files, HISTORY_FILE: history_bytes(run.solution)}.items()
    ]
    separated = [part for link in links for part in (link, " · ")][:-1]
    command = f"drinksim replay {SCENARIO_FILE} --out again"
    beside = "" if run.scenario.hand.reference is None else f", and the run's {REFERENCE_FOLDER}/,"
    return joined(
        tag("h3", run.label),
        tag("p", "Held in this page: ", *separated, class_="downloads"),
        tag(
            "p",
            f"With drinksim {version}, where the first {len(files)} files{beside} lie: ",
            tag("code", command),
        ),
        tag(
            "details",
            tag("summary", "The whole scenario: every setting, its unit and its source"),
            tag("pre", tag("code", scenario_toml), tabindex="0"),
        ),
    )


def _media_type(name: str) -> str:
    kinds = {".toml": "application/toml", ".csv": "text/csv", ".svg": "image/svg+xml"}
    return kinds.get(Path(name).suffix.lower(), "application/octet-stream")
