"""What contradicts a recording is found before anything is computed, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest

from geometry2d.anatomy.head import HeadMeasurements, HeadSection, head_section
from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.neck import A38_NECK, DC_NECK, NeckSection, neck_section
from geometry2d.rigid import RigidMotion
from scenarios.placing.recorded_motion import RecordedNeck
from scenarios.settings.files import recorded_names
from scenarios.settings.scenario import load_scenario
from scenarios.sip.clearance import Approach
from scenarios.sip.findings import Finding, Severity, findings_of, nose_profile
from tests.support.drawings import neck_drawing

TIMES = np.linspace(0.0, 4.0, 101)


@pytest.fixture(scope="module")
def head() -> HeadSection:
    return head_section(HeadMeasurements(jaw_opening_deg=7.0))


@pytest.fixture(scope="module")
def neck() -> NeckSection:
    return neck_section(A38_NECK)


def sip(*, x: float = 0.0, y: float = 0.0) -> RigidMotion:
    """The way of the neck of a full A38 package to the mouth and back, moved by x and y, mm."""
    away = (0.5 + 0.5 * np.cos(2 * np.pi * TIMES / TIMES[-1]))[:, None]
    far, near = np.array([173.4, -110.1]), np.array([100.27 + x, -54.92 + y])
    turn = np.deg2rad(-24.5 + away[:, 0] * -25.5)
    return RigidMotion(TIMES, turn, near + away * (far - near))


def about(found: tuple[Finding, ...], subject: str) -> Finding:
    matching = [finding for finding in found if finding.subject == subject]
    assert len(matching) == 1, found
    return matching[0]


def found_with(head, neck, motion, *, filmed=None, marks=14.0):
    approach = Approach(head, neck, motion)
    return findings_of(approach, filmed=filmed or neck, recorded=RecordedNeck(marks))


def test_a_sip_as_it_should_be_has_no_findings(head, neck):
    assert [str(finding) for finding in found_with(head, neck, sip())] == []


@pytest.mark.parametrize(("factor", "word"), [(1000.0, "milliseconds"), (25.0, "frame numbers")])
def test_times_in_other_units(head, neck, factor, word):
    motion = sip()
    wrong = replace(
        motion, time_s=np.round(motion.time_s * factor) + (0.5 if "milli" in word else 0)
    )
    finding = about(found_with(head, neck, wrong), "time_s")
    assert finding.severity is Severity.ERROR
    assert word in finding.message


def test_missing_rows(head, neck):
    motion = sip()
    kept = np.r_[0:30, 60:101]
    holed = RigidMotion(motion.time_s[kept], motion.angle_rad[kept], motion.shift_mm[kept])
    assert about(found_with(head, neck, holed), "time_s").severity is Severity.WARNING


def test_a_motion_that_ends_at_the_mouth(head, neck):
    motion = sip()
    cut = RigidMotion(motion.time_s[:51], motion.angle_rad[:51], motion.shift_mm[:51])
    found = found_with(head, neck, cut)
    assert {f.severity for f in found} == {Severity.WARNING}
    assert any("last instant" in f.message for f in found)


def test_lengths_in_metres(head, neck):
    motion = sip()
    wrong = replace(motion, shift_mm=motion.shift_mm / 1000.0)
    finding = about(found_with(head, neck, wrong), "rel_x_mm, rel_y_mm")
    assert "these look like m:" in finding.message


def test_lengths_in_centimetres_start_inside_the_head(head, neck):
    motion = sip()
    wrong = replace(motion, shift_mm=motion.shift_mm / 10.0)
    assert {f.severity for f in found_with(head, neck, wrong)} >= {Severity.ERROR}


def test_angles_in_radians(head, neck):
    motion = sip()
    wrong = replace(motion, angle_rad=np.deg2rad(motion.angle_rad))
    finding = about(found_with(head, neck, wrong), "rel_theta_deg")
    assert finding.severity is Severity.ERROR
    assert "radians" in finding.message


@pytest.mark.parametrize(("unit", "mm"), [("cm", 10.0), ("inch", 25.4)])
def test_a_drawing_in_other_units(head, neck, unit, mm):
    small = replace(
        neck,
        upper_wall=scaled(neck.upper_wall, 1 / mm),
        lower_wall=scaled(neck.lower_wall, 1 / mm),
    )
    finding = about(found_with(head, small, sip(), filmed=neck), "package")
    assert finding.severity is Severity.ERROR
    assert f"a drawing in {unit}:" in finding.message


def scaled(outline, factor):
    corners = outline.sampled(0.5) * factor
    return type(outline).from_corners(corners, 0.0)


def test_marks_that_are_not_those_of_the_recording(head, neck):
    finding = about(found_with(head, neck, sip(), marks=20.0), "package")
    assert finding.severity is Severity.ERROR
    assert "14.0 mm apart" in finding.message
    assert "20.0 mm" in finding.message


def test_a_much_wider_neck_is_odd(head, neck):
    wide = neck_section(
        replace(A38_NECK, thread_diameter_mm=58.0, root_diameter_mm=55.6, mark_distance_mm=14.0)
    )
    found = found_with(head, wide, sip(), filmed=neck)
    assert any("diameter" in f.message and f.severity is Severity.WARNING for f in found)
    narrow = neck_section(DC_NECK)
    assert not any("diameter" in f.message for f in found_with(head, narrow, sip(), filmed=neck))


@pytest.mark.slow
def test_a_neck_with_its_rim_at_the_wrong_end(head, neck):
    turned = sip()
    left, right = neck.lower_wall.box[0], neck.lower_wall.box[2]
    flipped = replace(
        neck,
        upper_wall=mirrored(neck.upper_wall, left + right),
        lower_wall=mirrored(neck.lower_wall, left + right),
    )
    # The drawn rim is at the largest x; the motion brings the filmed rim to the mouth.
    back = RigidMotion(
        turned.time_s, turned.angle_rad + np.pi, turned.shift_mm + np.array([0.0, 20.0])
    )
    finding = about(found_with(head, flipped, back, filmed=neck), "package")
    assert finding.severity is Severity.ERROR
    assert "rim" in finding.message


def test_a_mirrored_drawing_has_its_thread_behind_the_marks(head, neck):
    flipped = replace(
        neck, upper_wall=mirrored(neck.upper_wall, 0.0), lower_wall=mirrored(neck.lower_wall, 0.0)
    )
    finding = about(found_with(head, flipped, sip(), filmed=neck), "package")
    assert finding.severity is Severity.ERROR
    assert "2 of its crests behind the marks" in finding.message
    for plain in (neck_section(replace(A38_NECK, crests=0)), neck_section(DC_NECK)):
        assert not any("crests" in f.message for f in found_with(head, plain, sip(), filmed=neck))


@pytest.mark.parametrize("measured", [A38_NECK, DC_NECK], ids=["A38", "DC"])
def test_a_mirrored_drawing_without_a_thread_has_its_cut_end_in_front(head, measured, tmp_path):
    plain, sheet = replace(measured, crests=0), tmp_path / "neck.svg"
    for turned in (False, True):
        sheet.write_text(neck_drawing(plain, mirrored=turned), encoding="utf-8")
        found = found_with(head, drawn_neck(sheet), sip(), filmed=neck_section(A38_NECK))
        told = [f for f in found if "rims are the rounder end" in f.message]
        assert len(told) == turned
        assert all(f.severity is Severity.WARNING for f in told)


def test_a_measured_neck_may_have_a_sharp_rim(head, neck):
    sharp = neck_section(replace(A38_NECK, rim_radius_mm=0.1))
    assert not any("rounder" in f.message for f in found_with(head, sharp, sip(), filmed=neck))


def test_a_neck_that_the_film_does_not_show(head, neck):
    wide = np.array([neck.rim_edge(wall) for wall in ("lower", "upper")])
    approach = Approach(head, neck_section(DC_NECK), sip())

    def found(filmed, rim):
        return findings_of(approach, filmed=filmed, recorded=RecordedNeck(14.0, rim))

    finding = about(found(neck_section(DC_NECK), wide), "package")
    assert finding.severity is Severity.ERROR
    assert "23.0 mm wide" in finding.message
    assert "34.8 mm" in finding.message
    assert not any(f.subject == "package" for f in found(neck, wide + np.array([2.0, -1.0])))
    finding = about(found(neck, wide + np.array([6.0, 0.0])), "package")
    assert finding.severity is Severity.WARNING
    assert "6.0 mm from rim_" in finding.message


@pytest.mark.parametrize("name", recorded_names())
def test_marker_files_of_the_library_show_the_rim_to_a_millimetre(name):
    scenario = load_scenario(name)
    rim = RecordedNeck.of(scenario).rim_mm
    assert rim is not None
    filmed = scenario.filmed_package.section()
    edges = [filmed.rim_edge(wall) for wall in ("lower", "upper")]
    np.testing.assert_allclose(rim, edges, atol=1.0)


@pytest.mark.parametrize(("up_mm", "severity"), [(11.0, Severity.WARNING), (17.0, Severity.ERROR)])
def test_a_neck_in_the_nose(head, neck, up_mm, severity):
    found = [
        f for f in found_with(head, neck, sip(x=4.0, y=up_mm)) if "the nose at rest" in f.message
    ]
    assert [f.severity for f in found] == [severity]


def test_the_nose_ends_where_the_lip_begins(head):
    drawn = head.landmarks["subnasale"]
    moved = replace(head, landmarks={k: v for k, v in head.landmarks.items() if k != "subnasale"})
    assert np.hypot(*(nose_profile(moved)[-1] - drawn)) < 0.1


def mirrored(outline, about_twice):
    corners = outline.sampled(0.4) * [-1.0, 1.0] + [about_twice, 0.0]
    return type(outline).from_corners(corners[::-1], 0.0)


def test_a_lip_that_is_never_touched_is_odd(head, neck):
    narrow = neck_section(DC_NECK)
    found = found_with(head, narrow, sip(y=-3.0), filmed=neck)
    assert {f.subject for f in found} == {"lower lip"}
    assert {f.severity for f in found} == {Severity.WARNING}


def test_a_neck_that_touches_no_lip_contradicts_the_film(head, neck):
    finding = about(found_with(head, neck, sip(x=12.0)), "motion")
    assert finding.severity is Severity.ERROR
    assert "both lips" in finding.message


@pytest.mark.parametrize(("unit", "mm"), [("cm", 10.0), ("inch", 40.0)])
def test_lengths_in_larger_units(head, neck, unit, mm):
    motion = sip()
    wrong = replace(motion, shift_mm=motion.shift_mm / mm)
    finding = about(found_with(head, neck, wrong), "rel_x_mm, rel_y_mm")
    assert f"these look like {unit}:" in finding.message


def test_a_shut_jaw_is_odd(neck):
    shut = head_section(HeadMeasurements(jaw_opening_deg=0.0))
    assert about(found_with(shut, neck, sip(x=3.0)), "head").severity is Severity.WARNING


def test_marks_that_are_not_those_of_the_filmed_neck_are_odd(head, neck):
    other = neck_section(replace(A38_NECK, mark_distance_mm=20.0))
    finding = about(found_with(head, other, sip(), filmed=neck), "package")
    assert finding.severity is Severity.WARNING
    assert "20.0 mm apart and those of the filmed one 14.0 mm" in finding.message


def test_marks_of_a_drawing_are_those_of_the_film(head, neck, tmp_path):
    sheet = tmp_path / "neck.svg"
    for marks_mm in (14.0, 20.0):
        sheet.write_text(neck_drawing(marks_mm=marks_mm), encoding="utf-8")
        found = found_with(head, drawn_neck(sheet), sip(), filmed=neck)
        told = [f for f in found if f.severity is Severity.ERROR and "apart" in f.message]
        assert len(told) == (marks_mm == 20.0)


def test_a_neck_in_the_teeth(head, neck):
    found = found_with(head, neck, sip(x=-16.0))
    assert any("incisor" in f.message and f.severity is Severity.ERROR for f in found)


def test_a_neck_that_starts_in_the_mouth(head, neck):
    motion = sip(x=-3.0)
    late = RigidMotion(
        motion.time_s[50:] - motion.time_s[50], motion.angle_rad[50:], motion.shift_mm[50:]
    )
    found = found_with(head, neck, late)
    assert any("first instant" in f.message for f in found)
