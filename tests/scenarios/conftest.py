"""A made-up run, as small as it can be: test data, not a result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geometry2d.rigid import RigidPlacement
from scenarios.solution import HISTORY, ContactField, Increment, Model
from scenarios.writer import SolutionWriter

UPPER_MOUTH = np.array([104.0, -26.0])
LOWER_MOUTH = np.array([102.0, -38.0])


def block(
    corner: np.ndarray, size: tuple[float, float], cells: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and quadratic triangles of a rectangle divided into ``cells``."""
    nx, ny = (2 * cells[0] + 1, 2 * cells[1] + 1)
    x, y = np.meshgrid(np.linspace(0, size[0], nx), np.linspace(0, size[1], ny), indexing="ij")
    nodes = np.column_stack([x.ravel(), y.ravel()]) + corner

    def at(i: int, j: int) -> int:
        return i * ny + j

    triangles = []
    for i in range(0, nx - 1, 2):
        for j in range(0, ny - 1, 2):
            a, b, c, d = at(i, j), at(i + 2, j), at(i + 2, j + 2), at(i, j + 2)
            middle = at(i + 1, j + 1)
            triangles.append([a, b, c, at(i + 1, j), at(i + 2, j + 1), middle])
            triangles.append([a, c, d, middle, at(i + 1, j + 2), at(i, j + 1)])
    return nodes, np.array(triangles)


def edges_on(nodes: np.ndarray, triangles: np.ndarray, y: float, *, rightward: bool) -> np.ndarray:
    """Return (first, last, middle) of the edges along a horizontal line, in order."""
    found = []
    for element in triangles:
        for first, last, middle in ((0, 1, 3), (1, 2, 4), (2, 0, 5)):
            edge = element[[first, last, middle]]
            if np.allclose(nodes[edge, 1], y):
                order = (
                    edge
                    if (nodes[edge[1], 0] > nodes[edge[0], 0]) == rightward
                    else edge[[1, 0, 2]]
                )
                found.append(order)
    found.sort(key=lambda edge: nodes[edge[2], 0] * (1 if rightward else -1))
    return np.array(found)


def small_model() -> Model:
    """Return two blocks, an upper and a lower lip, with a dermis on the sides that face."""
    upper, upper_triangles = block(UPPER_MOUTH - [24.0, 0.0], (24.0, 12.0), (16, 8))
    lower, lower_triangles = block(LOWER_MOUTH - [24.0, 12.0], (24.0, 12.0), (16, 8))
    nodes = np.vstack([upper, lower])
    triangles = np.vstack([upper_triangles, lower_triangles + len(upper)])
    centre = nodes[triangles[:, :3]].mean(axis=1)
    is_upper = np.arange(len(triangles)) < len(upper_triangles)
    is_dermis = np.where(
        is_upper, centre[:, 1] < UPPER_MOUTH[1] + 1.5, centre[:, 1] > LOWER_MOUTH[1] - 1.5
    )
    region = np.where(is_upper, np.where(is_dermis, 0, 1), np.where(is_dermis, 2, 3))
    ring = np.linspace(0, 2 * np.pi, 61)
    wall = np.column_stack([9.0 * np.cos(ring), 1.2 * np.sin(ring)])
    tooth = np.column_stack([3.0 * np.cos(ring), 5.0 * np.sin(ring)])
    return Model(
        nodes=nodes,
        triangles=triangles,
        region=region,
        region_names=("upper_dermis", "upper_bulk", "lower_dermis", "lower_bulk"),
        skin={
            "upper": edges_on(nodes, triangles, UPPER_MOUTH[1], rightward=True),
            "lower": edges_on(nodes, triangles, LOWER_MOUTH[1], rightward=False),
        },
        outlines={
            "upper_wall": wall + np.array([0.0, 12.0]),
            "lower_wall": wall,
            "upper_tooth": tooth + UPPER_MOUTH + [-28.0, 2.0],
            "lower_tooth": tooth + LOWER_MOUTH + [-28.0, -2.0],
            "profile": np.array(
                [[95.0, 40], [118, 5], [105, -10], [104, -26], [102, -38], [96, -60]]
            ),
        },
    )


def small_increment(model: Model, index: int, count: int) -> Increment:
    """Return increment ``index`` of ``count``: both lips are pressed in and let go."""
    share = index / (count - 1)
    press = float(np.sin(np.pi * share) ** 2)
    x, y = model.nodes.T
    upper = y > (UPPER_MOUTH[1] + LOWER_MOUTH[1]) / 2
    bump = press * np.exp(-(((x - 95.0) / 5.0) ** 2))
    displacement = np.zeros_like(model.nodes)
    depth = np.where(upper, (y - UPPER_MOUTH[1]) / 12.0, (LOWER_MOUTH[1] - y) / 12.0)
    displacement[:, 1] = np.where(upper, 2.5, -2.5) * bump * (1 - depth)
    stress = 0.08 * bump[model.triangles].mean(axis=1)
    contact = {}
    for lip in model.skin:
        arc = np.linspace(0.0, 24.0, 97)
        place = (80.0 + arc) if lip == "upper" else 102.0 - arc
        pressure = 0.06 * press * np.clip(1 - ((place - 95.0) / 3.0) ** 2, 0, None)
        contact[lip] = ContactField(
            arc_mm=arc,
            pressure_mpa=pressure,
            shear_mpa=0.3 * pressure,
            gap_mm=np.where(pressure > 0, 0.0, 1.0),
            neck_arc_mm=np.where(pressure > 0, place - 85.0, np.nan),
        )
    derived = (
        "time_s",
        "relative_time",
        "package_x_mm",
        "package_y_mm",
        "package_theta_deg",
        "newton_iterations",
        "cutbacks",
    )
    history = {q.name: 60.0 * press for q in HISTORY if q.name not in derived}
    history["dermis_min_log_strain"] = -0.4 * press
    history["dermis_max_log_strain"] = 0.2 * press
    history["lower_lip_pressure_kpa"] = 25.0 * press
    return Increment(
        time_s=1.0 + 0.1 * index,
        relative_time=share,
        placement=RigidPlacement(0.2 * share, (95.0 + 2 * (1 - press), -38.0)),
        displacement=displacement,
        element={"log_strain_min": -stress, "log_strain_max": stress, "von_mises_mpa": stress},
        contact=contact,
        history=history,
        newton_iterations=3,
        cutbacks=int(index == 4),
        state={"stick": np.full(3, float(index))},
    )


COUNT = 11


@pytest.fixture(scope="session")
def model() -> Model:
    return small_model()


@pytest.fixture(scope="session")
def increments(model: Model) -> list[Increment]:
    return [small_increment(model, index, COUNT) for index in range(COUNT)]


@pytest.fixture(scope="session")
def run_directory(
    tmp_path_factory: pytest.TempPathFactory, model: Model, increments: list[Increment]
) -> Path:
    """A finished run without a recording."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    writer = SolutionWriter(folder, 'name = "made up"\n', resume=False)
    writer.model(model)
    for increment in increments:
        writer.commit(increment)
    return writer.finish(finished=True, sentence="all of it", about={})
