"""The script of a rendered recording: who moves how, before which camera, read from TOML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.head import HeadMeasurements, HeadSection, head_section
from geometry2d.foundation.errors import DrinksimError, naming
from geometry2d.foundation.text import quoted, short
from geometry2d.foundation.toml import read_toml, shown
from geometry2d.neck import NECKS, NeckSection, neck_section
from geometry2d.rigid import RigidMotion, rotated
from mocap.synthetic.camera import Camera, Lens, Sensor
from mocap.synthetic.scene import Light
from scenarios.recordings.choreography import PosePath, PoseStep
from scenarios.settings.files import LIBRARY, recorded_names
from scenarios.settings.names import nearest
from scenarios.settings.tables import table_from

Array = NDArray[np.float64]

SAMPLES_PER_S = 200.0
MARGIN_S = 0.1

TABLES = ("recording", "camera", "sensor", "light", "head", "package")
MOST_STEPS = 200
LONGEST_S, MOST_PICTURES = 600.0, 20_000
LARGEST_SIDE_PX = 8192
"""Bounds of a recording: nobody renders more, and a disk would be full of it."""


class RenderingError(DrinksimError):
    """A recording was asked for that has no script."""


@dataclass(frozen=True)
class RenderedRecording:
    """What is recorded: length (s), package, and how strongly the file is compressed."""

    name: str
    duration_s: float
    neck: str
    carton: str
    crf: float = 22.0


@dataclass(frozen=True)
class HeadScript:
    """How the head moves.

    Parameters
    ----------
    pivot_mm
        Point of the canonical head section about which the head turns.
    start_deg
        Rotation of the canonical section (natural head position) in the first frame.
    steps
        Movements of the pivot (world axes, mm) and rotations (degrees).
    slide
        How the skin over the jaw, which carries the jaw markers, slides along the skull.
    jaw_opening_deg
        How far the mouth is open.
    """

    pivot_mm: tuple[float, float]
    start_deg: float
    jaw_opening_deg: float = HeadMeasurements().jaw_opening_deg
    steps: tuple[PoseStep, ...] = ()
    slide: tuple[PoseStep, ...] = ()

    def motion(self, time_s: Array) -> RigidMotion:
        """Return the motion of the canonical section in the world, ear at (0, 0) at first."""
        x, y = rotated(self.pivot_mm, np.radians(self.start_deg))
        return PosePath(self.pivot_mm, (x, y), self.start_deg, self.steps).motion(time_s)


@dataclass(frozen=True)
class Script:
    """Everything a recording is rendered from.

    `package` leads a point of the neck in the canonical head section (natural head position),
    where it can be compared with lips, teeth and nose.
    """

    recording: RenderedRecording
    camera: Camera
    sensor: Sensor
    light: Light
    head: HeadScript
    package: PosePath

    def face(self) -> HeadSection:
        """Return the head section that is rendered: the library's, with the script's open jaw.

        The same person drinks in all recordings.
        """
        return head_section(HeadMeasurements(jaw_opening_deg=self.head.jaw_opening_deg))

    def neck(self) -> NeckSection:
        """Return the section of the neck that is rendered."""
        if self.recording.neck not in NECKS:
            neck, known = quoted(self.recording.neck), ", ".join(NECKS)
            raise RenderingError(f"recording.neck = {neck}: known necks are {known}")
        return neck_section(NECKS[self.recording.neck])

    def sampled_times(self) -> Array:
        """Return times (s) that sample the motions finely, a little beyond the recording."""
        samples = round((self.recording.duration_s + 2 * MARGIN_S) * SAMPLES_PER_S)
        return -MARGIN_S + np.arange(samples + 1) / SAMPLES_PER_S

    def head_motion(self) -> RigidMotion:
        """Return how the canonical head section moves in the world."""
        return self.head.motion(self.sampled_times())

    def neck_motion(self) -> RigidMotion:
        """Return how the neck moves as seen from the canonical head section."""
        return self.package.motion(self.sampled_times())

    def jaw_motion(self) -> RigidMotion:
        """Return how the skin over the jaw moves in the world."""
        slide = PosePath((0.0, 0.0), (0.0, 0.0), 0.0, self.head.slide)
        return self.head_motion() @ slide.motion(self.sampled_times())


def script_of(name: str) -> Script:
    """Return the script of a recording in the library.

    Raises
    ------
    RenderingError
        If there is none of that name.
    """
    file = LIBRARY / name / "recording.toml"
    if not file.is_file():
        raise RenderingError(
            f"there is no recording {short(name)!r} in the library: known are "
            f"{', '.join(recorded_names())}"
        )
    return read_script(file)


def read_script(file: Path) -> Script:
    """Return the script in a TOML file.

    Raises
    ------
    RenderingError, SettingError, SyntheticError, ChoreographyError
        If the file is not TOML, a table or key is unknown, missing or wrong, or the recording
        would be larger than any camera's.
    """
    tables = read_toml(file, what="script of a recording", error=RenderingError)
    with naming(file):
        return _script_from(tables)


def _script_from(tables: dict[str, Any]) -> Script:
    """Return the script of the tables of a file."""
    for name in tables:
        if name not in TABLES:
            raise RenderingError(f"there is no table [{short(name)}]: {nearest(name, TABLES)}")
    given = {name: _table(tables, name) for name in TABLES}
    lens = table_from(Lens, _table(given["camera"], "lens", "camera."), where="camera.lens")
    camera, head, package = (
        {key: value for key, value in given[name].items() if key not in ("lens", "steps", "slide")}
        for name in ("camera", "head", "package")
    )
    script = Script(
        table_from(RenderedRecording, given["recording"], where="recording"),
        replace(table_from(Camera, camera, where="camera"), lens=lens),
        table_from(Sensor, given["sensor"], where="sensor"),
        table_from(Light, given["light"], where="light"),
        replace(
            table_from(HeadScript, head, where="head"),
            steps=_steps(given, "head", "steps"),
            slide=_steps(given, "head", "slide"),
        ),
        replace(
            table_from(PosePath, package, where="package"),
            steps=_steps(given, "package", "steps"),
        ),
    )
    _refuse_large(script)
    return script


def _table(tables: Mapping[str, Any], name: str, where: str = "") -> Mapping[str, Any]:
    """Return a table of a file, empty if it is not there."""
    table = tables.get(name, {})
    if not isinstance(table, Mapping):
        raise RenderingError(f"{where}{name} = {shown(table)}: write it as a table")
    return table


def _steps(tables: Mapping[str, Any], table: str, key: str) -> tuple[PoseStep, ...]:
    steps, where = tables[table].get(key, []), f"{table}.{key}"
    if not isinstance(steps, list) or len(steps) > MOST_STEPS:
        raise RenderingError(
            f"{where} = {shown(steps)}: give a list of at most {MOST_STEPS} tables, one a movement"
        )
    return tuple(table_from(PoseStep, step, where=where) for step in steps)


def _refuse_large(script: Script) -> None:
    """Refuse a recording that would fill the disk before anybody saw it."""
    camera, seconds = script.camera, script.recording.duration_s
    pictures = seconds * camera.fps
    if not 0 < seconds <= LONGEST_S or not pictures <= MOST_PICTURES:
        raise RenderingError(
            f"recording.duration_s = {seconds:g} at camera.fps = {camera.fps:g}: give at most "
            f"{LONGEST_S:g} s and {MOST_PICTURES} pictures"
        )
    if max(camera.width, camera.height) > LARGEST_SIDE_PX:
        raise RenderingError(
            f"camera.width = {camera.width} and height = {camera.height}: give at most "
            f"{LARGEST_SIDE_PX} px"
        )
