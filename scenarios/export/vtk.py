"""A run as a time series for ParaView: VTK's XML files, one pair for each increment.

Open ``run.pvd``. Positions are in the head frame, mm; the lips carry ``displacement_mm``, so that
ParaView's filter Warp by Vector moves them. The format is that of the VTK File Formats guide
("XML file formats"); arrays are inline and base64-encoded.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress
from geometry2d.rigid import UNMOVED, RigidPlacement
from scenarios.results.increment import SectionModel
from scenarios.results.quantities import IN_NECK_FRAME, JAW_HINGE, WITH_JAW
from scenarios.results.solution import Snapshot, Solution

Arrays = Mapping[str, NDArray[Any]]

POLYLINE, QUADRATIC_TRIANGLE = 4, 22
"""VTK's cell types; the nodes of its quadratic triangle are in the order of `SectionModel`."""

OPEN = ("profile",)
"""Outlines whose last point is not joined to the first."""

TYPES = {"float64": "Float64", "float32": "Float32", "int32": "Int32", "uint8": "UInt8"}


def export_vtk(run: Path, out: Path, *, progress: Progress = lambda share, text: None) -> None:
    """Write a run directory as ``run.pvd`` and its ``.vtu`` files into the directory ``out``.

    Raises
    ------
    SolutionError
        If ``run`` is not a run directory.
    OutputError
        If ``out`` may not be replaced.
    """
    solution = Solution.load(run)
    with directory_at_once(out) as partial:
        entries = []
        for index, time in enumerate(solution.time_s):
            progress(index / solution.time_s.size, f"increment {index + 1}")
            frame = solution.snapshot(index)
            texts = (
                lips_vtu(solution.model, frame),
                rigid_vtu(solution.model, frame.placement, frame.jaw),
            )
            for part, (name, text) in enumerate(zip(("lips", "rigid"), texts, strict=True)):
                file = f"{name}_{index:04d}.vtu"
                (partial / file).write_text(text, encoding="ascii")
                entries.append(f'<DataSet timestep="{time:.9g}" part="{part}" file="{file}"/>')
        (partial / "run.pvd").write_text(_file("Collection", entries), encoding="ascii")
        # What holds this file is known as a result, and may be replaced by the next export.
        (partial / "summary.json").write_bytes((run / "summary.json").read_bytes())


def lips_vtu(model: SectionModel, frame: Snapshot) -> str:
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


def rigid_vtu(model: SectionModel, neck: RigidPlacement, jaw: RigidPlacement = UNMOVED) -> str:
    """Return neck, teeth and jaws at one instant, as lines; cells are numbered by ``outline``."""
    lines, cells, start = [], [], 0
    for name, line in sorted(model.outlines.items()):
        if name == JAW_HINGE:
            continue
        placed = neck.apply(line) if name in IN_NECK_FRAME else line
        lines.append(jaw.apply(line) if name in WITH_JAW and jaw != UNMOVED else placed)
        nodes = np.arange(start, start + len(line))
        cells.append(nodes if name in OPEN else np.append(nodes, start))
        start += len(line)
    points = np.vstack(lines) if lines else np.zeros((0, 2))
    return _unstructured(
        points, cells, POLYLINE, {}, {"outline": np.arange(len(cells), dtype=np.int32)}
    )


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
) -> str:
    connectivity = np.concatenate([np.zeros(0, np.int32), *cells]).astype(np.int32)
    offsets = np.cumsum([len(cell) for cell in cells], dtype=np.int32)
    types = np.full(len(cells), cell_type, np.uint8)
    topology: Arrays = {"connectivity": connectivity, "offsets": offsets, "types": types}
    piece = [
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">',
        *_block("Points", {"position_mm": _in_space(points)}),
        *_block("Cells", topology),
        *_block("PointData", point_data),
        *_block("CellData", cell_data),
        "</Piece>",
    ]
    return _file("UnstructuredGrid", piece)


def _block(name: str, arrays: Arrays) -> list[str]:
    return [f"<{name}>", *(_array(key, values) for key, values in arrays.items()), f"</{name}>"]


def _array(name: str, values: NDArray[Any]) -> str:
    """Return a data array: its length in bytes as a 64-bit integer, then its values."""
    kind = TYPES[values.dtype.name]
    data = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).tobytes()
    coded = base64.b64encode(np.uint64(len(data)).astype("<u8").tobytes() + data).decode("ascii")
    components = values.shape[1] if values.ndim > 1 else 1
    return (
        f'<DataArray type="{kind}" Name={quoteattr(name)} NumberOfComponents="{components}" '
        f'format="binary">{coded}</DataArray>'
    )


def _in_space(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) vectors of the plane z = 0."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _file(kind: str, lines: Sequence[str]) -> str:
    attributes = 'version="1.0" byte_order="LittleEndian" header_type="UInt64"'
    head = f'<?xml version="1.0"?>\n<VTKFile type="{kind}" {attributes}>\n<{kind}>'
    return "\n".join([head, *lines, f"</{kind}>", "</VTKFile>", ""])
