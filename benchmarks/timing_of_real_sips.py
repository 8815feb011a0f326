"""Timing of real drinking motions: the numbers in ``scenarios/library/timing.toml``.

    python -m benchmarks.timing_of_real_sips 14_37.bvh S240501-1155_P07_T01_0-394.trc

The first file is trial 14_37, "drink soda", of the CMU graphics-lab motion capture database
(mocap.cs.cmu.edu; created with funding from NSF EIA-0196217), as BVH; the second is a trial of
the iDrink demonstration data (DART-Lab-LLUI/iDrink_Demo, MIT licence). Neither has a package or
lips: what they give is *when* and *how fast* a hand travels to a mouth and how far and how fast a
head tilts. Where the neck meets the lips is authored (see ``scenarios/library/*/recording.toml``).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

Array = NDArray[np.float64]

MINIMUM_JERK_PEAK = 1.875  # peak over mean speed of a minimum-jerk reach (Flash & Hogan 1985)
CUTOFF_HZ = 6.0


@dataclass(frozen=True)
class Excursion:
    """A hand's way to the mouth and back."""

    approach_s: float
    hold_s: float
    withdraw_s: float
    peak_over_mean_speed: float
    peak_at: float


def filtered(values: Array, rate_hz: float) -> Array:
    b, a = butter(2, CUTOFF_HZ / (rate_hz / 2))
    return np.asarray(filtfilt(b, a, values, axis=0))


def excursion(distance: Array, rate_hz: float, nearest: int) -> Excursion:
    """Analyse a hand-mouth distance (n,) around the sample where the hand is nearest.

    A way begins and ends where the distance has covered 2 % and 98 % of its change.
    """
    before, after = distance[: nearest + 1], distance[nearest:]
    start = int(np.argmax(before))
    stop = nearest + int(np.argmax(after))
    low = distance[nearest]

    def crossing(span: range, top: float, fraction: float) -> int:
        level = low + fraction * (top - low)
        inside = [i for i in span if (distance[i] - level) * (distance[i + 1] - level) <= 0]
        return inside[0]

    up = range(start, nearest)
    down = range(stop - 1, nearest - 1, -1)
    leave, arrive = crossing(up, distance[start], 0.98), crossing(up, distance[start], 0.02)
    back, depart = crossing(down, distance[stop], 0.98), crossing(down, distance[stop], 0.02)
    speed = np.abs(np.gradient(distance, 1 / rate_hz))[leave : arrive + 1]
    return Excursion(
        (arrive - leave) / rate_hz,
        (depart - arrive) / rate_hz,
        (back - depart) / rate_hz,
        float(speed.max() / speed.mean()),
        float(np.argmax(speed) / (len(speed) - 1)),
    )


def turned(axis: str, angle_deg: float) -> Array:
    a = np.radians(angle_deg)
    c, s = np.cos(a), np.sin(a)
    i, j = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def read_bvh(path: Path) -> tuple[float, dict[str, tuple[Array, Array]]]:
    """Return the frame rate and each joint's positions (n, 3) and orientations (n, 3, 3)."""
    hierarchy, motion = path.read_text().split("MOTION")
    names: list[str] = []
    parents: list[int] = []
    offsets: list[Array] = []
    channels: list[list[str]] = []
    stack: list[int] = []
    for line in hierarchy.splitlines():
        word = line.split()
        if not word:
            continue
        if word[0] in ("ROOT", "JOINT", "End"):
            names.append(word[1] if word[0] != "End" else f"end of {names[-1]}")
            parents.append(stack[-1] if stack else -1)
            channels.append([])
        elif word[0] == "{":
            stack.append(len(names) - 1)
        elif word[0] == "}":
            stack.pop()
        elif word[0] == "OFFSET":
            offsets.append(np.array([float(v) for v in word[1:]]))
        elif word[0] == "CHANNELS":
            channels[-1] = word[2:]
    lines = motion.strip().splitlines()
    rate = 1 / float(lines[1].split(":")[1])
    rows = np.array([[float(v) for v in line.split()] for line in lines[2:]])
    position = np.zeros((len(rows), len(names), 3))
    turn = np.zeros((len(rows), len(names), 3, 3))
    for frame, row in enumerate(rows):
        values = iter(row)
        for joint, parent in enumerate(parents):
            shift, matrix = offsets[joint].copy(), np.eye(3)
            for channel in channels[joint]:
                if channel.endswith("position"):
                    shift["XYZ".index(channel[0])] += next(values)
                else:
                    matrix = matrix @ turned(channel[0], next(values))
            if parent < 0:
                position[frame, joint], turn[frame, joint] = shift, matrix
            else:
                base = turn[frame, parent]
                position[frame, joint] = position[frame, parent] + base @ shift
                turn[frame, joint] = base @ matrix
    return rate, {name: (position[:, i], turn[:, i]) for i, name in enumerate(names)}


def read_trc(path: Path) -> tuple[float, dict[str, Array]]:
    """Return the frame rate and each point's positions (n, 3)."""
    lines = path.read_text().splitlines()
    names = [word for word in lines[3].split("\t")[2:] if word]
    rows = np.array([[float(v) for v in line.split("\t")] for line in lines[5:] if line.strip()])
    rate = float(lines[2].split("\t")[0])
    return rate, {name: rows[:, 2 + 3 * i : 5 + 3 * i] for i, name in enumerate(names)}


def span(values: Array, rate_hz: float, first: int, last: int) -> tuple[float, float]:
    """Return the change of a quantity between two samples and the time its 5-95 % takes."""
    part = values[first : last + 1]
    share = (part - part[0]) / (part[-1] - part[0])
    return float(part[-1] - part[0]), float(np.argmax(share > 0.95) - np.argmax(share > 0.05)) / (
        rate_hz
    )


def describe_cmu(path: Path) -> None:
    rate, joints = read_bvh(path)
    head, axes = joints["head"]
    forward = axes @ np.array([0.0, 0.0, 1.0])
    pitch = filtered(np.degrees(np.arcsin(forward[:, 1])), rate)
    # The skeleton has no mouth: a point 9 units before and 2 above the head joint stands for it.
    mouth = head + axes @ np.array([0.0, 2.0, 9.0])
    distance = filtered(np.linalg.norm(joints["lHand"][0] - mouth, axis=1), rate)
    nearest = int(np.argmin(distance))
    way = excursion(distance, rate, nearest)
    lowest = int(np.argmin(pitch[:nearest]))
    highest = int(np.argmax(pitch))
    end = highest + int(np.argmin(pitch[highest:]))
    rise, rise_s = span(pitch, rate, lowest, highest)
    fall, fall_s = span(pitch, rate, highest, end)
    near = pitch > pitch[lowest] + 0.9 * rise
    travel = filtered(head, rate)[lowest : end + 1]
    print(f"[cmu]  # {path.name}, {rate:.0f} Hz")
    print(f"head_pitch_deg = [{pitch[lowest]:.1f}, {pitch[highest]:.1f}]")
    print(f"pitch_rise_deg = {rise:.1f}\npitch_rise_s = {rise_s:.2f}")
    print(f"pitch_held_s = {near.sum() / rate:.2f}\npitch_fall_deg = {fall:.1f}")
    print(f"pitch_fall_s = {fall_s:.2f}")
    print(f"head_travel = {np.linalg.norm(travel - travel[0], axis=1).max():.1f}  # about cm")
    begin = lowest + int(np.argmax(pitch[lowest:] > pitch[lowest] + 0.05 * rise))
    left = np.flatnonzero(distance > distance[nearest] + 0.05 * (distance.max() - distance.min()))
    arrival = int(left[left < nearest].max())
    departure = int(left[left > nearest].min())
    print(f"pitch_begins_before_hand_arrives_s = {(arrival - begin) / rate:.2f}")
    falls = highest + int(np.argmax(pitch[highest:] < pitch[highest] + 0.05 * fall))
    print(f"pitch_falls_before_hand_leaves_s = {(departure - falls) / rate:.2f}")
    describe_way(way)


def describe_way(way: Excursion) -> None:
    print(f"approach_s = {way.approach_s:.2f}\nhold_s = {way.hold_s:.2f}")
    print(f"withdraw_s = {way.withdraw_s:.2f}")
    print(
        f"peak_over_mean_speed = {way.peak_over_mean_speed:.2f}  # minimum jerk {MINIMUM_JERK_PEAK}"
    )
    print(f"peak_at = {way.peak_at:.2f}  # of the way's duration; minimum jerk 0.5")


def describe_idrink(path: Path) -> None:
    rate, points = read_trc(path)
    smooth = {name: filtered(values, rate) for name, values in points.items()}
    # X points down and Z backwards in this file.
    towards_nose = smooth["Nose"] - (smooth["LEar"] + smooth["REar"]) / 2
    pitch = np.degrees(np.arctan2(-towards_nose[:, 0], -towards_nose[:, 2]))
    distance = np.linalg.norm(smooth["LWrist"] - smooth["Nose"], axis=1)
    half = int(np.argmax(distance[90:200])) + 90
    print(f"\n[idrink]  # {path.name}, {rate:.0f} Hz")
    for number, (first, last) in enumerate(((0, half), (half, len(distance)))):
        part = distance[first:last]
        nearest = int(np.argmin(part))
        print(f"\n# excursion {number + 1}")
        print(f"head_pitch_range_deg = {np.ptp(pitch[first:last]):.1f}")
        describe_way(excursion(part, rate, nearest))


if __name__ == "__main__":
    describe_cmu(Path(sys.argv[1]))
    describe_idrink(Path(sys.argv[2]))
