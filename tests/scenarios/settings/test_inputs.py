"""What a scenario names is looked at before anything is converted or computed."""

from __future__ import annotations

from pathlib import Path

import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.drawings.chains import DrawingError
from geometry2d.drawings.drawn_head import HeadDrawing
from mocap.tracking.markers import MarkerFileError
from scenarios.settings.files import ScenarioError, library_names
from scenarios.settings.inputs import check_inputs, input_files
from scenarios.settings.scenario import load_scenario
from scenarios.settings.tables import SettingError
from scenarios.sip import run
from scenarios.views.preview import write_preview
from tests.support.marks import slow


def test_the_library_can_be_replayed() -> None:
    for name in library_names():
        check_inputs(load_scenario(name))
    assert input_files(load_scenario("A38-F")).keys() == {"recording.video", "recording.markers"}


@pytest.mark.parametrize(
    ("setting", "kind", "message"),
    [
        ("recording.video=no.mp4", ScenarioError, r"recording\.video: no file .*no\.mp4: check"),
        ("recording.markers=no.toml", ScenarioError, r"recording\.markers: no file .*no\.toml"),
        ("recording.markers=bad.toml", MarkerFileError, r"bad\.toml"),
        ("motion.file=no.csv", ScenarioError, r"motion\.file: no file .*drinksim convert"),
        ("package.outline=no.svg", ScenarioError, r"package\.outline: no file .*no\.svg"),
        ("package.outline=bad.svg", DrawingError, r"bad\.svg"),
        ("head.outline=no.svg", ScenarioError, r"head\.outline: no file .*no\.svg"),
        ("head.outline=bad.svg", DrawingError, r"bad\.svg"),
        slow("head.upper_lip_thickness_mm=1.48", SettingError, r"upper_lip_thickness_mm = 1\.48"),
        ("package.pitch_mm=2", SettingError, r"package\.pitch_mm = 2 mm makes no neck"),
    ],
)
def test_an_input_that_cannot_be_used_is_refused_before_a_conversion(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    setting: str,
    kind: type[Exception],
    message: str,
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("the recording was converted")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run, "convert_recording", never)
    (tmp_path / "bad.toml").write_text("[scale]\n")
    (tmp_path / "bad.svg").write_text('<svg width="90mm" height="90mm" viewBox="0 0 90 90"></svg>')
    scenario = load_scenario("A38-F", [setting])
    for use in (
        lambda: check_inputs(scenario),
        lambda: run.solve(scenario),
        lambda: run.solve(scenario, out=tmp_path / "run"),
        lambda: write_preview(scenario, tmp_path / "p.png", progress=lambda share, text: None),
    ):
        with pytest.raises(kind, match=message):
            use()
    assert {path.name for path in tmp_path.iterdir()} == {"bad.toml", "bad.svg"}


@pytest.mark.slow
def test_a_thickness_of_the_dermis_beside_a_drawing_that_has_it_is_refused(tmp_path: Path) -> None:
    drawing = HeadDrawing.of(head_section())
    whole, bare = tmp_path / "whole.svg", tmp_path / "bare.svg"
    whole.write_text(drawing.svg())
    curves = {name: line for name, line in drawing.curves.items() if "interface" not in name}
    bare.write_text(HeadDrawing(curves, drawing.teeth, drawing.marks).svg())
    thickness = "head.dermis_thickness_mm=1.2"
    check_inputs(load_scenario("A38-F", [f"head.outline={bare}", thickness]))
    check_inputs(load_scenario("A38-F", [f"head.outline={whole}"]))
    with pytest.raises(SettingError, match=r"dermis_thickness_mm = 1\.2 mm has no effect, as .*w"):
        check_inputs(load_scenario("A38-F", [f"head.outline={whole}", thickness]))
