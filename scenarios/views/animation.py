"""A run to look at: a film (.mp4, .gif) or six frames (.png), beside the recording if wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image as Pillow

from geometry2d.foundation.output import check_writable, file_at_once
from geometry2d.foundation.progress import Progress, no_progress
from mocap.synthetic.recording_file import write_recording
from scenarios.results.solution import Solution
from scenarios.views.filmed import Image
from scenarios.views.panels import ModelPanel, RecordingPanel, colour_bars
from scenarios.views.run_view import RunView, RunViewError
from scenarios.views.strip import HistoryStrip
from scenarios.views.themes import THEMES

Array = NDArray[np.float64]

WIDTH, HEIGHT, DPI = 1280, 720, 100
FRAMES_PER_SECOND = 25.0
GIF_FRAMES_PER_SECOND = 12.5
GIF_SIZE = (800, 450)
SHEET_FRAMES = 6


def animate(
    run: Solution | Path,
    out: Path,
    *,
    beside_video: bool = False,
    over_video: bool = False,
    at: float | None = None,
    field: str = "von_mises_mpa",
    theme: str = next(iter(THEMES)),
    progress: Progress = no_progress,
) -> None:
    """Show a run directory as a film, as six frames or at one instant, by the ending of ``out``.

    Parameters
    ----------
    run
        a solution or its run directory.
    out
        a file that ends in ``.mp4`` (H.264), ``.gif`` or ``.png``.
    beside_video
        put the recording next to the model.
    over_video
        lay the model over the recording, where it was in it.
    at
        show this instant alone, relative time from 0 to 1; ``out`` is a ``.png`` then.
    field
        what tissue is coloured by, one of :data:`scenarios.views.shown.SHOWN`.
    theme
        one of :data:`scenarios.views.themes.THEMES`: light, or dark for a dim room.

    Raises
    ------
    DrinksimError
        If the run lacks what is to be shown, or the ending or the instant cannot be.
    """
    writers: dict[str, Callable[[RunView, Path, Progress], None]] = {
        ".mp4": _write_mp4,
        ".gif": _write_gif,
        ".png": _write_sheet,
    }
    ending = out.suffix.lower()
    if ending not in writers:
        raise RunViewError(f"--out {out} must end in one of {', '.join(writers)}")
    if at is not None and ending != ".png":
        raise RunViewError(f"--out {out} must end in .png: --at shows one instant")
    if at is not None and not 0.0 <= at <= 1.0:
        raise RunViewError(f"--at {at:g} must lie between 0, the start of the sip, and 1, its end")
    if theme not in THEMES:
        raise RunViewError(f"no theme {theme!r}: take one of {', '.join(THEMES)}")
    check_writable(out)
    run_view = RunView.of(
        run,
        field=field,
        beside_video=beside_video,
        over_video=over_video,
        theme=THEMES[theme],
    )
    with file_at_once(out) as partial:
        if at is None:
            writers[ending](run_view, partial, progress)
        else:
            _write_instant(run_view, at, partial)


def _write_instant(run_view: RunView, at: float, out: Path) -> None:
    start, end = run_view.solution.time_s[[0, -1]]
    times = np.array([start + at * (end - start)])
    (picture,) = film_frames(run_view, times, no_progress)
    Pillow.fromarray(picture).save(out)


def film_frames(run_view: RunView, times_s: Array, progress: Progress) -> Iterator[Image]:
    """Yield the pictures (720, 1280, 3), RGB, of a film at increasing times (k,), s."""
    stage = _Stage(run_view)
    for done, (time, picture) in enumerate(zip(times_s, run_view.pictures(times_s), strict=True)):
        progress(done / times_s.size, f"frame {done + 1} of {times_s.size}")
        yield stage.drawn(float(time), picture)


class _Stage:
    """The film's canvas: what stands still is drawn once, what moves is drawn on a copy of that."""

    def __init__(self, run_view: RunView) -> None:
        self._run_view = run_view
        theme = run_view.theme
        figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI, facecolor=theme.paper)
        # matplotlib's canvas has no annotations.
        self._figure, self._canvas = figure, cast(Any, FigureCanvasAgg(figure))
        filmed, over = run_view.recording is not None, run_view.over_video
        margin, top, height = 16, 52, 462
        width = (WIDTH - 3 * margin) // 2 if filmed and not over else WIDTH - 2 * margin
        at_right = (WIDTH - margin - width, top, width, height)
        self._recording = (
            RecordingPanel(
                figure,
                at_right if over else (margin, top, width, height),
                run_view,
                aspect=width / height,
                whole_window=over,
            )
            if filmed
            else None
        )
        label = "model over the recording" if over else "model"
        self._model = ModelPanel(
            figure, at_right, run_view, label=label, names=True, closer=True, faded=over
        )
        _heading(figure, run_view, margin)
        self._clock = figure.text(
            1 - margin / WIDTH, 1 - 34 / HEIGHT, "", size=15, ha="right", color=theme.ink
        )
        self._strip = HistoryStrip(
            figure, (78, 556, 760, 116), run_view.solution, size=11, theme=theme
        )
        bars = ((900, 562, 330, 12), (900, 640, 330, 12))
        colour_bars(figure, self._model.scene, run_view, bars, size=11)
        moving = [] if self._recording is None else list(self._recording.artists)
        moving += [*self._model.artists, *self._strip.artists, self._clock]
        self._moving: list[Artist] = moving
        for artist in moving:
            artist.set_animated(True)
        self._show(float(run_view.solution.time_s[0]), None)
        self._canvas.draw()
        self._still = self._canvas.copy_from_bbox(figure.bbox)

    def drawn(self, time_s: float, picture: Image | None) -> Image:
        """Return the whole picture at a time, s, with the recording's ``picture`` in its place."""
        self._show(time_s, picture)
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            self._figure.draw_artist(artist)
        return np.array(self._canvas.buffer_rgba())[..., :3]

    def _show(self, time_s: float, picture: Image | None) -> None:
        run_view = self._run_view
        self._model.show(run_view.solution.at(time_s), run_view.head.at(time_s))
        self._strip.show(time_s)
        self._clock.set_text(f"{time_s:.2f} s")
        if self._recording is not None and picture is not None:
            self._recording.show(picture)


def film_times(solution: Solution, frames_per_second: float) -> Array:
    """Return the times, s, of a film's frames: real time, from the first increment to the last."""
    start, end = solution.time_s[[0, -1]]
    count = int(np.floor((end - start) * frames_per_second)) + 1
    return np.asarray(start + np.arange(count) / frames_per_second, float)


def telling_times(solution: Solution, count: int) -> Array:
    """Return ``count`` times, s, from just before the first touch to just after the last."""
    touching = sum(solution[f"{lip}_lip_contact_mm"].values for lip in ("upper", "lower")) > 0
    times = solution.time_s[touching] if np.any(touching) else solution.time_s
    first, last = times[[0, -1]]
    reach = 0.06 * (last - first)
    low, high = solution.time_s[[0, -1]]
    return np.linspace(max(first - reach, low), min(last + reach, high), count)


def _write_mp4(run_view: RunView, out: Path, progress: Progress) -> None:
    times = film_times(run_view.solution, FRAMES_PER_SECOND)
    frames = film_frames(run_view, times, progress)
    write_recording(out, frames, times - times[0], crf=20.0, preset="veryfast")


def _write_gif(run_view: RunView, out: Path, progress: Progress) -> None:
    times = film_times(run_view.solution, GIF_FRAMES_PER_SECOND)
    pages = [
        Pillow.fromarray(frame).resize(GIF_SIZE, Pillow.Resampling.LANCZOS).quantize(256)
        for frame in film_frames(run_view, times, progress)
    ]
    shown_ms = round(1000 / GIF_FRAMES_PER_SECOND)
    pages[0].save(out, save_all=True, append_images=pages[1:], duration=shown_ms, loop=0)


def _write_sheet(run_view: RunView, out: Path, progress: Progress) -> None:
    """Write six frames in a row: recording, model, and histories with each instant under it."""
    beside = run_view.recording is not None
    margin, cell, top, caption = 14, 388, 64, 30
    film_high, model_high, strip_high = (292 if beside else 0), 340, 150
    model_top = top + caption + (film_high + margin if beside else 0)
    width = SHEET_FRAMES * (cell + margin) + margin
    strip_top = model_top + model_high + 64
    bars_top = strip_top + strip_high + 86
    height = bars_top + 62
    theme = run_view.theme
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor=theme.paper)
    canvas = cast(Any, FigureCanvasAgg(figure))
    _heading(figure, run_view, margin)
    times = telling_times(run_view.solution, SHEET_FRAMES)
    for column, (time, picture) in enumerate(zip(times, run_view.pictures(times), strict=True)):
        progress(column / SHEET_FRAMES, f"frame {column + 1} of {SHEET_FRAMES}")
        left = float(margin + column * (cell + margin))
        figure.text(
            (left + 2) / width,
            1 - (top + 18) / height,
            f"{column + 1}   {time:.2f} s",
            size=14,
            color=theme.ink,
        )
        if picture is not None:
            title = run_view.recording_title if column == 0 else ""
            place = (left, top + caption, cell, film_high)
            panel = RecordingPanel(figure, place, run_view, aspect=cell / model_high, label=title)
            panel.show(picture)
        model = ModelPanel(
            figure,
            (left, model_top, cell, model_high),
            run_view,
            label="model" if column == 0 else "",
            names=column == 0,
        )
        model.show(run_view.solution.at(float(time)), run_view.head.at(float(time)))
    left, right = 92.0, float(width - margin)
    strip = HistoryStrip(
        figure, (left, strip_top, right - left, strip_high), run_view.solution, size=13, theme=theme
    )
    strip.mark([float(time) for time in times], size=13)
    middle_px = margin + cell / 2
    s_per_px = (times[-1] - times[0]) / ((SHEET_FRAMES - 1) * (cell + margin))
    strip.axes.set_xlim(times[0] + s_per_px * (np.array([left, right]) - middle_px))
    bars = ((left, bars_top, 700, 14), (left + 900, bars_top, 700, 14))
    colour_bars(figure, model.scene, run_view, bars, size=13)
    canvas.draw()
    Pillow.fromarray(np.array(canvas.buffer_rgba())[..., :3]).save(out)


def _heading(figure: Figure, run_view: RunView, left_px: float) -> None:
    """Write the scenario's name and, smaller, how its run ended if it did not finish."""
    width, height = figure.get_size_inches() * figure.dpi
    name = figure.text(
        left_px / width,
        1 - 34 / height,
        run_view.name,
        size=16,
        weight="bold",
        color=run_view.theme.ink,
        parse_math=False,  # a name may hold dollars
    )
    if not run_view.solution.summary["finished"]:
        figure.text(
            (left_px + name.get_window_extent().width + 16) / width,
            1 - 34 / height,
            f"unfinished: stopped at {run_view.solution.time_s[-1]:.2f} s",
            size=12,
            color=run_view.theme.quiet,
        )
