"""A made-up sip, as small as it can be: test data, not a result."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from geometry2d.rigid import RigidPlacement
from mocap.synthetic.recording_file import write_recording
from scenarios.results.fields_file import FIELDS_FILE
from scenarios.results.increment import ContactField, Increment, SectionModel
from scenarios.results.integrity import FILES, ITSELF, sealed
from scenarios.results.quantities import HISTORY, LATER_FIELDS, LIPS
from scenarios.results.solution import Solution
from scenarios.results.summary import SUMMARY_FILE
from scenarios.settings.scenario import Scenario
from scenarios.sip.replay import Outcome

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
    edges = triangles[:, [[0, 1, 3], [1, 2, 4], [2, 0, 5]]].reshape(-1, 3)
    edges = edges[np.isclose(nodes[edges, 1], y).all(axis=1)]
    backward = (nodes[edges[:, 1], 0] > nodes[edges[:, 0], 0]) != rightward
    edges[backward] = edges[backward][:, [1, 0, 2]]
    along = nodes[edges[:, 2], 0] * (1 if rightward else -1)
    return edges[np.argsort(along, kind="stable")]


def small_model() -> SectionModel:
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
    return SectionModel(
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


def small_increment(model: SectionModel, index: int, count: int) -> Increment:
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
    history |= {f"{lip}_lip_crest_contrast": 0.4 * press for lip in LIPS}
    history["liquid_kpa"] = 0.0
    history["dermis_min_log_strain"] = -0.4 * press
    history["dermis_max_log_strain"] = 0.2 * press
    history["lower_lip_pressure_kpa"] = 25.0 * press
    history["lower_lip_window_kpa"] = 20.0 * press
    return Increment(
        time_s=1.0 + 0.1 * index,
        relative_time=share,
        placement=RigidPlacement(0.2 * share, (95.0 + 2 * (1 - press), -38.0)),
        displacement=displacement,
        element={
            "log_strain_min": -stress,
            "log_strain_max": stress,
            "von_mises_mpa": stress,
            "thickness_stretch": 1.0 + 2.0 * stress,
            "activation": np.where(np.isin(model.region, (1, 3)), 0.5 * press, 0.0),
        },
        contact=contact,
        history=history,
        newton_iterations=3,
        cutbacks=int(index == 4),
        checkpoint={"stick": np.full(3, float(index))},
    )


COUNT = 11


def world_motion(time: np.ndarray) -> dict[str, np.ndarray]:
    """Return columns of motion.csv: the head nods by 3 degrees, the package by 5."""
    share = (time - time[0]) / (time[-1] - time[0])
    zero = np.zeros_like(time)
    return {
        "time_s": time,
        "head_x_mm": 2.0 * share,
        "head_y_mm": -1.0 * share,
        "head_theta_deg": 3.0 * share,
        "package_x_mm": 110.0 - 12.0 * share,
        "package_y_mm": -60.0 + 9.0 * share,
        "package_theta_deg": 5.0 * share,
        "rel_x_mm": zero,
        "rel_y_mm": zero,
        "rel_theta_deg": zero,
        "sigma_x_mm": zero,
        "sigma_y_mm": zero,
        "sigma_theta_deg": zero,
    }


PICTURE_ORIGIN, PICTURE_SCALE = np.array([90.0, 80.0]), 1.5


def write_motion(folder: Path, *, tracked: bool) -> Path:
    """Write motion.csv, and the tracks.csv it could have come from; return the former."""
    columns = world_motion(np.arange(0.8, 2.4, 0.04))
    folder.mkdir(parents=True)
    with (folder / "motion.csv").open("w") as stream:
        stream.write(",".join(columns) + "\n")
        np.savetxt(stream, np.column_stack(list(columns.values())), delimiter=",", fmt="%.9g")
    if tracked:
        with (folder / "tracks.csv").open("w") as stream:
            stream.write("frame,time_s,marker,x_px,y_px,sigma_px,status\n")
            rows = zip(
                *(columns[n] for n in ("time_s", "package_x_mm", "package_y_mm")), strict=True
            )
            for frame, (time, x, y) in enumerate(rows):
                px, py = PICTURE_ORIGIN + PICTURE_SCALE * np.array([x, -y])
                stream.write(f"{frame},{time:.4f},package_lower,{px:.4f},{py:.4f},0.02,seen\n")
    return folder / "motion.csv"


MARKERS = """
[scale]
package = 14.0
[markers]
package_lower = [255.0, 170.0]
[recording]
rendered = true
"""


def resealed(run: Path) -> Path:
    """Return a run directory whose files were changed, as if it had been finished with them."""
    file = run / SUMMARY_FILE
    summary = json.loads(file.read_text(encoding="utf-8"))
    content = {name: value for name, value in summary.items() if name not in (FILES, ITSELF)}
    file.write_text(json.dumps(sealed(content, run)), encoding="utf-8")
    return run


def write_small_recording(folder: Path) -> None:
    """Write a recording whose pictures count: their red channel is four times the frame number."""
    folder.mkdir(parents=True, exist_ok=True)
    times = np.arange(0.8, 2.4, 0.04)
    pictures = [np.full((200, 320, 3), 96, np.uint8) for _ in times]
    for number, picture in enumerate(pictures):
        picture[:, :, 0] = 40 + 4 * number
        picture[130:140, 200:260] = 20
    write_recording(folder / "recording.mp4", pictures, times, crf=10.0)
    (folder / "markers.toml").write_text(MARKERS)


def earlier_version(run: Path, out: Path) -> Path:
    """Return a copy of a run directory as a version without the later fields left it."""
    shutil.copytree(run, out)
    with h5py.File(out / FIELDS_FILE, "r+") as store:
        for name in LATER_FIELDS:
            del store[f"element/{name}"]
    return resealed(out)


class MadeUpReplay:
    """Stands in for the solver: replays the made-up sip, up to a given increment."""

    def __init__(self, until: int = COUNT, *, interrupted: bool = False) -> None:
        self.until, self.interrupted = until, interrupted

    def __call__(
        self,
        scenario: Scenario,
        *,
        on_model: Callable[[SectionModel], None],
        on_increment: Callable[[Increment], None],
        resume_from: Increment | None = None,
        reference: Solution | None = None,
        threads: object = None,
        warn: object = None,
        progress: object,
        **_: object,
    ) -> Outcome:
        model = small_model()
        if resume_from is None:
            on_model(model)
        first = 0 if resume_from is None else round(10 * resume_from.relative_time) + 1
        for index in range(first, self.until):
            on_increment(small_increment(model, index, COUNT))
        if self.interrupted:
            raise KeyboardInterrupt
        return Outcome(self.until == COUNT, (f"{self.until} of {COUNT}",), {"elements": 7})
