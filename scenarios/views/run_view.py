"""What a film or a contact sheet shows of a run, read once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidMotion
from mocap.motion.picture import PictureScale
from mocap.tracking.marker_file import read_markers
from scenarios.results.solution import Solution, loaded
from scenarios.settings.names import nearest
from scenarios.settings.scenario import Recording
from scenarios.views.filmed import Crop, Image, picture_scale, pictures_at
from scenarios.views.limits import colour_reach, touched_points
from scenarios.views.shown import SHOWN, Shown
from scenarios.views.themes import LIGHT, Theme

Array = NDArray[np.float64]

MARGIN_MM = (24.0, 21.0)
"""How far the view reaches beyond where skin and neck ever touch."""


class RunViewError(DrinksimError):
    """A run cannot be shown in the way that was asked for."""


@dataclass(frozen=True)
class Window:
    """A rectangle of the world, mm: left, bottom, width, height."""

    left: float
    bottom: float
    width: float
    height: float


@dataclass(frozen=True)
class RunView:
    """A run, how the head moved, the recording if it is shown, and what the colours mean.

    ``limits`` are how far the colours reach: of ``shown`` in its unit, and of the contact pressure,
    kPa; ``largest`` are the largest values of the run. ``over_video`` lays the model over the
    recording instead of beside it. ``scale`` is None where the run lacks its recording's tracks.
    """

    name: str
    solution: Solution
    head: RigidMotion
    shown: Shown
    limits: tuple[float, float]
    largest: tuple[float, float]
    recording: Recording | None
    rendered: bool
    scale: PictureScale | None
    over_video: bool = False
    theme: Theme = LIGHT

    @classmethod
    def of(
        cls,
        run: Solution | Path,
        *,
        field: str,
        beside_video: bool,
        over_video: bool = False,
        theme: Theme = LIGHT,
    ) -> RunView:
        """Return the view of a solution or of a run directory.

        Raises
        ------
        DrinksimError
            If what is to be shown is missing.
        """
        if field not in SHOWN:
            raise RunViewError(f"no field {field!r} to show: {nearest(field, SHOWN)}")
        solution = loaded(run)
        scenario, motion = solution.scenario, solution.motion
        if beside_video and over_video:
            raise RunViewError("--beside-video and --over-video exclude each other: give one")
        option = "--over-video" if over_video else "--beside-video"
        filmed = beside_video or over_video
        if filmed and scenario.recording is None:
            raise RunViewError(f"{solution!r} has no recording: leave out {option}")
        recording = scenario.recording if filmed else None
        tracks = None if solution.folder is None else solution.folder / "motion" / "tracks.csv"
        if field not in solution.fields.names:
            raise RunViewError(
                f"{solution!r} holds no {field}, as an earlier version wrote it: show one of "
                f"{', '.join(solution.fields.names)}, or replay it again"
            )
        shown = SHOWN[field]
        far = colour_reach(solution, shown)
        scale = picture_scale(motion, tracks) if recording else None
        if over_video and scale is None:
            raise RunViewError(
                f"{solution!r} lacks the tracks of its recording: leave out {option}"
            )
        return cls(
            name=scenario.name,
            solution=solution,
            head=motion.head,
            shown=shown,
            limits=far.limits,
            largest=far.largest,
            recording=recording,
            rendered=recording is not None and (motion.rendered or _said_rendered(recording)),
            scale=scale,
            over_video=over_video,
            theme=theme,
        )

    @property
    def recording_title(self) -> str:
        """What the recording is called wherever it is shown."""
        return "recording (rendered)" if self.rendered else "recording"

    def pictures(self, times_s: Array) -> Iterator[Image | None]:
        """Yield the recording's picture at each time, s; None if there is no recording to show."""
        if self.recording is None:
            return iter([None] * times_s.size)
        mirrored = self.scale is not None and self.scale.mirrored
        return pictures_at(Path(self.recording.video), times_s, mirrored=mirrored)

    def window(self, aspect: float) -> Window:
        """Return the part of the world that holds the mouth during the whole run.

        ``aspect`` is its width over its height.
        """
        points = np.vstack(list(touched_points(self.solution).values()))
        times = np.linspace(self.solution.time_s[0], self.solution.time_s[-1], 40)
        everywhere = np.concatenate([self.head.at(float(time)).apply(points) for time in times])
        low = everywhere.min(axis=0) - MARGIN_MM
        high = everywhere.max(axis=0) + MARGIN_MM
        width, height = high - low
        width, height = max(width, height * aspect), max(height, width / aspect)
        left, bottom = (low + high - [width, height]) / 2
        return Window(float(left), float(bottom), float(width), float(height))

    def window_px(self, aspect: float) -> Crop | None:
        """Return the same part in the recording's px, or None where its scale is not known."""
        if self.scale is None:
            return None
        window = self.window(aspect)
        corner = np.array([[window.left, window.bottom + window.height]])
        left, top = self.scale.pixels(corner)[0]
        factor = self.scale.px_per_mm
        return Crop(float(left), float(top), factor * window.width, factor * window.height)


def _said_rendered(recording: Recording) -> bool:
    """Return whether the marker file says so: motions from elsewhere do not."""
    return recording.markers is not None and read_markers(Path(recording.markers)).rendered
