"""A scenario whose motion is a value: made, changed and compared without a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from mocap.motion.motion import Motion
from scenarios.settings.scenario import (
    MotionFile,
    ScenarioError,
    SettingError,
    load_scenario,
    resolved_toml,
)
from tests.support.made_up_sip import write_motion


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write_motion(tmp_path / "motion", tracked=False)


@pytest.fixture
def motion(file: Path) -> Motion:
    return Motion.read(file)


def test_a_motion_is_given_and_compared_as_a_value(motion: Motion) -> None:
    scenario = load_scenario("A38-F").with_(motion=motion, contact={"friction": 0.5})
    assert scenario.motion is motion
    assert scenario.contact.friction == 0.5
    assert scenario == load_scenario("A38-F").with_(contact={"friction": 0.5}, motion=motion)
    moved = motion.with_(relative_mm=motion.relative_mm + 1.0)
    assert scenario != scenario.with_(motion=moved)


def test_a_motion_stays_while_other_settings_change(motion: Motion) -> None:
    scenario = load_scenario("A38-F").with_(motion=motion)
    changed = scenario.with_(contact={"friction": 0.5}, numerics={"resolution": "coarse"})
    assert changed.motion is motion
    assert changed.numerics.resolution == "coarse"
    assert changed.recording == scenario.recording
    with pytest.raises(SettingError, match=r"contact\.friction = 9"):
        scenario.with_(contact={"friction": 9.0})


def test_the_filmed_neck_stays_that_of_the_motion(motion: Motion) -> None:
    scenario = load_scenario("A38-F").with_(motion=motion)
    other = scenario.with_(package={"neck": "DC"})
    assert (other.package.neck, other.filmed_package.neck) == ("DC", "A38")
    assert other.motion is motion
    own = load_scenario("A38-F").with_(package={"neck": "DC"})
    assert own.with_motion(motion).filmed_package.neck == "A38"
    assert own.with_(motion=motion).filmed_package.neck == "DC"


def test_a_file_takes_the_place_of_a_value_and_the_other_way_round(
    motion: Motion, file: Path
) -> None:
    in_memory = load_scenario("A38-F").with_(motion=motion)
    on_disk = in_memory.with_(motion=file)
    assert on_disk.motion == MotionFile(str(file))
    assert on_disk.with_(motion=motion) == in_memory
    assert in_memory.with_(motion=None).motion is None


def test_a_motion_is_known_to_the_decimals_of_its_file(motion: Motion, file: Path) -> None:
    finer = motion.with_(relative_mm=motion.relative_mm + 1e-9)
    assert finer != motion
    scenario = load_scenario("A38-F")
    known = scenario.with_(motion=finer).known_motion()
    assert known == finer.rounded() != finer
    assert scenario.with_(motion=file).known_motion() == motion
    with pytest.raises(ScenarioError, match="convert its recording first"):
        scenario.known_motion()


def test_a_scenario_is_told_in_a_line(motion: Motion, file: Path) -> None:
    scenario = load_scenario("A38-F")
    assert repr(scenario) == "<Scenario A38-F: recording.mp4, neck A38, L2-Ogden, standard>"
    assert "motion.csv, neck" in repr(scenario.with_(motion=file))
    in_memory = scenario.with_(motion=motion)
    assert repr(in_memory).startswith("<Scenario A38-F: Motion(package seen from head, ")
    assert len(repr(in_memory)) < 160


def test_a_printed_scenario_says_that_its_motion_is_in_memory(motion: Motion) -> None:
    text = resolved_toml(load_scenario("A38-F").with_(motion=motion))
    line = next(line for line in text.splitlines() if line.startswith("# [motion]"))
    assert "in memory: Motion(" in line
