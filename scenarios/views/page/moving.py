"""What the moving part of a page holds of each run: section, fields, contact, histories, film.

Values are in the units that the page shows, rounded to the decimals that it shows.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import Colormap
from numpy.typing import NDArray
from PIL import Image as Pillow

from geometry2d.neck import NeckSection
from scenarios.messages.verdict import FAILURE, PAIN
from scenarios.results.increment import Integers, LipContact, SectionModel
from scenarios.results.quantities import HISTORY, IN_NECK_FRAME, JAW_HINGE, WITH_JAW
from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Solution
from scenarios.views.colours import DIFFERENCE_COLOURS, PRESSURE_COLOURS, pressure_colours
from scenarios.views.filmed import Crop
from scenarios.views.limits import colour_reach, touched_points, upper_limit
from scenarios.views.page.embedded import data_address
from scenarios.views.page.packed import packed
from scenarios.views.page.reported import Reported
from scenarios.views.plots import IMPRINT_STEP_MM, imprint
from scenarios.views.run_view import RunView
from scenarios.views.scene import boundary_loops
from scenarios.views.shown import SHOWN
from scenarios.views.themes import THEMES

Array = NDArray[np.float64]

LENGTH_DECIMALS = 3
PLACE_DECIMALS = 2
CONTACT = (
    ("pressure_mpa", "pressure_kpa", 1e3, 1),
    ("shear_mpa", "shear_kpa", 1e3, 1),
    ("gap_mm", "gap_mm", 1.0, LENGTH_DECIMALS),
    ("neck_arc_mm", "neck_arc_mm", 1.0, PLACE_DECIMALS),
)
"""A contact field, what the page calls it, factor to the unit shown, and decimals shown."""

DECIMALS = {"kPa": 1, "": 3}
"""Decimals of an element field, by the unit it is shown in."""

MOST_BYTES = 48_000_000
"""Of displacements and fields of a run, unpacked: what a telephone still opens at once."""

COLOURS = 48
MARGIN_MM = 9.0
FILM_PX = (360, 300)
FILM_STEP_S = 0.08
FILM_QUALITY = 70
NOT_SHOWN = ("newton_iterations", "cutbacks")
TIMES = ("time_s", "relative_time")


def moving_page(runs: Sequence[Reported]) -> dict[str, Any]:
    """Return everything that the page's scripts read, as an object of JSON."""
    data = [_run(run) for run in runs]
    return {
        "runs": data,
        "fields": [_field(name, runs) for name in shown_fields(runs)],
        "pressure": {
            "title": "contact pressure",
            "unit": "kPa",
            "decimals": 1,
            "limit": upper_limit([run.run_view.largest[1] for run in runs]),
            "colours": _colours(PRESSURE_COLOURS),
            "colours_on_dark": _colours(pressure_colours(THEMES["dark"])),
        },
        "difference": _colours(DIFFERENCE_COLOURS),
        "quantities": {
            quantity.name: {"unit": quantity.unit, "meaning": quantity.meaning}
            for quantity in HISTORY
        },
        "pain": {"low": PAIN.low, "high": PAIN.high, "source": PAIN.source},
        "failure": {"low": FAILURE.low, "source": FAILURE.source},
    }


def _run(run: Reported) -> dict[str, Any]:
    solution, model = run.solution, run.solution.model
    kept = _kept(solution)
    return {
        "label": run.label,
        "increment": kept.tolist(),
        "time_s": _numbers(solution.time_s),
        "relative_time": _numbers(solution["relative_time"].values),
        "history": {
            quantity.name: _numbers(solution[quantity.name].values)
            for quantity in HISTORY
            if quantity.name not in NOT_SHOWN
        },
        "bands": _bands(run),
        "thickness_mm": solution.scenario.numerics.thickness_mm,
        **_section(model),
        **_states(solution, kept),
        "contact": {
            lip: _contact(model, lip, along, kept) for lip, along in solution.contact.items()
        },
        "placement": [
            [round(float(angle), 7), round(float(x), 5), round(float(y), 5)]
            for angle, (x, y) in zip(solution.angle_rad[kept], solution.shift_mm[kept], strict=True)
        ],
        "jaw": _jaw(solution, kept),
        "imprint": {lip: _imprint(solution, lip, run.neck) for lip in solution.contact},
        "window": _window(solution),
        "film": _film(run.run_view),
        "film_title": run.run_view.recording_title,
    }


def _bands(run: Reported) -> dict[str, list[list[float]]]:
    """Return between which values the recording leaves each history, where that is known."""
    bands = {q.name: run.band(q.name) for q in HISTORY if q.name not in (*NOT_SHOWN, *TIMES)}
    return {
        name: [_numbers(end) for end in band] for name, band in bands.items() if band is not None
    }


def _kept(solution: Solution) -> Integers:
    """Return the increments whose section the page holds: all, unless they are too many."""
    model, count = solution.model, solution.time_s.size
    size = 2 * count * (model.nodes.size + len(SHOWN) * len(model.triangles))
    step = int(np.ceil(size / MOST_BYTES))
    return np.unique([*range(0, count, step), count - 1])


def _section(model: SectionModel) -> dict[str, Any]:
    names = np.array(model.region_names)[model.region]
    loops = {
        name: [loop.tolist() for loop in boundary_loops(model.triangles[names == name])]
        for name in model.region_names
        if (names == name).any()
    }
    return {
        "nodes": packed(model.nodes, LENGTH_DECIMALS),
        "triangles": packed(model.triangles, 0),
        "region": model.region.tolist(),
        "region_names": list(model.region_names),
        "loops": loops,
        "outlines": {
            name: {"points": np.round(line, 3).tolist(), "moves": _mover(name)}
            for name, line in model.outlines.items()
            if name != JAW_HINGE
        },
    }


def _mover(outline: str) -> str:
    """Return with what an outline moves: the neck, the jaw, or nothing."""
    return "neck" if outline in IN_NECK_FRAME else "jaw" if outline in WITH_JAW else ""


def _jaw(solution: Solution, kept: Integers) -> list[list[float]] | None:
    """Return angle (rad) and shift (mm) of the jaw in each increment; None if it never moves."""
    if JAW_HINGE not in solution.model.outlines:
        return None
    jaws = [solution.snapshot(int(index)).jaw for index in kept]
    return [[jaw.angle_rad, *jaw.shift_mm] for jaw in jaws]


def _states(solution: Solution, kept: Integers) -> dict[str, Any]:
    moved = np.array([solution.fields.displacement(int(index)) for index in kept])
    return {
        "displacement": packed(moved, LENGTH_DECIMALS),
        "element": {
            name: packed(
                SHOWN[name].values(solution.fields.along(name)[kept]), DECIMALS[SHOWN[name].unit]
            )
            for name in solution.fields.names
        },
    }


def _contact(model: SectionModel, lip: str, along: LipContact, kept: Integers) -> dict[str, Any]:
    """Return the contact of a lip; its points lie between two nodes each, with a weight."""
    line = SkinLine(model, model.skin[lip], along.arc_mm)
    before, weight = line.between()
    return {
        "first": line.nodes[before].tolist(),
        "second": line.nodes[before + 1].tolist(),
        "weight": np.round(weight, 6).tolist(),
        "arc_mm": _numbers(along.arc_mm),
        "outward": line.outward,
        **{
            name: packed(along.fields[field][kept] * factor, decimals)
            for field, name, factor, decimals in CONTACT
        },
    }


def _imprint(solution: Solution, lip: str, neck: NeckSection) -> dict[str, Any]:
    arc, pressure = imprint(solution, lip)
    stretches: Mapping[str, tuple[float, float]] = getattr(neck, f"{lip}_stretches")
    return {
        "start_mm": float(arc[0]),
        "step_mm": IMPRINT_STEP_MM,
        "pressure_kpa": packed(pressure, 1),
        "stretches": {
            name.replace("_", " "): [round(start, 3), round(end, 3)]
            for name, (start, end) in stretches.items()
        },
    }


def _window(solution: Solution) -> list[float]:
    """Return left, bottom, right, top of where lips and neck touch, in the head frame, mm."""
    points = np.vstack(list(touched_points(solution).values()))
    low, high = points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM
    return [round(float(value), 2) for value in (*low, *high)]


def _film(view: RunView) -> list[dict[str, Any]]:
    """Return pictures of the recording around the mouth, with their times, s."""
    if view.recording is None:
        return []
    start, end = view.solution.time_s[[0, -1]]
    times = np.arange(start, end, FILM_STEP_S)
    return [
        {"time_s": round(float(time), 4), "picture": _address(view, picture)}
        for time, picture in zip(times, view.pictures(times), strict=True)
        if picture is not None
    ]


def _address(view: RunView, picture: NDArray[np.uint8]) -> str:
    rows, columns = picture.shape[:2]
    aspect = FILM_PX[0] / FILM_PX[1]
    crop = Crop.around(view.window_px(aspect), picture=(columns, rows), aspect=aspect)
    stream = io.BytesIO()
    Pillow.fromarray(crop.scaled(picture, FILM_PX)).save(stream, "JPEG", quality=FILM_QUALITY)
    return data_address(stream.getvalue(), "image/jpeg")


def shown_fields(runs: Sequence[Reported]) -> list[str]:
    """Return the fields of :data:`SHOWN` that all runs hold."""
    return [name for name in SHOWN if all(name in run.solution.fields.names for run in runs)]


def _field(name: str, runs: Sequence[Reported]) -> dict[str, Any]:
    shown = SHOWN[name]
    highest = max(colour_reach(run.solution, shown).largest[0] for run in runs)
    return {
        "name": name,
        "title": shown.title,
        "unit": shown.unit,
        "decimals": DECIMALS[shown.unit],
        "limit": upper_limit([highest]),
        "highest": highest,
        "centre": shown.centre,
        "whole": shown.whole,
        "colours": _colours(shown.colours),
    }


def _colours(colours: Colormap) -> list[str]:
    rgba = colours(np.linspace(0.0, 1.0, COLOURS))
    return [matplotlib.colors.to_hex(colour) for colour in rgba]


def _numbers(values: Array) -> list[float]:
    """Return values to nine significant digits, as history.csv holds them."""
    return [float(f"{value:.9g}") for value in values]
