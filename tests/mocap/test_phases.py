"""Phases and figures of drinking motions, scripted and real."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mocap.exchange import plane_positions, read_positions
from mocap.motion import Poses, body_poses
from mocap.phases import PHASES, figures_of, sips_of

DATA = Path(__file__).parents[1] / "data"
# cm, x forwards, y up; a head with an eye 8 cm in front, and a hand with a finger.
SKELETON = """HIERARCHY
ROOT hip
{{ OFFSET 0 0 0
  CHANNELS 0
  JOINT head
  {{ OFFSET 0 60 0
    CHANNELS 1 Zrotation
    JOINT eye
    {{ OFFSET 8 5 0
      CHANNELS 0
    }}
  }}
  JOINT hand
  {{ OFFSET 0 60 0
    CHANNELS 4 Xposition Yposition Zposition Zrotation
    JOINT finger
    {{ OFFSET 9 0 0
      CHANNELS 0
    }}
  }}
}}
MOTION
Frames: {count}
Frame Time: 0.02
{rows}
"""


def step(time: np.ndarray, start: float, end: float) -> np.ndarray:
    s = np.clip((time - start) / (end - start), 0, 1)
    return s**3 * (10 - 15 * s + 6 * s**2)


def sip(time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An approach from 0.5 to 1.5 s, a tilt of 20° at 2 to 3 s, back at 5 to 6, off from 6.5."""
    away = 1 - step(time, 0.5, 1.5) + step(time, 6.5, 7.5)
    place = np.column_stack([95 + 120 * away, -45 - 60 * away])
    turn = np.radians(20) * (step(time, 2, 3) - step(time, 5, 6))
    return place, turn, 0.3 * turn


def test_phases_of_a_scripted_sip() -> None:
    time = np.arange(0, 8, 0.02)
    place, turn, head = sip(time)
    found = figures_of(time, place, turn, head)
    assert list(found.phases_s) == list(PHASES)
    ends = np.array(list(found.phases_s.values())).ravel()
    np.testing.assert_array_equal(ends[1:-1:2], ends[2::2])
    assert found.phases_s["approach"][0] == pytest.approx(0.6, abs=0.15)
    assert found.phases_s["contact"][0] == pytest.approx(1.3, abs=0.15)
    assert found.phases_s["tilt"] == pytest.approx((2.25, 2.75), abs=0.06)
    assert found.phases_s["drink"] == pytest.approx((2.75, 5.25), abs=0.06)
    assert found.neck_tilt_deg == pytest.approx(20, abs=0.1)
    assert found.head_pitch_deg == pytest.approx(6, abs=0.1)
    assert found.closest_mm == pytest.approx(np.hypot(95, 45), abs=0.1)


def test_a_package_that_is_only_held_to_the_mouth() -> None:
    time = np.arange(0, 8, 0.02)
    place, turn, head = sip(time)
    found = figures_of(time, place, 0.05 * turn, head)
    assert list(found.phases_s) == ["approach", "contact"]


def test_styles_are_named_only_where_the_motion_excludes_the_others() -> None:
    time = np.arange(0, 8, 0.02)
    place, turn, head = sip(time)
    styles = {
        above: figures_of(time, place, turn, head, inclination_deg=above).style
        for above in (90.0, 60.0, -20.0)
    }
    assert styles == {90.0: "suck", 60.0: "unknown", -20.0: "pour"}
    found = figures_of(time, place, turn, head)
    assert found.style == "unknown" and "not known" in found.style_reason


def test_what_is_turned_down_before_it_arrives_counts_for_the_style() -> None:
    """The hand tips the package on its way; at the mouth it is only held."""
    time = np.arange(0, 8, 0.02)
    place, _, _ = sip(time)
    turn = np.radians(100) * (step(time, 0.5, 1.0) - step(time, 7.5, 8.0))
    found = figures_of(time, place, turn, np.zeros(time.size), inclination_deg=70.0)
    assert found.neck_tilt_deg == pytest.approx(0, abs=3)
    assert found.style == "pour" and "30°" in found.style_reason


def test_a_sip_of_a_skeleton(tmp_path: Path) -> None:
    """A skeleton in BVH whose hand comes to its head, which nods back."""
    time = np.arange(0, 8, 0.02)
    place, turn, head = sip(time)
    rows = [
        f"{np.degrees(nod):.6f} {x:.6f} {y:.6f} 0 {np.degrees(roll + nod):.6f}"
        for nod, (x, y), roll in zip(head, place / 10, turn, strict=True)
    ]
    path = tmp_path / "sip.bvh"
    path.write_text(SKELETON.format(count=len(rows), rows="\n".join(rows)))
    table = replace(read_positions(path), unit="cm")
    plane = plane_positions(table, right="X", up="Y")

    def pose(*names: str) -> Poses:
        return body_poses(
            "body", names, plane[:, [table.names.index(n) for n in names]], np.ones((len(time), 2))
        )

    skull, hand = pose("head", "eye"), pose("hand", "finger")
    relative = hand.position_mm - skull.position_mm
    (found,) = sips_of(time, relative, hand.angle_rad - skull.angle_rad, skull.angle_rad)
    straight = figures_of(time, place, turn, head)
    assert list(found.phases_s) == list(PHASES)
    assert found.phases_s["drink"] == pytest.approx(straight.phases_s["drink"], abs=0.03)
    assert found.neck_tilt_deg == pytest.approx(20, abs=0.1)
    assert found.head_pitch_deg == pytest.approx(6, abs=0.1)
    assert found.closest_mm == pytest.approx(np.hypot(95, 45), abs=0.1)


def test_two_excursions_of_a_real_recording() -> None:
    """Hand to mouth at 0.73-1.85 s and 4.08-4.87 s, as the recording's description says."""
    table = read_positions(DATA / "idrink" / "S240501-1155_P07_T01_0-394_filt_butterworth.trc")
    plane = plane_positions(table, right="-Z", up="-X")
    where = [table.names.index(name) for name in ("LEar", "Nose")]
    head = body_poses("head", ("LEar", "Nose"), plane[:, where], np.ones((394, 2)))
    wrist = plane[:, table.names.index("LWrist")]
    relative = wrist - plane[:, where[0]]
    turned = np.einsum(
        "nij,nj->ni",
        np.moveaxis(
            np.array(
                [
                    [np.cos(head.angle_rad), np.sin(head.angle_rad)],
                    [-np.sin(head.angle_rad), np.cos(head.angle_rad)],
                ]
            ),
            -1,
            0,
        ),
        relative,
    )
    sips = sips_of(table.time_s, turned, np.zeros(394), head.angle_rad)
    assert len(sips) == 2
    for found, (first, last) in zip(sips, ((0.73, 1.85), (4.08, 4.87)), strict=True):
        assert first - 0.2 < found.closest_s < last + 0.2
        assert "approach" in found.phases_s and "tilt" not in found.phases_s
        assert 2 < found.head_pitch_deg < 60
