"""What a scenario takes from files, checked before anything is converted or computed."""

from __future__ import annotations

from pathlib import Path

from geometry2d.drawings.drawn_head import HeadDrawing
from mocap.tracking.marker_file import read_markers
from scenarios.settings.files import ScenarioError
from scenarios.settings.motion import MotionFile
from scenarios.settings.person import Head
from scenarios.settings.scenario import Scenario
from scenarios.settings.tables import SettingError


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
    mocap.tracking.marker_file.MarkerFileError
        If the marker file of a recording that will be converted cannot be used.
    """
    files = input_files(scenario)
    if "recording.markers" in files:
        read_markers(files["recording.markers"])
    scenario.package.section()
    if scenario.filmed is not None:
        scenario.filmed.section()
    _refuse_ineffective_dermis(scenario.head)
    scenario.head.section()


def input_files(scenario: Scenario) -> dict[str, Path]:
    """Return the files that a replay depends on, by the settings that name them.

    Raises
    ------
    ScenarioError
        If one of them is missing.
    """
    named = {"package.outline": scenario.package.outline, "head.outline": scenario.head.outline}
    if scenario.filmed is not None:
        named["filmed.outline"] = scenario.filmed.outline
    if isinstance(scenario.motion, MotionFile):
        named["motion.file"] = scenario.motion.file
    elif scenario.motion is None and scenario.recording is not None:
        named["recording.video"] = scenario.recording.video
        named["recording.markers"] = scenario.recording.markers
    files = {setting: Path(file) for setting, file in named.items() if file is not None}
    for setting, file in files.items():
        if not file.is_file():
            remedy = "make one with drinksim convert" if "motion" in setting else "check the path"
            raise ScenarioError(f"{setting}: no file {file}: {remedy}")
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
