"""A run as a time series for ParaView: named blocks in VTK's XML files, some for each increment.

Open ``run.pvd``. Positions are in the head frame, mm. ``lips`` and both skins carry
``displacement_mm``, so that ParaView's filter Warp by Vector moves them; neck and jaw are placed
where they are at each instant. The format is that of the VTK File Formats guide ("XML file
formats"); arrays are appended and compressed with zlib.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.results.increment import SectionModel
from scenarios.results.quantities import CONTACT_FIELDS, IN_NECK_FRAME, JAW_HINGE, WITH_JAW
from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Snapshot, Solution

Arrays = Mapping[str, NDArray[Any]]

POLYLINE, QUADRATIC_TRIANGLE = 4, 22
"""VTK's cell types; the nodes of its quadratic triangle are in the order of `SectionModel`."""

OPEN = ("profile",)
"""Outlines whose last point is not joined to the first."""

TYPES = {"float64": "Float64", "float32": "Float32", "int32": "Int32", "uint8": "UInt8"}

LEVEL = 6
"""Of zlib."""


def export_vtk(run: Path, out: Path, *, progress: Progress = no_progress) -> None:
    """Write a run directory as ``run.pvd`` and the files that it names into the directory ``out``.

    Raises
    ------
    SolutionError
        If ``run`` is not a run directory.
    OutputError
        If ``out`` may not be replaced.
    """
    solution = Solution.load(run)
    model = solution.model
    with directory_at_once(out) as partial:
        still = {}
        for name in _outlines(model):
            if name not in (*IN_NECK_FRAME, *WITH_JAW):
                still[name] = f"{name}.vtu"
                (partial / still[name]).write_bytes(outline_vtu(name, model.outlines[name]))
        entries = []
        for index, time in enumerate(solution.time_s):
            progress(index / solution.time_s.size, f"increment {index + 1}")
            blocks = {}
            for name, data in _moving(solution, index):
                blocks[name] = f"{name}_{index:04d}.vtu"
                (partial / blocks[name]).write_bytes(data)
            step = f"step_{index:04d}.vtm"
            (partial / step).write_text(_named(blocks | still), encoding="ascii")
            entries.append(f'<DataSet timestep="{time:.9g}" part="0" file="{step}"/>')
        (partial / "run.pvd").write_text(_collection(entries), encoding="ascii")
        # What holds this file is known as a result, and may be replaced by the next export.
        (partial / "summary.json").write_bytes((run / "summary.json").read_bytes())


def _moving(solution: Solution, index: int) -> Iterator[tuple[str, bytes]]:
    """Yield name and file of every block that changes from increment to increment."""
    model, snapshot = solution.model, solution.snapshot(index)
    yield "lips", lips_vtu(model, snapshot)
    for lip in solution.contact:
        yield f"{lip}_skin", skin_vtu(solution, lip, index)
    for name in _outlines(model):
        if name in IN_NECK_FRAME:
            yield name, outline_vtu(name, snapshot.placement.apply(model.outlines[name]))
        elif name in WITH_JAW:
            yield name, outline_vtu(name, snapshot.jaw.apply(model.outlines[name]))


def _outlines(model: SectionModel) -> list[str]:
    return sorted(model.outlines.keys() - {JAW_HINGE})


def lips_vtu(model: SectionModel, frame: Snapshot) -> bytes:
    """Return the lips at one instant: undeformed nodes, displacements, element fields."""
    return _unstructured(
        model.nodes,
        list(_counter_clockwise(model)),
        QUADRATIC_TRIANGLE,
        {"displacement_mm": _in_space(frame.displacement)},
        {
            **{name: values.astype(np.float32) for name, values in frame.element.items()},
            "region": np.asarray(model.region, np.int32),
        },
    )


def skin_vtu(solution: Solution, lip: str, index: int) -> bytes:
    """Return the skin of a lip at an increment: a line whose points carry the contact.

    Beside the contact fields of ``fields.h5`` its points carry ``slip_mm``: how far each slid along
    the neck's contour since the increment before, 0 where it did not touch in both.
    """
    model, along = solution.model, solution.contact[lip]
    line = SkinLine(model, model.skin[lip], along.arc_mm)
    moved = line.points(solution.fields.displacement(index))
    fields = {
        quantity.name: along.fields[quantity.name][index].astype(np.float32)
        for quantity in CONTACT_FIELDS
    }
    points = line.points(model.nodes)
    return _unstructured(
        points,
        [np.arange(len(points))],
        POLYLINE,
        {
            "displacement_mm": _in_space(moved),
            **fields,
            "slip_mm": slip_mm(along.fields["neck_arc_mm"], index).astype(np.float32),
        },
        {},
    )


def slip_mm(neck_arc_mm: NDArray[np.float64], index: int) -> NDArray[np.float64]:
    """Return how far points (s,) slid along the neck's contour in an increment of (k, s), mm."""
    if index == 0:
        return np.zeros(neck_arc_mm.shape[1])
    slid: NDArray[np.float64] = np.nan_to_num(neck_arc_mm[index] - neck_arc_mm[index - 1], nan=0.0)
    return slid


def outline_vtu(name: str, line: NDArray[np.float64]) -> bytes:
    """Return an outline, closed unless it is one of :data:`OPEN`, as a line."""
    nodes = np.arange(len(line))
    cell = nodes if name in OPEN else np.append(nodes, 0)
    return _unstructured(line, [cell], POLYLINE, {}, {})


def _counter_clockwise(model: SectionModel) -> NDArray[np.int64]:
    """Return the triangles (e, 6) with their corners counter-clockwise, as the format wants them.

    The mesh numbers corners by the size of their node numbers, whichever way round that is.
    """
    triangles = np.array(model.triangles)
    first, second, third = (model.nodes[triangles[:, corner]] for corner in range(3))
    a, b = second - first, third - first
    clockwise = a[:, 0] * b[:, 1] < a[:, 1] * b[:, 0]
    triangles[clockwise] = triangles[clockwise][:, [0, 2, 1, 5, 4, 3]]
    return triangles


def _unstructured(
    points: NDArray[np.float64],
    cells: Sequence[NDArray[np.int64]],
    cell_type: int,
    point_data: Arrays,
    cell_data: Arrays,
) -> bytes:
    connectivity = np.concatenate(cells).astype(np.int32)
    offsets = np.cumsum([len(cell) for cell in cells], dtype=np.int32)
    types = np.full(len(cells), cell_type, np.uint8)
    topology: Arrays = {"connectivity": connectivity, "offsets": offsets, "types": types}
    held: list[bytes] = []
    piece = [
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">',
        *_block("Points", {"position_mm": _in_space(points)}, held),
        *_block("Cells", topology, held),
        *_block("PointData", point_data, held),
        *_block("CellData", cell_data, held),
        "</Piece>",
    ]
    grid = ["<UnstructuredGrid>", *piece, "</UnstructuredGrid>", '<AppendedData encoding="raw">']
    text = "\n".join([_head("UnstructuredGrid"), *grid, "_"])
    return text.encode("ascii") + b"".join(held) + b"\n</AppendedData>\n</VTKFile>\n"


def _block(name: str, arrays: Arrays, held: list[bytes]) -> list[str]:
    return [
        f"<{name}>",
        *(_array(key, values, held) for key, values in arrays.items()),
        f"</{name}>",
    ]


def _array(name: str, values: NDArray[Any], held: list[bytes]) -> str:
    """Return the element of an array, and add its data to ``held``.

    Data are one block: four 64-bit integers (number of blocks, length of the block, of a last one
    that is shorter, here none, and of the compressed block), then the compressed block.
    """
    data = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes()
    block = zlib.compress(data, LEVEL)
    offset = sum(map(len, held))
    held.append(np.array([1, len(data), 0, len(block)], "<u8").tobytes() + block)
    # Without the attribute there is one; meshio makes columns of what states it.
    components = f'NumberOfComponents="{values.shape[1]}" ' if values.ndim > 1 else ""
    return (
        f'<DataArray type="{TYPES[values.dtype.name]}" Name={quoteattr(name)} '
        f'{components}format="appended" offset="{offset}"/>'
    )


def _in_space(vectors: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return (n, 3) vectors of the plane z = 0, to a nanometre and in single precision."""
    return np.column_stack([vectors.round(6), np.zeros(len(vectors))]).astype(np.float32)


def _named(blocks: Mapping[str, str]) -> str:
    """Return the file that names the blocks of one instant."""
    sets = [
        f'<DataSet index="{number}" name={quoteattr(name)} file={quoteattr(file)}/>'
        for number, (name, file) in enumerate(blocks.items())
    ]
    kind = "vtkMultiBlockDataSet"
    return "\n".join([_head(kind), f"<{kind}>", *sets, f"</{kind}>", "</VTKFile>", ""])


def _collection(entries: Sequence[str]) -> str:
    return "\n".join(
        [_head("Collection"), "<Collection>", *entries, "</Collection>", "</VTKFile>", ""]
    )


def _head(kind: str) -> str:
    attributes = (
        'version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor"'
    )
    return f'<?xml version="1.0"?>\n<VTKFile type="{kind}" {attributes}>'
