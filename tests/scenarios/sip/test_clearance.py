"""The distance of a moving neck from the lips is that of the nearest point of all."""

from __future__ import annotations

import numpy as np
import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.neck import A38_NECK, neck_section
from geometry2d.rigid import RigidPlacement
from scenarios.sip.clearance import gaps_mm


@pytest.mark.parametrize("lip", ["upper", "lower"])
def test_the_nearest_point_of_all_is_found(lip: str) -> None:
    head, neck = head_section(), neck_section(A38_NECK)
    skin = getattr(head, lip).curves["skin"]
    rng = np.random.default_rng(4)
    places = [
        RigidPlacement(float(turn), (float(x), float(y)))
        for turn, x, y in zip(
            rng.uniform(-1, 0, 25), rng.uniform(95, 125, 25), rng.uniform(-65, -45, 25), strict=True
        )
    ]
    every = [
        min(
            wall.project(place.pull_back(skin)).distance.min()
            for wall in (neck.upper_wall, neck.lower_wall)
        )
        for place in places
    ]
    assert min(every) < 0 < max(every)
    np.testing.assert_array_equal(gaps_mm(head, neck, places, lip), every)
