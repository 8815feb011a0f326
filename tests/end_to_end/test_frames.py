"""What a replay says does not depend on how the camera stood: the world turned gives the same."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry2d.rigid import rotated
from mocap.motion.motion import MarkedBody, Motion
from scenarios.results.increment import Increment
from scenarios.settings.scenario import load_scenario
from scenarios.sip.replay import replay

pytestmark = pytest.mark.slow

TURN_DEG = 34.0
UP_TO_S = 1.6
"""Past the first touch and slip of the lower lip, and the touch of the upper one."""


@pytest.fixture(scope="module")
def motion(library_motion: Callable[[str], Path]) -> Path:
    return library_motion("A38-F")


def turned(motion: Path, angle_deg: float, folder: Path) -> Path:
    """The motion as a camera turned by ``-angle_deg`` would have measured it."""
    straight, by = Motion.read(motion), np.deg2rad(angle_deg)

    def body(marked: MarkedBody) -> MarkedBody:
        return replace(marked, axis_rad=marked.axis_rad + by)

    folder.mkdir()
    straight.with_(
        relative_mm=rotated(straight.relative_mm, by),
        head_mm=rotated(straight.head_mm, by),
        head_body=body(straight.head_body),
        package_body=body(straight.package_body),
    ).write(folder / "motion.csv", decimals=15)
    return folder / "motion.csv"


class PastTheTouch(Exception):
    """Enough was seen."""


def histories(motion: Path) -> dict[str, np.ndarray]:
    rows: list[dict[str, float]] = []

    def keep(increment: Increment) -> None:
        rows.append({"time_s": increment.time_s, **increment.history})
        if increment.time_s > UP_TO_S:
            raise PastTheTouch

    scenario = load_scenario("A38-F", ["numerics.resolution=coarse"]).with_motion(motion)
    with pytest.raises(PastTheTouch):
        replay(scenario, on_increment=keep)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def test_a_turned_world_gives_the_same_histories(motion: Path, tmp_path: Path):
    here, there = histories(motion), histories(turned(motion, TURN_DEG, tmp_path / "turned"))
    assert here["lower_lip_window_kpa"].max() > 10
    for lip in ("upper", "lower"):
        force = np.column_stack([there.pop(f"{lip}_lip_force_{axis}_n") for axis in "xy"])
        back = rotated(force, -np.deg2rad(TURN_DEG))
        there |= {f"{lip}_lip_force_{axis}_n": back[:, i] for i, axis in enumerate("xy")}
    for name, values in here.items():
        scale = max(np.abs(values).max(), 1e-6)
        np.testing.assert_allclose(there[name], values, rtol=0, atol=1e-6 * scale, err_msg=name)
