"""Draw the pictures of the documentation.

Each is made by the command that its page names; figures of anatomy are drawn here.

    python -m benchmarks.pictures docs/pictures
    python -m benchmarks.pictures docs/pictures head muscles
    python -m benchmarks.pictures drafts --quick head a38-f

All of them take half an hour; ``head`` and ``muscles`` a second each. ``--quick`` draws sips from
the beginning of a coarse one, which is how continuous integration looks whether they are drawn.
``page`` needs Debian's chromium and the extra ``test``.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks import calibration_recovery, filming_drawings, newton_cost
from geometry2d.anatomy.head import head_section
from geometry2d.anatomy.muscles import muscle_regions
from geometry2d.views.draw import draw_head, draw_muscles
from scenarios.cli.main import main as drinksim

View = tuple[tuple[float, float], tuple[float, float]]
"""Limits of x and of y, mm."""

HEAD: View = ((-125.0, 130.0), (-160.0, 142.0))
LIPS: View = ((56.0, 124.0), (-113.0, -2.0))
MUSCLES: View = ((58.0, 130.0), (-113.0, -8.0))


def _axes(figure: Figure, place: tuple[int, int, int], view: View) -> Axes:
    axes = figure.add_subplot(*place)
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(*view[0])
    axes.set_ylim(*view[1])
    return axes


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def draw_head_and_lips(file: Path) -> None:
    """Draw the head section of an adult man, and its lips."""
    figure, head = _figure(10.0, 5.6), head_section()
    for number, view in enumerate((HEAD, LIPS), start=1):
        draw_head(_axes(figure, (1, 2, number), view), head)
    figure.savefig(file)


def draw_muscles_of_the_lips(file: Path) -> None:
    """Draw the muscles in the section of the lips."""
    figure, head = _figure(5.0, 7.0), head_section()
    axes = _axes(figure, (1, 1, 1), MUSCLES)
    draw_head(axes, head)
    draw_muscles(axes, muscle_regions(head).values())
    figure.savefig(file)


def typed(*commands: str, made: str) -> Callable[[Path], None]:
    """Return what types drinksim's commands with DIR for a folder, and keeps a file of it."""

    def draw(file: Path) -> None:
        with TemporaryDirectory() as folder:
            for command in commands:
                words = [word.replace("DIR", folder) for word in command.split()]
                if drinksim(words) != 0:
                    raise SystemExit(f"drinksim {command} failed")
            shutil.copyfile(Path(folder) / made, file)

    return draw


def recovery(file: Path) -> None:
    """Draw how well known parameters are recovered."""
    with TemporaryDirectory() as folder:
        calibration_recovery.main(Path(folder))
        shutil.copyfile(Path(folder) / "recovery.png", file)


def newton_cost_curve(file: Path) -> None:
    """Draw what a Newton iteration costs against the number of triangles."""
    newton_cost.main(["--plot", str(file)])


def sheet(scenario: str, how: str) -> Callable[[Path], None]:
    """Return what draws the contact sheet of a sip beside its recording, replayed like ``how``."""
    return typed(
        f"replay {scenario} --out DIR/run {how}",
        "animate DIR/run --out DIR/sheet.png --beside-video",
        made="sheet.png",
    )


def film(how: str) -> Callable[[Path], None]:
    """Return what draws the middle of a film beside its recording."""
    return typed(
        f"replay A38-F --out DIR/run {how}",
        "animate DIR/run --out DIR/film.png --at 0.5 --beside-video",
        made="film.png",
    )


def page(how: str) -> Callable[[Path], None]:
    """Return what draws the moving part of a page of two runs as a browser shows it."""

    def draw(file: Path) -> None:
        from playwright.sync_api import sync_playwright

        with TemporaryDirectory() as folder:
            html = Path(folder) / "page.html"
            runs = [f"{folder}/{name}" for name in ("A38-F", "DC-F")]
            for run in runs:
                drinksim(["replay", Path(run).name, "--out", run, *how.split()])
            drinksim(["report", *runs, "--out", str(html)])
            with sync_playwright() as driver:
                browser = driver.chromium.launch(
                    executable_path=shutil.which("chromium"), args=["--no-sandbox"]
                )
                tab = browser.new_page(viewport={"width": 1280, "height": 1700})
                tab.goto(html.as_uri())
                tab.locator("#explore[data-ready]").screenshot(path=str(file))
                browser.close()

    return draw


def press(configuration: str) -> Callable[[Path], None]:
    """Return what draws the neck pressed into a lip."""
    return typed(f"press {configuration} --force 0.3 --neck A38 --out DIR/p", made="p/press.png")


COARSE = "--resolution coarse"
BEGINNING = f"{COARSE} --set recording.end_s=1.05"

PICTURES: dict[str, Callable[[Path], None]] = {
    "head": draw_head_and_lips,
    "muscles": draw_muscles_of_the_lips,
    "a38-f": sheet("A38-F", COARSE),
    "dc-ae": sheet("DC-AE", COARSE),
    "film": film(COARSE),
    "page": page(COARSE),
    "skin-comparison": typed(
        "aspirate --thesis --search-kpa 101.3 --out DIR/a", made="a/comparison.png"
    ),
    "skin-mesh": typed("sensitivity L2-Ogden --of mesh --out DIR/s", made="s/mesh.png"),
    "skin-press-ogden": press("L2-Ogden"),
    "skin-press-goh": press("L2-GOH"),
    "calibration-recovery": recovery,
    "newton-cost": newton_cost_curve,
    "filming-setup": filming_drawings.draw_setup,
    "filming-places": filming_drawings.draw_places,
    "filming-dots": filming_drawings.draw_dots,
}

QUICK = PICTURES | {
    "a38-f": sheet("A38-F", BEGINNING),
    "dc-ae": sheet("DC-AE", BEGINNING),
    "film": film(BEGINNING),
    "page": page(BEGINNING),
}


def main(arguments: list[str]) -> None:
    """Draw the pictures that are named, or all, into a folder."""
    quick = "--quick" in arguments
    folder, *names = (word for word in arguments if word != "--quick")
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name in names or PICTURES:
        file = Path(folder) / f"{name}.png"
        (QUICK if quick else PICTURES)[name](file)
        print(file)


if __name__ == "__main__":
    main(sys.argv[1:])
