"""Export for ParaView: what is read back is what was computed."""

from __future__ import annotations

import base64
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from scenarios.cli.main import main
from scenarios.export.vtk import QUADRATIC_TRIANGLE, lips_vtu
from scenarios.results.solution import Solution


@pytest.fixture(scope="module")
def exported(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("vtk") / "paraview"
    assert main(["export", str(run_directory), "--out", str(out), "--format", "vtk"]) == 0
    return out


def arrays(file: Path) -> dict[str, np.ndarray]:
    """Read a .vtu by the rules of the format: a length in bytes, then the values."""
    root = ElementTree.parse(file).getroot()
    assert root.attrib["header_type"] == "UInt64"
    found = {}
    for element in root.iter("DataArray"):
        data = base64.b64decode(element.text or "")
        assert int(np.frombuffer(data[:8], "<u8")[0]) == len(data) - 8
        values = np.frombuffer(data[8:], np.dtype(element.attrib["type"].lower()))
        components = int(element.attrib["NumberOfComponents"])
        found[element.attrib["Name"]] = values.reshape(-1, components).squeeze()
    return found


def test_every_increment_is_there_at_its_time(exported: Path, run_directory: Path) -> None:
    sets = list(ElementTree.parse(exported / "run.pvd").getroot().iter("DataSet"))
    times = Solution.load(run_directory).time_s
    assert [float(s.attrib["timestep"]) for s in sets] == pytest.approx(np.repeat(times, 2))
    assert all((exported / s.attrib["file"]).is_file() for s in sets)


def test_lips_are_read_back(exported: Path, run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    found = arrays(exported / "lips_0005.vtu")
    frame = solution.snapshot(5)
    np.testing.assert_array_equal(found["position_mm"][:, :2], solution.model.nodes)
    np.testing.assert_array_equal(found["displacement_mm"][:, :2], frame.displacement)
    assert np.abs(frame.displacement).max() > 1.0
    np.testing.assert_array_equal(
        np.sort(found["connectivity"].reshape(-1, 6)), np.sort(solution.model.triangles)
    )
    np.testing.assert_array_equal(found["von_mises_mpa"], frame.element["von_mises_mpa"])
    assert set(found["types"]) == {QUADRATIC_TRIANGLE}


def test_middle_nodes_lie_between_the_corners_that_the_format_says(exported: Path) -> None:
    found = arrays(exported / "lips_0000.vtu")
    corner = found["position_mm"][found["connectivity"].reshape(-1, 6)]
    for middle, (first, last) in ((3, (0, 1)), (4, (1, 2)), (5, (2, 0))):
        np.testing.assert_allclose(corner[:, middle], (corner[:, first] + corner[:, last]) / 2)


def test_triangles_run_counter_clockwise(run_directory: Path, tmp_path: Path) -> None:
    solution = Solution.load(run_directory)
    other_way = np.array(solution.model.triangles)
    other_way[::2] = other_way[::2][:, [0, 2, 1, 5, 4, 3]]
    model = replace(solution.model, triangles=other_way)

    def twice_the_area(triangles: np.ndarray) -> np.ndarray:
        first, second, third = (model.nodes[triangles[:, corner]] for corner in range(3))
        return np.linalg.det(np.stack([second - first, third - first], axis=1))

    assert np.ptp(np.sign(twice_the_area(other_way))) == 2
    file = tmp_path / "lips.vtu"
    file.write_text(lips_vtu(model, solution.snapshot(5)))
    triangles = arrays(file)["connectivity"].reshape(-1, 6)
    assert np.all(twice_the_area(triangles) > 0)
    nodes = model.nodes[triangles]
    for middle, (first, last) in ((3, (0, 1)), (4, (1, 2)), (5, (2, 0))):
        np.testing.assert_allclose(nodes[:, middle], (nodes[:, first] + nodes[:, last]) / 2)


def test_the_neck_moves_and_teeth_stand_still(exported: Path, run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    first, last = (arrays(exported / f"rigid_{index:04d}.vtu") for index in (0, 10))
    moved = np.abs(first["position_mm"] - last["position_mm"]).max(axis=1)
    starts = np.concatenate([[0], first["offsets"][:-1]])
    for name, start, end in zip(
        sorted(solution.model.outlines), starts, first["offsets"], strict=True
    ):
        nodes = first["connectivity"][start:end]
        assert (moved[nodes].max() > 0.5) == name.endswith("wall")
        assert (nodes[0] == nodes[-1]) == (name != "profile")


def test_a_folder_that_is_no_run_has_no_deck(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run.inp"
    assert main(["export", str(tmp_path), "--format", "abaqus", "--out", str(out)]) == 2
    assert str(tmp_path) in capsys.readouterr().err
    assert not out.exists()
