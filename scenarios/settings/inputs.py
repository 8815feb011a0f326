"""What a scenario takes from files, checked before anything is converted or computed."""

from __future__ import annotations

from pathlib import Path

from geometry2d.drawings.drawn_head import HeadDrawing
from geometry2d.foundation.output import RESULT_MARK
from mocap.motion.motion import Motion
from mocap.tracking.marker_file import read_markers
from scenarios.settings.files import ScenarioError
from scenarios.settings.named_files import named_files
from scenarios.settings.person import Head
from scenarios.settings.scenario import Scenario
from scenarios.settings.tables import SettingError

REFERENCE = "hand.reference"
"""The setting that names a run directory in place of a file."""

REMEDIES = {
    REFERENCE: "make one with drinksim replay",
    "motion.file": "make one with drinksim convert",
}
"""What to do if a file is missing, other than to look at its path."""


def check_inputs(scenario: Scenario) -> None:
    """Check that a scenario's files are there, and that head and necks are sections.

    Raises
    ------
    ScenarioError
        If a file is missing.
    SettingError
        If measurements make no head or neck, or a drawing makes one ineffective.
    geometry2d.drawings.chains.DrawingError
        If a drawing is not that of a head or neck.
    mocap.motion.errors.MotionError
        If the motion's file is broken.
    mocap.tracking.marker_file.MarkerFileError
        If the marker file of a recording that will be converted cannot be used.
    """
    files = input_files(scenario)
    if "recording.markers" in files:
        read_markers(files["recording.markers"])
    if "motion.file" in files:
        Motion.read(files["motion.file"])
    scenario.package.section()
    if scenario.filmed is not None:
        scenario.filmed.section()
    _refuse_ineffective_dermis(scenario.head)
    scenario.head.section()


def input_files(scenario: Scenario) -> dict[str, Path]:
    """Return the files that a replay depends on, by the settings that name them.

    A recording whose motion is known already only supplies pictures: it may be missing.

    Raises
    ------
    ScenarioError
        If one of the others is missing.
    """
    files = {setting: Path(name) for setting, name in named_files(scenario).items()}
    for setting, file in list(files.items()):
        if (file / RESULT_MARK if setting == REFERENCE else file).is_file():
            continue
        if setting.startswith("recording.") and scenario.motion is not None:
            del files[setting]
            continue
        kind = "run directory" if setting == REFERENCE else "file"
        remedy = REMEDIES.get(setting, "check the path")
        raise ScenarioError(f"{setting}: no {kind} {file}: {remedy}")
    return files


def _refuse_ineffective_dermis(head: Head) -> None:
    """Refuse a thickness of the dermis beside a drawing that has its inner side on both lips."""
    thickness = head.measurements.dermis_thickness_mm
    if head.outline is None or thickness == Head().measurements.dermis_thickness_mm:
        return
    drawn = HeadDrawing.read(Path(head.outline)).curves
    if {"upper_interface", "lower_interface"} <= drawn.keys():
        raise SettingError(
            f"head.dermis_thickness_mm = {thickness:g} mm has no effect, as {head.outline} holds "
            "upper_interface and lower_interface"
        )
