"""What a report shows of one run: six instants, and the imprint on the neck."""

from __future__ import annotations

from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, PowerNorm

from geometry2d.foundation.progress import Progress
from scenarios.results.quantities import LIPS
from scenarios.views.colours import PRESSURE_COLOURS
from scenarios.views.page.embedded import image
from scenarios.views.page.figures import InstantPicture, gradient, imprint_figure, snapshots
from scenarios.views.page.hypertext import Markup, folded, tag
from scenarios.views.page.reported import Reported
from scenarios.views.run_view import RunView


def run_section(run: Reported, highest_kpa: float, progress: Progress) -> Markup:
    """Return what is shown of one run, to be folded.

    Parameters
    ----------
    run
        What is reported of it.
    highest_kpa
        End of the scale of its imprint, the same for all runs of a page.
    progress
        Is told the share of its pictures that are ready.
    """
    instants = list(snapshots(run.run_view, progress))
    parts = [
        tag("p", run.scenario.description),
        tag("h3", "The sip in six instants"),
        _about_the_pictures(run),
        tag("ol", *(_instant(n, one) for n, one in enumerate(instants, 1)), class_="sequence"),
        _colour_bars(run.run_view),
        tag("h3", "The imprint on the neck"),
        _imprint(run, highest_kpa),
    ]
    return tag("div", folded(run.label, *parts), class_="run", id=run.anchor)


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
    pictures = [image(picture) for picture in (instant.recording, instant.model) if picture]
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
    strips = []
    for mappable, title, highest in bars:
        ticks = [tag("span", text) for text in ("0", f"{highest / 2:g}", f"≥ {highest:g}")]
        strip = tag("span", class_="colours", style=f"background:{gradient(mappable)}")
        strips.append(tag("div", title, strip, tag("span", *ticks, class_="ticks")))
    return tag("div", *strips, class_="bars")


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
            image(over_time)),
        tag("figure", tag("figcaption", "Its highest value at each point, standing off the contour "
                          "of the wall (opening on the left)"), image(contour)),
        class_="imprint",
    )  # fmt: skip
