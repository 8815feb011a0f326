"""A report: one page that holds all of a run, or of several beside each other.

The page is a single file that loads nothing: pictures are embedded, there is no script. What comes
from files (names, descriptions, settings) is escaped by :mod:`scenarios.views.page.hypertext`.
"""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, PowerNorm
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import check_writable, file_at_once
from geometry2d.foundation.progress import Progress
from geometry2d.neck import NeckSection
from scenarios.results.messages import felt_message, passive_message, verdict_message
from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution, loaded
from scenarios.results.texts import history_bytes, motion_bytes, scenario_bytes
from scenarios.results.verdict import FAILURE, PAIN, Threshold, Verdict
from scenarios.settings.layers import values_by_path
from scenarios.settings.scenario import Scenario
from scenarios.views.page.figures import (
    Embedded,
    InstantPicture,
    RunCurve,
    curves,
    gradient,
    imprint_figure,
    line_style,
    snapshots,
)
from scenarios.views.page.hypertext import Markup, joined, page, tag
from scenarios.views.page.style import STYLE
from scenarios.views.plots import imprint
from scenarios.views.run_view import RunView
from scenarios.views.scene import PRESSURE_COLOURS, upper_limit

Array = NDArray[np.float64]

ABSENT = "–"
MINUS = "−"
KILO = 1000


class ReportError(DrinksimError):
    """These runs cannot be reported together, or not there."""


@dataclass(frozen=True)
class Reported:
    """One run of a report: what it is called there, and what is shown of it."""

    label: str
    anchor: str
    run_view: RunView
    neck: NeckSection
    verdict: Verdict

    @property
    def solution(self) -> Solution:
        """The run's solution."""
        return self.run_view.solution

    @property
    def scenario(self) -> Scenario:
        """What was replayed."""
        return self.solution.scenario

    @property
    def relative_time(self) -> Array:
        """(k,) 0…1."""
        return self.solution["relative_time"].values

    def peak(self, name: str) -> float:
        """Return the value of an output that is farthest from zero."""
        values = self.solution[name].values
        return float(values[np.abs(values).argmax()])

    def force(self, axis: str) -> Array:
        """Return the force of both lips on the neck along ``axis``, x or y: (k,) N per mm width."""
        both = sum(self.solution[f"{lip}_lip_force_{axis}_n"].values for lip in LIPS)
        return np.asarray(both) / self.scenario.numerics.thickness_mm

    @property
    def touched_s(self) -> float:
        """How long either lip touches the neck, s."""
        touching = sum(self.solution[f"{lip}_lip_contact_mm"].values for lip in LIPS) > 0
        return float(np.trapezoid(np.asarray(touching, float), self.solution.time_s))

    def most_pressed(self, lip: str) -> str:
        """Return what is most pressed by a lip: the rim, a crest of the thread."""
        arc, pressure = imprint(self.solution, lip)
        highest = pressure.max(axis=0)
        if highest.max() <= 0:
            return "nothing"
        place = arc[highest.argmax()]
        stretches = getattr(self.neck, f"{lip}_stretches")
        names = (name for name, (start, end) in stretches.items() if start <= place <= end)
        return next(names, "bore").replace("_", " ")


def write_report(
    runs: Sequence[Solution | Path],
    out: Path,
    *,
    progress: Progress = lambda share, text: None,
) -> None:
    """Write one self-contained page about one solution, or comparing several.

    Parameters
    ----------
    runs
        solutions or their run directories, each once.
    out
        the page, ending in ``.html``.

    Raises
    ------
    DrinksimError
        If a run lacks what is to be shown, if one is given twice or if the ending is another.
    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise ReportError(f"--out {out} must end in .html")
    check_writable(out)
    reported = _read(runs)
    highest = upper_limit(
        float(imprint(run.solution, lip)[1].max()) for run in reported for lip in LIPS
    )
    sections: list[Markup] = [_summary(reported), _key_numbers(reported), _histories(reported)]
    for index, run in enumerate(reported):

        def say(share: float, text: str, *, done: int = index, label: str = run.label) -> None:
            progress((done + share) / len(reported), f"{label}, {text}")

        sections.append(_one_run(run, highest, say))
    sections += [_trust(reported), _repeat(reported)]
    text = page(_title(reported), STYLE, joined(_header(reported), tag("main", *sections)))
    with file_at_once(out) as partial:
        partial.write_text(text, encoding="utf-8")


def _read(runs: Sequence[Solution | Path]) -> list[Reported]:
    """Return what is reported of each run, coloured alike: only that can be compared."""
    if not runs:
        raise ReportError("no run directory given: name one or several")
    solutions = [loaded(run) for run in runs]
    _refuse_doubles(solutions)
    views = [_view_of(solution) for solution in solutions]
    limits = max(view.limits[0] for view in views), max(view.limits[1] for view in views)
    names = Counter(solution.scenario.name for solution in solutions)
    return [
        Reported(
            label=_label(solution, number, alone=names[solution.scenario.name] == 1),
            anchor=f"run-{number}",
            run_view=replace(view, limits=limits),
            neck=solution.scenario.package.section(),
            verdict=Verdict.of(solution.summary),
        )
        for number, (solution, view) in enumerate(zip(solutions, views, strict=True), start=1)
    ]


def _refuse_doubles(solutions: Sequence[Solution]) -> None:
    """Refuse a run directory or a solution that is given twice."""
    which = [id(s) if s.folder is None else s.folder.resolve() for s in solutions]
    for solution, same in zip(solutions, which, strict=True):
        if which.count(same) > 1:
            named = solution.folder or f"{solution!r}"
            raise ReportError(f"{named} is given more than once: name every run once")


def _label(solution: Solution, number: int, *, alone: bool) -> str:
    name = solution.scenario.name
    return name if alone else f"{name} ({solution.folder or number})"


def _view_of(solution: Solution) -> RunView:
    """Return the view of a solution, with the recording wherever its file is still there."""
    recording = solution.scenario.recording
    there = recording is not None and all(
        Path(file).is_file() for file in (recording.video, recording.markers)
    )
    return RunView.of(solution, field="von_mises_mpa", beside_video=there)


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
    return tag(
        "header",
        tag("p", "drinksim report", class_="quiet"),
        tag("h1", title),
        tag("p", lead, class_="lead"),
        tag("nav", tag("ul", *entries), aria_label="Contents"),
    )


def _summary(runs: Sequence[Reported]) -> Markup:
    cards = []
    for run in runs:
        parts = [
            tag("h3", run.label),
            tag("p", verdict_message(run.verdict)),
            tag("p", felt_message(run.solution.summary)),
        ]
        if not run.solution.summary["finished"]:
            said = f"The run is not complete: {run.solution.summary['sentence']}"
            parts.insert(1, tag("p", said, class_="warning"))
        parts += [
            _gauge("contact pressure", run.verdict.pressure_kpa, PAIN, 600.0, "pain begins"),
            _gauge("largest log strain", run.verdict.log_strain, FAILURE, 0.6, "skin tears"),
        ]
        cards.append(tag("article", *parts, class_="verdict"))
    limits = (
        "The model is a plane section of passive lips; its pressures compare openings, they are "
        f"not yet a person's. Pain: {PAIN.measured} ({PAIN.source}); lips may feel it "
        f"earlier. Tearing: {FAILURE.measured} "
        f"({FAILURE.source})."
    )
    return tag(
        "section",
        tag("h2", "In a sentence", id="sentence"),
        tag("div", *cards, class_="verdicts"),
        tag("p", limits, class_="quiet"),
        aria_labelledby="sentence",
    )


def _gauge(title: str, value: float, threshold: Threshold, end: float, meaning: str) -> Markup:
    """Return a bar from 0 to ``end`` with the value on it, and where the threshold begins."""

    def number(x: float) -> str:
        return f"{x:.0f} {threshold.unit}" if threshold.unit else f"{x:.2f}"

    low, high = 100 * threshold.low / end, 100 * threshold.high / end
    beyond = 100.0 if threshold.low == threshold.high else high
    said = f"{title} {number(value)}; {meaning} at {number(threshold.low)}"
    return tag(
        "div",
        tag(
            "div",
            tag("span", title, " ", tag("strong", number(value))),
            tag("span", f"{meaning}: {_range(threshold, number)}", class_="quiet"),
            class_="title",
        ),
        tag(
            "div",
            tag("span", class_="range", style=f"left:{low:.1f}%;width:{beyond - low:.1f}%"),
            tag("span", class_="value", style=f"width:{min(100 * value / end, 100.0):.1f}%"),
            class_="track",
            role="img",
            aria_label=said,
        ),
        class_="gauge",
    )


def _range(threshold: Threshold, number: Callable[[float], str]) -> str:
    if threshold.low == threshold.high:
        return number(threshold.low)
    return f"{threshold.low:.0f}–{number(threshold.high)}"


@dataclass(frozen=True)
class Row:
    """A line of the table: what, its unit, and how a run's value is written."""

    title: str
    unit: str
    value: Callable[[Reported], str]


def _summed(key: str, pattern: str = "{:.0f}", factor: float = 1.0) -> Callable[[Reported], str]:
    """Return how a number of summary.json is written, whatever is found there."""

    def written(run: Reported) -> str:
        found: Any = run.solution.summary.get(key)
        if isinstance(found, bool) or not isinstance(found, int | float):
            return ABSENT if found is None else str(found)
        return pattern.format(factor * found).replace("-", MINUS)

    return written


def _energy_share(run: Reported) -> str:
    summary = run.solution.summary
    try:
        kinetic, strain = (
            float(summary[f"largest_{kind}_energy_nmm"]) for kind in ("kinetic", "strain")
        )
        return f"{100 * kinetic / strain:.2g}"
    except (KeyError, TypeError, ValueError, ZeroDivisionError):
        return ABSENT


def _neck_name(run: Reported) -> str:
    package = run.scenario.package
    return package.neck if package.outline is None else Path(package.outline).name


def _largest_force(run: Reported) -> str:
    return f"{1e3 * np.hypot(run.force('x'), run.force('y')).max():.1f}"


def _both_lips(title: str, unit: str, name: str, pattern: str) -> list[Row]:
    return [
        Row(f"{title}, {lip} lip", unit, _summed(name.format(lip=lip), pattern)) for lip in LIPS
    ]


ROWS: tuple[tuple[str, Sequence[Row]], ...] = (
    (
        "Contact",
        [
            *_both_lips(
                "highest pressure over 0.5 mm of lip", "kPa", "{lip}_lip_window_kpa", "{:.1f}"
            ),
            *_both_lips(
                "highest mean of two surface elements", "kPa", "{lip}_lip_pressure_kpa", "{:.1f}"
            ),
            *_both_lips("longest contact", "mm", "{lip}_lip_contact_mm", "{:.2f}"),
            *_both_lips(
                "highest pressure over 1.5 mm of lip", "kPa", "{lip}_lip_window_1_5mm_kpa", "{:.1f}"
            ),
            *_both_lips(
                "highest mean pressure where touched", "kPa", "{lip}_lip_mean_kpa", "{:.1f}"
            ),
            *_both_lips(
                "how much crests stand out, 0 to 1", "", "{lip}_lip_crest_contrast", "{:.2f}"
            ),
            *_both_lips("impulse", "N s", "{lip}_lip_impulse_ns", "{:.3f}"),
            Row("most pressed, upper wall", "", lambda run: run.most_pressed("upper")),
            Row("most pressed, lower wall", "", lambda run: run.most_pressed("lower")),
            Row("contact lasts", "s", lambda run: f"{run.touched_s:.2f}"),
            Row("largest force on the hand, per mm of width", "mN/mm", _largest_force),
        ],
    ),
    (
        "Dermis",
        [
            Row("smallest log strain", "", _summed("dermis_min_log_strain", "{:.3f}")),
            Row("largest log strain", "", _summed("dermis_max_log_strain", "{:.3f}")),
            Row("largest von Mises stress", "kPa", _summed("dermis_max_mises_kpa", "{:.1f}")),
        ],
    ),
    (
        "Model",
        [
            Row("neck", "", _neck_name),
            Row("skin", "", lambda run: run.scenario.skin.configuration),
            Row("friction on the package", "", lambda run: f"{run.scenario.contact.friction:g}"),
            Row("plane", "", lambda run: run.scenario.numerics.plane),
            Row("resolution", "", lambda run: run.scenario.numerics.resolution),
            Row("thickness", "mm", lambda run: f"{run.scenario.numerics.thickness_mm:g}"),
            Row("elements", "", _summed("elements", "{:,.0f}")),
            Row("nodes", "", _summed("nodes", "{:,.0f}")),
        ],
    ),
    (
        "Solver",
        [
            Row("increments", "", _summed("increments")),
            Row("Newton iterations", "", _summed("newton_iterations")),
            Row("cutbacks", "", _summed("cutbacks")),
            Row(
                "deepest penetration, neck",
                "µm",
                _summed("largest_penetration_neck_mm", "{:.1f}", KILO),
            ),
            Row(
                "deepest penetration, teeth",
                "µm",
                _summed("largest_penetration_teeth_mm", "{:.1f}", KILO),
            ),
            Row(
                "deepest penetration between nodes",
                "µm",
                _summed("largest_penetration_between_nodes_mm", "{:.1f}", KILO),
            ),
            Row(
                "deepest penetration, lips into each other or themselves",
                "µm",
                _summed("largest_penetration_lips_mm", "{:.1f}", KILO),
            ),
            Row(
                "largest unbalanced force, share of all forces",
                "",
                _summed("largest_unbalanced_force_share", "{:.1e}"),
            ),
            Row("largest kinetic over largest strain energy", "%", _energy_share),
            Row("time it took", "s", _summed("wall_s")),
            Row("drinksim", "", _summed("version")),
        ],
    ),
)


def _key_numbers(runs: Sequence[Reported]) -> Markup:
    said = (
        "Extremes over the whole sip. The mean of two surface elements is the thesis' measure; it "
        "depends on their size, the mean over 0.5 mm is made not to."
    )
    head = tag(
        "tr",
        tag("th", "quantity", scope="col"),
        tag("th", "unit", scope="col", class_="unit"),
        *(tag("th", run.label, scope="col") for run in runs),
    )
    groups = []
    for name, rows in ROWS:
        lines = [tag("tr", tag("th", name, scope="rowgroup", colspan=str(2 + len(runs))))]
        lines += [
            tag(
                "tr",
                tag("th", row.title, scope="row"),
                tag("td", row.unit, class_="unit"),
                *(tag("td", row.value(run)) for run in runs),
            )
            for row in rows
        ]
        groups.append(tag("tbody", *lines))
    table = tag(
        "table",
        tag("thead", head),
        *groups,
    )
    scrolled = tag(
        "div", table, class_="wide", tabindex="0", role="region", aria_label="Key numbers"
    )
    return tag(
        "section",
        tag("h2", "Key numbers", id="numbers"),
        tag("p", said, class_="quiet"),
        scrolled,
        _differences(runs) if len(runs) > 1 else Markup(),
        aria_labelledby="numbers",
    )


NOT_COMPARED = ("name", "description", "recording", "motion")
"""What a run is called and what it was made from; everything else of a scenario is a setting."""


def _differences(runs: Sequence[Reported]) -> Markup:
    """Return a table of the settings that are not the same in all runs, to be opened."""
    lines = []
    for name, values in _settings_by_run(runs).items():
        if len(set(values)) > 1:
            cells = (tag("td", value) for value in values)
            lines.append(tag("tr", tag("th", tag("code", name), scope="row"), *cells))
    if not lines:
        return tag("p", "The runs have the same settings and differ in their motion only.")
    head = [tag("th", text, scope="col") for text in ("setting", *(run.label for run in runs))]
    table = tag("table", tag("thead", tag("tr", *head)), tag("tbody", *lines))
    return tag(
        "details",
        tag("summary", f"Settings that differ between the runs: {len(lines)}"),
        tag("div", table, class_="wide", tabindex="0", role="region", aria_label="Differences"),
    )


def _settings_by_run(runs: Sequence[Reported]) -> dict[str, list[str]]:
    """Return every setting by its path: its value in each run."""
    settings = [values_by_path(run.scenario) for run in runs]
    paths = dict.fromkeys(path for values in settings for path in values)
    return {
        path: [str(values.get(path, ABSENT)) for values in settings]
        for path in paths
        if path.split(".")[0] not in NOT_COMPARED
    }


FIGURES = (
    ("dermis_min_log_strain", "Smallest principal log strain in the dermis", "log strain"),
    ("dermis_max_log_strain", "Largest principal log strain in the dermis", "log strain"),
    ("dermis_max_mises_kpa", "Largest von Mises stress in the dermis", "kPa"),
    ("upper_lip_pressure_kpa", "Contact pressure on the upper lip", "kPa"),
    ("lower_lip_pressure_kpa", "Contact pressure on the lower lip", "kPa"),
    ("upper_lip_contact_mm", "Length of contact, upper lip", "mm"),
    ("lower_lip_contact_mm", "Length of contact, lower lip", "mm"),
)
"""Output, title and unit; the first five are the thesis' Figures 4.13 to 4.17."""
FORCES = (("x", "Force on the hand, forward"), ("y", "Force on the hand, up"))


def _histories(runs: Sequence[Reported]) -> Markup:
    drawn = [
        _history(runs, title, unit, [run.solution[name].values for run in runs])
        for name, title, unit in FIGURES
    ]
    drawn += [
        _history(runs, title, "mN per mm of width", [1e3 * run.force(axis) for run in runs])
        for axis, title in FORCES
    ]
    said = (
        "Relative time runs from 0 at the start of the replay to 1. Contact pressure is the "
        "mean over the two most pressed surface elements, as in the thesis. The force on the hand "
        "is what both lips do to the neck, in the directions of the head."
    )
    return tag(
        "section",
        tag("h2", "Histories", id="histories"),
        tag("p", said),
        _key(runs) if len(runs) > 1 else Markup(),
        tag("div", *drawn, class_="curves"),
        aria_labelledby="histories",
    )


def _history(runs: Sequence[Reported], title: str, unit: str, values: Sequence[Array]) -> Markup:
    peaks = [
        f"{run.label} {'peaks at' if line.any() else 'stays at'} {line[np.abs(line).argmax()]:.3g}"
        for run, line in zip(runs, values, strict=True)
    ]
    picture = curves(
        [RunCurve(run.relative_time, line) for run, line in zip(runs, values, strict=True)],
        label=unit,
        shows=f"{title}, {unit}, against relative time: {'; '.join(peaks)}.",
    )
    return tag("figure", tag("figcaption", title), _image(picture))


def _key(runs: Sequence[Reported]) -> Markup:
    """Return which line is which run."""
    entries = []
    for index, run in enumerate(runs):
        colour, dashes = line_style(index)
        line = tag(
            "line",
            x1="1", y1="6", x2="43", y2="6", stroke=colour, stroke_width="2.6",
            stroke_dasharray=" ".join(f"{2.6 * length:g}" for length in dashes) or "none",
        )  # fmt: skip
        swatch = tag("svg", line, width="44", height="12", aria_hidden="true")
        entries.append(tag("li", swatch, run.label))
    return tag("ul", *entries, class_="key", aria_label="Lines of the figures")


def _one_run(run: Reported, highest_kpa: float, say: Callable[[float, str], None]) -> Markup:
    instants = list(snapshots(run.run_view, say))
    parts = [
        tag("h2", run.label, id=run.anchor),
        tag("p", run.scenario.description),
        tag("h3", "The sip in six instants"),
        _about_the_pictures(run),
        tag("ol", *(_instant(n, one) for n, one in enumerate(instants, 1)), class_="sequence"),
        _colour_bars(run.run_view),
        tag("h3", "The imprint on the neck"),
        _imprint(run, highest_kpa),
    ]
    return tag("section", *parts, class_="run", aria_labelledby=run.anchor)


def _about_the_pictures(run: Reported) -> Markup:
    model = (
        "the section of the lips (dermis coloured by its von Mises stress), teeth, jaws and the "
        "neck that presses them, in the same world; the bar is 10 mm long."
    )
    if run.run_view.recording is None:
        why = "has no recording" if run.scenario.recording is None else "lost its recording's file"
        return tag("p", f"This run {why}. Shown is {model}")
    kind = "the recording"
    if run.run_view.rendered:
        kind = "the recording, which is rendered by a virtual camera and shows no real person"
    return tag("p", f"Above, {kind}; below, {model}")


def _instant(number: int, instant: InstantPicture) -> Markup:
    pictures = [_image(picture) for picture in (instant.recording, instant.model) if picture]
    what = f" · {instant.recording.shows.split(',')[0]} and model" if instant.recording else ""
    caption = tag("figcaption", tag("strong", str(number)), f" · {instant.time_s:.2f} s{what}")
    return tag("li", tag("figure", *pictures, caption))


def _colour_bars(run_view: RunView) -> Markup:
    shown = run_view.shown
    bars = (
        (ScalarMappable(PowerNorm(0.5, 0.0, run_view.limits[0]), shown.colours),
         f"{shown.title}, {shown.unit}", run_view.limits[0]),
        (ScalarMappable(Normalize(0.0, run_view.limits[1]), PRESSURE_COLOURS),
         "contact pressure on the skin, kPa", run_view.limits[1]),
    )  # fmt: skip
    drawn = []
    for mappable, title, highest in bars:
        ticks = [tag("span", text) for text in ("0", f"{highest / 2:g}", f"≥ {highest:g}")]
        strip = tag("span", class_="colours", style=f"background:{gradient(mappable)}")
        drawn.append(tag("div", title, strip, tag("span", *ticks, class_="ticks")))
    return tag("div", *drawn, class_="bars")


def _imprint(run: Reported, highest_kpa: float) -> Markup:
    shows = "; ".join(
        f"the {lip} lip presses most at {run.most_pressed(lip)}"
        for lip in LIPS
        if run.most_pressed(lip) != "nothing"
    )
    over_time, contour = imprint_figure(
        run.run_view, run.neck, highest_kpa=highest_kpa, shows=f"{shows or 'nothing touches'}."
    )
    return tag(
        "div",
        tag("figure", tag("figcaption", "Pressure along the neck's contour, in time"),
            _image(over_time)),
        tag("figure", tag("figcaption", "Its highest value at each point, standing off the contour "
                          "of the wall (opening on the left)"), _image(contour)),
        class_="imprint",
    )  # fmt: skip


def _trust(runs: Sequence[Reported]) -> Markup:
    limits = (
        passive_message([run.scenario.muscle is not None for run in runs]),
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
        *(_repeat_one(run) for run in runs),
        aria_labelledby="repeat",
    )


def _repeat_one(run: Reported) -> Markup:
    version = run.solution.summary.get("version", "")
    scenario_toml = scenario_bytes(run.solution)
    held = (
        ("scenario.toml", scenario_toml, "application/toml"),
        ("motion.csv", motion_bytes(run.solution), "text/csv"),
        ("history.csv", history_bytes(run.solution), "text/csv"),
    )
    links = [
        tag("a", name, href=_data_address(data, kind), download=name)
        for name, data, kind in held
        if data is not None
    ]
    separated = [part for link in links for part in (link, " · ")][:-1]
    command = "drinksim replay scenario.toml --motion motion.csv --out again"
    return joined(
        tag("h3", run.label),
        tag("p", "Held in this page: ", *separated, class_="downloads"),
        tag("p", f"With drinksim {version} and the first two files: ", tag("code", command)),
        tag(
            "details",
            tag("summary", "The whole scenario: every setting, its unit and its source"),
            tag("pre", tag("code", scenario_toml.decode("utf-8")), tabindex="0"),
        ),
    )


def _image(picture: Embedded) -> Markup:
    return tag("img", src=_data_address(picture.data, picture.media_type), alt=picture.shows)


def _data_address(data: bytes, media_type: str) -> str:
    return f"data:{media_type};base64,{base64.b64encode(data).decode('ascii')}"
