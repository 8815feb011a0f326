"""Scenarios: what is read, resolved and refused."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.drawings.drawn_head import HeadDrawing
from scenarios.settings.scenario import (
    LIBRARY,
    MotionFile,
    ScenarioError,
    library_names,
    read_scenario,
    resolved_toml,
    scenario_from,
)
from scenarios.settings.tables import SettingError

SMALL = 'name = "mine"\n[motion]\nfile = "motion.csv"\n'


def test_the_library_can_be_read() -> None:
    assert "A38-F" in library_names()
    for name in library_names():
        assert read_scenario(name).name == name


def test_the_resolved_file_reads_back_to_the_same_scenario(tmp_path: Path) -> None:
    scenario = read_scenario("A38-F", ["contact.friction=0.3", "package.crests=3"])
    file = tmp_path / "resolved.toml"
    for chosen in (scenario, *map(read_scenario, library_names())):
        file.write_text(resolved_toml(chosen))
        assert read_scenario(str(file)) == chosen


def test_the_resolved_file_has_every_setting_of_every_table() -> None:
    scenario = replace(read_scenario("A38-F"), motion=MotionFile("motion.csv"))
    document = tomllib.loads(resolved_toml(scenario))
    assert document["contact"] == {"friction": 1.0, "teeth_friction": 0.0, "lip_friction": 0.3}
    assert document["package"]["neck"] == "A38"
    assert document["package"]["thread_diameter_mm"] == 37.2
    assert document["motion"]["file"] == "motion.csv"
    assert len(document["head"]) > 20


def test_files_are_looked_for_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(SMALL)
    scenario = read_scenario(str(tmp_path / "mine.toml"))
    assert scenario.motion == MotionFile(str(tmp_path / "motion.csv"))
    assert scenario.recording is None
    recording = read_scenario("A38-F").recording
    assert recording is not None
    assert Path(recording.video).parent == LIBRARY / "A38-F"


def test_another_neck_brings_its_own_measurements() -> None:
    wide, narrow = (read_scenario("A38-F", [f"package.neck={n}"]).package for n in ("A38", "DC"))
    assert narrow.neck == "DC"
    assert narrow.measurements.thread_diameter_mm < wide.measurements.thread_diameter_mm
    given = read_scenario("A38-F", ["package.neck=DC", "package.thread_diameter_mm=30"]).package
    assert given.measurements == replace(narrow.measurements, thread_diameter_mm=30.0)


def test_a_drawing_replaces_the_measured_neck(tmp_path: Path) -> None:
    circles = {"upper_wall": (20, 9), "lower_wall": (40, 9), "upper_mark": (23, 1),
               "lower_mark": (37, 1)}  # fmt: skip
    shapes = [f'<circle id="{name}" cx="50" cy="{y}" r="{r}"/>' for name, (y, r) in circles.items()]
    (tmp_path / "neck.svg").write_text(
        f'<svg width="90mm" height="90mm" viewBox="0 0 90 90">{"".join(shapes)}</svg>'
    )
    document = tomllib.loads(SMALL + '[package]\noutline = "neck.svg"\n')
    package = scenario_from(document, folder=tmp_path).package
    assert package.outline == str(tmp_path / "neck.svg")
    neck = package.section()
    assert neck.upper_mark == pytest.approx([0, 14])
    assert neck.upper_wall.project([[0, 17]]).distance == pytest.approx([-9])
    again = tomllib.loads(resolved_toml(scenario_from(document, folder=tmp_path)))
    assert again["package"]["outline"] == package.outline
    with pytest.raises(SettingError, match=r"package\.outline = 3"):
        scenario_from(tomllib.loads(SMALL + "[package]\noutline = 3\n"), folder=tmp_path)


def test_a_drawing_replaces_the_measured_head(tmp_path: Path) -> None:
    (tmp_path / "head.svg").write_text(HeadDrawing.of(head_section()).svg())
    text = SMALL + '[head]\noutline = "head.svg"\ntie_fade_mm = 3.0\n'
    scenario = scenario_from(tomllib.loads(text), folder=tmp_path)
    head = scenario.head_section()
    assert head.tie_fade_mm == 3.0
    assert head.landmarks["nose"] == pytest.approx(head_section().landmarks["nose"])
    again = tomllib.loads(resolved_toml(scenario))
    assert again["head"] == {
        "outline": str(tmp_path / "head.svg"), "dermis_thickness_mm": 1.0, "tie_fade_mm": 3.0
    }  # fmt: skip
    assert scenario_from(again, folder=tmp_path) == scenario
    for wrong, message in (
        ("outline = 3", r"head\.outline = 3"),
        ('outline = "head.svg"\njaw_opening_deg = 5.0', "head.jaw_opening_deg says nothing beside"),
        ('outline = "head.svg"\ntie_fade = 5.0', "unknown key head.tie_fade: did you mean"),
    ):
        with pytest.raises(SettingError, match=message):
            scenario_from(tomllib.loads(SMALL + f"[head]\n{wrong}\n"), folder=tmp_path)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("contact.fricton=1", "unknown key contact.fricton: did you mean 'friction'"),
        ("contact.friction=-1", "contact.friction = -1 is too small: at least 0"),
        ("solver.plane=strian", "solver.plane = 'strian' is not a choice: did you mean 'strain'"),
        ("package.neck=B38", "package.neck = 'B38' is not known: did you mean 'A38'"),
        ("skins.configuration=L1", "unknown table or key 'skins': did you mean 'skin'"),
        ("solver.resolution.x=1", "too many dots"),
        ("name.x=1", "'name' is not a table"),
        ("contact=1", r"contact = 1: write it as a table, \[contact\]"),
        ("recording.end_s=-1", "recording.end_s = -1 s is too small"),
        ('name=""', "name = '': give a text"),
    ],
)
def test_wrong_settings_are_refused_in_words(override: str, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        read_scenario("A38-F", [override])


def test_a_scenario_needs_a_recording_or_a_motion(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"neither a \[recording\] nor a \[motion\]"):
        scenario_from({"name": "nothing"}, folder=tmp_path)


def test_a_recording_that_ends_before_it_starts_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"start_s = 3 s is not before end_s = 2 s"):
        read_scenario("A38-F", ["recording.start_s=3", "recording.end_s=2"])


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"no scenario 'A38-G': did you mean 'A38-"):
        read_scenario("A38-G")
    with pytest.raises(ScenarioError, match=r"no scenario file nowhere/mine\.toml: check the path"):
        read_scenario("nowhere/mine.toml")
    broken = tmp_path / "broken.toml"
    broken.write_text("name = \n")
    with pytest.raises(ScenarioError, match="not valid TOML"):
        read_scenario(str(broken))


def test_the_instants_of_a_muscle_must_come_in_order_and_in_fours() -> None:
    with pytest.raises(SettingError, match=r"muscle\.tense_from_s.*later than the one before"):
        read_scenario("DC-AE", ["muscle.relax_to_s=[7.3, 9.5]"])
    with pytest.raises(SettingError, match=r"hold \[1, 2, 2, 2\] times: give one in each"):
        read_scenario("DC-AE", ["muscle.tense_from_s=[0.3]"])
    with pytest.raises(SettingError, match=r"fade_mm = 9 does not fit twice"):
        read_scenario("DC-AE", ["muscle.fade_mm=9"])
    assert read_scenario("A38-F").muscle is None


def test_a_place_of_first_contact_needs_its_time() -> None:
    with pytest.raises(SettingError, match="upper_place_mm has no upper_time_s"):
        read_scenario("A38-F", ["first_contact.upper_place_mm=3"])
