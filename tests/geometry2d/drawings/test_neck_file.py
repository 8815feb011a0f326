"""A neck that is written as a drawing is read back as the same neck."""

import numpy as np
import pytest

from geometry2d.drawings.chains import DrawingError
from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.drawings.neck_file import write_neck
from geometry2d.neck import A38_NECK, DC_NECK, neck_section


@pytest.mark.parametrize("ending", ["svg", "dxf"])
@pytest.mark.parametrize("measurements", [A38_NECK, DC_NECK], ids=["A38", "DC"])
def test_a_written_neck_is_read_back(tmp_path, measurements, ending):
    neck, file = neck_section(measurements), tmp_path / f"neck.{ending}"
    write_neck(neck, file)
    again = drawn_neck(file)
    assert again.upper_mark == pytest.approx(neck.upper_mark, abs=1e-6)
    for wall in ("upper_wall", "lower_wall"):
        before, after = getattr(neck, wall), getattr(again, wall)
        assert after.length == pytest.approx(before.length, abs=1e-5)
        assert np.sum(after.curvature != 0) == np.sum(before.curvature != 0)
        assert np.abs(after.project(before.sampled(0.2)).distance).max() < 1e-6
        assert np.abs(before.project(after.sampled(0.2)).distance).max() < 1e-6


def test_another_ending_is_refused(tmp_path):
    with pytest.raises(DrawingError, match=r"must end in .svg or .dxf"):
        write_neck(neck_section(), tmp_path / "neck.step")
