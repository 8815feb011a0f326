"""The study of a press: files, picture and messages."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from fem2d.materials.library import configuration_cards
from fem2d.solvers.static import StaticResult
from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.studies.files import StudyResult, write_summary, write_table
from scenarios.studies.imprint import Imprint, imprint_of
from scenarios.studies.press import Press, PressOptions, force_n


def press_study(
    configuration: str,
    out: Path,
    options: PressOptions | None = None,
    *,
    progress: Progress = no_progress,
) -> StudyResult:
    """Press a neck into a lip; write ``press.json``, ``imprint.csv``, ``press.png``, a summary.

    Parameters
    ----------
    configuration
        A library name or a TOML file with one table a layer: the first becomes the dermis, the
        last everything below it.
    out
        Directory for the results, written whole or not at all.
    options
        Force, neck and sizes; the defaults if absent.
    progress
        Told how far it is.

    Raises
    ------
    MaterialError, PressError, OutputError
        If configuration, options or directory cannot be used, or the lip cannot carry the force.
    """
    chosen = options or PressOptions()
    cards = configuration_cards(configuration)
    with directory_at_once(out) as folder:
        press = Press({name: card.material for name, card in cards.items()}, chosen)
        result = press.pressed(progress=progress)
        imprint = imprint_of(press, result)
        text = json.dumps(_table(press, result, imprint), indent=2, ensure_ascii=False)
        (folder / "press.json").write_text(text + "\n", encoding="utf-8")
        write_table(
            folder / "imprint.csv",
            ("neck_arc_mm", "pressure_kpa"),
            list(zip(imprint.arc_mm.tolist(), imprint.pressure_kpa.tolist(), strict=True)),
        )
        _plot(folder / "press.png", configuration, press, result, imprint)
        messages = _messages(press, result, imprint)
        write_summary(
            folder,
            {
                "configuration": configuration,
                "layers": {name: dict(card.parameters) for name, card in cards.items()},
                "options": dataclasses.asdict(chosen),
                "elements": int(press.body.mesh.t.shape[1]),
                "remarks": messages,
            },
        )
    return StudyResult(out, messages)


def _table(press: Press, result: StaticResult, imprint: Imprint) -> dict[str, Any]:
    """Return ``press.json``."""
    return {
        "force_n": force_n(result),
        "indentation_mm": press.indentation_mm(result),
        "contact_mm": imprint.contact_mm,
        "crests_touched": list(imprint.crests),
        "roots_touched": list(imprint.roots),
        "stretches_touched": list(imprint.touched),
        "contact_from_opening_mm": list(imprint.depth_mm),
        "thread_ends_mm": imprint.thread_end_mm,
        "largest_pressure_kpa": float(imprint.pressure_kpa.max()),
    }


def _messages(press: Press, result: StaticResult, imprint: Imprint) -> tuple[str, ...]:
    return (
        f"{force_n(result):.4f} N at {press.indentation_mm(result):.2f} mm: "
        f"{imprint.contact_mm:.2f} mm of lip touch, from {imprint.depth_mm[0]:.1f} to "
        f"{imprint.depth_mm[1]:.1f} mm below the opening (the thread ends at "
        f"{imprint.thread_end_mm:.1f} mm)",
        "touched: " + ", ".join(imprint.touched),
        "floors of roots touched: " + (", ".join(imprint.roots) or "none"),
    )


def _plot(path: Path, name: str, press: Press, result: StaticResult, imprint: Imprint) -> None:
    from scenarios.studies.plots import COLOURS, blank_figure, draw_field, finish, labelled

    fields = press.body.fields(result.displacement)
    strain = np.average(np.abs(fields.log_strain).max(axis=-1), axis=1, weights=fields.volume)
    figure = blank_figure(10.0, 5.2)
    axes = labelled(figure.subplots(), "mm", "mm")
    colours = draw_field(axes, press.body, result.displacement, strain)
    placement = result.load.placement
    wall = placement.apply(press.neck.lower_wall.sampled(0.05))
    axes.fill(wall[:, 0], wall[:, 1], facecolor="0.85", edgecolor="0.35", linewidth=0.8)
    touched = placement.apply(press.neck.lower_wall.point_at(imprint.arc_mm)[0])
    axes.plot(touched[:, 0], touched[:, 1], ".", color="#d62728", markersize=4, label="contact")
    axes.legend(frameon=False, loc="lower right")
    lip = press.body.nodes[:, 0] + result.displacement[:, 0]
    axes.set_xlim(lip.min() - 1.0, lip.max() + 1.0)
    axes.set_ylim(-0.3, press.options.lip_height_mm + 3.0)
    figure.colorbar(colours, ax=axes, label="largest principal log strain, absolute", shrink=0.8)
    axes.set_title(
        f"{name}: {press.options.neck} neck, {force_n(result):.3f} N, "
        f"{press.indentation_mm(result):.2f} mm deep, {imprint.contact_mm:.1f} mm in contact",
        fontsize=10,
        color=COLOURS[0],
    )
    finish(figure, path)
