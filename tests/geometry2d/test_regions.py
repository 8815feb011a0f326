import numpy as np
import pytest

from geometry2d.regions import RegionError, Section

SQUARE = {
    "low": np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]),
    "high": np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]]),
}
LOOP = (("low", True), ("high", False))


def test_region_is_the_loop_of_its_curves():
    section = Section("block", SQUARE, {"all": LOOP}, {"floor": ("low",)})

    assert section.regions["all"].tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert section.boundaries["floor"][0] is SQUARE["low"]


@pytest.mark.parametrize(
    ("curves", "loop", "message"),
    [
        (SQUARE, (("low", True), ("high", True)), "starts 1 mm from the end"),
        (SQUARE, (("high", True), ("low", False)), "runs clockwise"),
        (SQUARE, (("low", True), ("side", False)), "no curve 'side'; there are low, high"),
        (
            {**SQUARE, "high": np.array([[0.0, 0.0], [2.0, 0.5], [1.0, 1.0]])},
            LOOP,
            "crosses itself",
        ),
    ],
)
def test_loops_that_bound_nothing_are_refused(curves, loop, message):
    with pytest.raises(RegionError, match=message):
        Section("block", curves, {"all": loop}, {})
