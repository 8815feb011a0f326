"""Export for ParaView: what is read back is what was computed."""

from __future__ import annotations

import re
import zlib
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from scenarios.cli.main import main
from scenarios.export.vtk import QUADRATIC_TRIANGLE, lips_vtu, slip_mm
from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Solution
from tests.support.optional import needed_module

BLOCKS = {
    "lips", "upper_skin", "lower_skin", "upper_wall", "lower_wall", "upper_tooth", "lower_tooth",
    "profile",
}  # fmt: skip


@pytest.fixture(scope="module")
def exported(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("vtk") / "paraview"
    assert main(["export", str(run_directory), "--out", str(out), "--format", "vtk"]) == 0
    return out


def arrays(file: Path) -> dict[str, np.ndarray]:
    """Read a .vtu by the rules of the format: the header of a compressed block, then the block."""
    whole = file.read_bytes()
    head, data = re.split(rb'<AppendedData encoding="raw">\n_', whole, maxsplit=1)
    root = ElementTree.fromstring(head + b"</VTKFile>")
    assert root.attrib["header_type"] == "UInt64"
    found = {}
    for element in root.iter("DataArray"):
        block = data[int(element.attrib["offset"]) :]
        blocks, length, partial, packed = np.frombuffer(block[:32], "<u8").tolist()
        assert (blocks, partial) == (1, 0)
        raw = zlib.decompress(block[32 : 32 + packed])
        assert len(raw) == length
        values = np.frombuffer(raw, np.dtype(element.attrib["type"].lower()))
        components = int(element.attrib.get("NumberOfComponents", 1))
        found[element.attrib["Name"]] = values.reshape(-1, components).squeeze()
    return found


def test_every_increment_is_there_at_its_time(exported: Path, run_directory: Path) -> None:
    sets = list(ElementTree.parse(exported / "run.pvd").getroot().iter("DataSet"))
    times = Solution.load(run_directory).time_s
    assert [float(s.attrib["timestep"]) for s in sets] == pytest.approx(times)
    for step in sets:
        named = ElementTree.parse(exported / step.attrib["file"]).getroot().iter("DataSet")
        blocks = {block.attrib["name"]: exported / block.attrib["file"] for block in named}
        assert blocks.keys() == BLOCKS
        assert all(file.is_file() for file in blocks.values())


def test_lips_are_read_back(exported: Path, run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    found = arrays(exported / "lips_0005.vtu")
    frame = solution.snapshot(5)
    nodes, moved = solution.model.nodes, frame.displacement
    np.testing.assert_allclose(found["position_mm"][:, :2], nodes, atol=8e-6)
    np.testing.assert_allclose(found["displacement_mm"][:, :2], moved, atol=1e-6)
    assert np.abs(frame.displacement).max() > 1.0
    np.testing.assert_array_equal(
        np.sort(found["connectivity"].reshape(-1, 6)), np.sort(solution.model.triangles)
    )
    np.testing.assert_array_equal(found["von_mises_mpa"], frame.element["von_mises_mpa"])
    assert set(found["types"]) == {QUADRATIC_TRIANGLE}


@pytest.mark.parametrize("lip", ["upper", "lower"])
def test_the_skin_carries_the_contact(exported: Path, run_directory: Path, lip: str) -> None:
    solution = Solution.load(run_directory)
    found = arrays(exported / f"{lip}_skin_0005.vtu")
    along = solution.contact[lip]
    for name in ("pressure_mpa", "shear_mpa", "gap_mm", "neck_arc_mm"):
        np.testing.assert_array_equal(found[name], along.fields[name][5].astype(np.float32))
    assert found["pressure_mpa"].max() > 0.05
    line = SkinLine(solution.model, solution.model.skin[lip], along.arc_mm)
    moved = line.points(solution.model.nodes + solution.snapshot(5).displacement)
    deformed = (found["position_mm"] + found["displacement_mm"])[:, :2]
    np.testing.assert_allclose(deformed, moved, atol=2e-5)


def test_slip_is_told_where_a_point_touches_twice() -> None:
    arc = np.array([[1.0, 2.0, np.nan], [1.5, np.nan, 3.0]])
    np.testing.assert_array_equal(slip_mm(arc, 0), [0.0, 0.0, 0.0])
    np.testing.assert_array_equal(slip_mm(arc, 1), [0.5, 0.0, 0.0])


def test_other_programs_read_the_same(exported: Path, run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    pyvista, meshio = needed_module("pyvista"), needed_module("meshio")
    reader = pyvista.get_reader(str(exported / "run.pvd"))
    assert reader.time_values == pytest.approx(solution.time_s.tolist())
    reader.set_active_time_value(reader.time_values[5])
    step = reader.read()[0]
    assert set(step.keys()) == BLOCKS
    pressure = solution.contact["upper"].fields["pressure_mpa"][5]
    np.testing.assert_allclose(step["upper_skin"].point_data["pressure_mpa"], pressure, rtol=1e-6)
    grid = meshio.read(exported / "lips_0005.vtu")
    mises = solution.snapshot(5).element["von_mises_mpa"]
    np.testing.assert_allclose(grid.cell_data["von_mises_mpa"][0], mises, rtol=1e-6)
    assert grid.cells[0].type == "triangle6"
    np.testing.assert_allclose(step["lips"].points, grid.points)
    neck = [reader.read()[0]["lower_wall"].points.mean(axis=0)]
    reader.set_active_time_value(reader.time_values[9])
    neck.append(reader.read()[0]["lower_wall"].points.mean(axis=0))
    assert np.hypot(*(neck[1] - neck[0])[:2]) > 0.3


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
    file.write_bytes(lips_vtu(model, solution.snapshot(5)))
    triangles = arrays(file)["connectivity"].reshape(-1, 6)
    assert np.all(twice_the_area(triangles) > 0)
    nodes = model.nodes[triangles]
    for middle, (first, last) in ((3, (0, 1)), (4, (1, 2)), (5, (2, 0))):
        np.testing.assert_allclose(nodes[:, middle], (nodes[:, first] + nodes[:, last]) / 2)


def test_the_neck_moves_and_teeth_stand_still(exported: Path, run_directory: Path) -> None:
    for name in ("upper_wall", "lower_wall"):
        first, last = (arrays(exported / f"{name}_{index:04d}.vtu") for index in (0, 10))
        assert np.abs(first["position_mm"] - last["position_mm"]).max() > 0.5
        assert first["connectivity"][0] == first["connectivity"][-1]
    assert (exported / "upper_tooth.vtu").is_file()
    profile = arrays(exported / "profile.vtu")
    assert profile["connectivity"][0] != profile["connectivity"][-1]


def test_a_folder_that_is_no_run_has_no_deck(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run.inp"
    assert main(["export", str(tmp_path), "--format", "abaqus", "--out", str(out)]) == 2
    assert str(tmp_path) in capsys.readouterr().err
    assert not out.exists()
