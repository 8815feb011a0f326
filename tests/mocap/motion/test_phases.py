"""Phases and figures of drinking motions, scripted and real."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry2d.rigid import rotated
from mocap.formats.exchange import read_positions
from mocap.formats.marker_table import plane_positions
from mocap.motion.phases import PHASES, LipAtRim, figures_of, sips_of
from mocap.motion.poses import Poses, body_poses

LIBRARY = Path(__file__).parents[3] / "scenarios" / "library"
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
    assert found.package_tilt_deg == pytest.approx(26, abs=0.1)
    assert found.head_pitch_deg == pytest.approx(6, abs=0.1)
    assert found.closest_mm == pytest.approx(np.hypot(95, 45), abs=0.1)


def test_a_package_that_is_only_held_to_the_mouth() -> None:
    time = np.arange(0, 8, 0.02)
    place, turn, _ = sip(time)
    found = figures_of(time, place, 0.05 * turn, np.zeros(time.size))
    assert list(found.phases_s) == ["approach", "contact"]


def test_a_package_that_is_tilted_with_the_head_is_tilted() -> None:
    """What moves the liquid is the tilt in the world, though the neck keeps still at the lips."""
    time = np.arange(0, 8, 0.02)
    place, turn, _ = sip(time)
    found = figures_of(time, place, np.zeros(time.size), turn)
    assert found.phases_s["drink"] == pytest.approx((2.75, 5.25), abs=0.06)
    assert found.package_tilt_deg == pytest.approx(20, abs=0.1)
    assert found.neck_tilt_deg == 0
    still = figures_of(time, place, -turn, turn)
    assert list(still.phases_s) == ["approach", "contact"]


def style(
    past: float | None, outside: float = 0.0, above: float = 50.0, *, early: float | None = None
) -> str:
    """The style of the scripted sip with the upper lip at a place while it is drunk."""
    time = np.arange(0, 8, 0.02)
    place, turn, head = sip(time)
    if past is None:
        return figures_of(time, place, turn, head, inclination_deg=above).style
    drunk = (time > 2.75) & (time < 5.25)
    lip = LipAtRim(
        np.where(drunk, past, past if early is None else early), np.full(time.size, outside), above
    )
    found = figures_of(time, place, turn, head, inclination_deg=above, lip=lip)
    assert found.style_reason
    return found.style


def test_without_the_lip_only_a_package_kept_upright_tells_its_style() -> None:
    # The scripted sip lowers the opening by 26 degrees.
    assert [style(None, above=above) for above in (92, 87, 50, -20)] == [
        "suck", "unknown", "unknown", "unknown",
    ]  # fmt: skip
    time = np.arange(0, 8, 0.02)
    found = figures_of(time, *sip(time))
    assert found.style == "unknown" and "[style]" in found.style_reason


def test_the_place_of_the_upper_lip_tells_the_style() -> None:
    assert style(past=6, outside=1) == "suck"
    assert style(past=6, outside=-12) == "pull"
    assert style(past=-5, outside=4) == "pour"
    # On the wall, on the rim, or off the rim of a package from which nothing runs.
    assert style(past=6, outside=-3) == "unknown"
    assert style(past=1, outside=2) == "unknown"
    assert style(past=-1, outside=-12) == "unknown"
    assert style(past=-5, outside=4, above=95) == "unknown"
    # Nothing reaches a lip inside an opening that stays upright.
    assert style(past=6, outside=-12, above=95) == "unknown"


def test_the_style_is_that_of_the_drinking_not_of_the_approach() -> None:
    assert style(past=6, outside=-12, early=-40) == "pull"


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


def test_two_excursions_of_a_real_recording(recorded: Callable[[str], Path]) -> None:
    """Hand to mouth at 0.73-1.85 s and 4.08-4.87 s, as the recording's description says."""
    table = read_positions(recorded("idrink/S240501-1155_P07_T01_0-394_filt_butterworth.trc"))
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
    # Of the wrist no rotation is known.
    sips = sips_of(table.time_s, turned, -head.angle_rad, head.angle_rad)
    assert len(sips) == 2
    for found, (first, last) in zip(sips, ((0.73, 1.85), (4.08, 4.87)), strict=True):
        assert first - 0.2 < found.closest_s < last + 0.2
        assert "approach" in found.phases_s and "tilt" not in found.phases_s
        assert 2 < found.head_pitch_deg < 60


def test_a_real_sip_of_a_real_skeleton(recorded: Callable[[str], Path]) -> None:
    """Held and pitched as long and as far as an independent analysis of the full recording says.

    Those numbers are in ``scenarios/library/timing.toml``: hand at the mouth for 1.16 s, head
    pitched by 54.6° (its forward axis; here the direction of an eye, in the plane), pitch begins
    0.57 s before the hand arrives and has risen for 1.02 s then.
    """
    table = replace(read_positions(recorded("cmu/14_37.bvh")), unit="cm")
    assert table.rate_hz == pytest.approx(120, rel=1e-4)
    plane = plane_positions(table, right="Z", up="Y")
    count = table.time_s.size

    def pose(*names: str) -> Poses:
        where = [table.names.index(name) for name in names]
        return body_poses("body", names, plane[:, where], np.ones((count, 2)))

    skull, hand = pose("head", "leftEye"), pose("lHand", "lMid1")
    relative = rotated(hand.position_mm - skull.position_mm, -skull.angle_rad)
    turn = hand.angle_rad - skull.angle_rad
    (found,) = sips_of(table.time_s, relative, turn, skull.angle_rad)
    timing = tomllib.loads((LIBRARY / "timing.toml").read_text(encoding="utf-8"))["cmu"]
    assert list(found.phases_s) == list(PHASES)
    assert found.duration_at_mouth_s == pytest.approx(timing["hold_s"], abs=0.1)
    assert found.head_pitch_deg == pytest.approx(timing["pitch_rise_deg"], abs=1.5)
    start, arrival = found.phases_s["approach"]
    assert arrival - start == pytest.approx(timing["approach_s"], abs=0.4)
    # The hand raises what it holds (turns clockwise), less than the head, which it faces, pitches.
    assert 3 < found.package_tilt_deg < 12
    assert -8 < found.neck_tilt_deg < 0
    assert 100 < found.closest_mm < 250
    assert found.style == "unknown"
