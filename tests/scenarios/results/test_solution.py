"""Runs on disk: what is written comes back, and a killed run loses nothing."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from geometry2d.foundation.output import OutputError
from geometry2d.rigid import UNMOVED
from scenarios.results.collector import SolutionCollector
from scenarios.results.increment import Increment, SectionModel, SolutionError
from scenarios.results.quantities import HISTORY
from scenarios.results.solution import Solution
from scenarios.results.writer import SolutionWriter
from scenarios.settings.scenario import load_scenario
from tests.support.optional import needed_module

TOML = 'name = "made up"\n'


def test_everything_written_comes_back(
    run_directory: Path, model: SectionModel, increments: list[Increment]
) -> None:
    solution = Solution.load(run_directory)
    assert solution.model.region_names == model.region_names
    np.testing.assert_array_equal(solution.model.triangles, model.triangles)
    np.testing.assert_array_equal(solution.model.skin["lower"], model.skin["lower"])
    for index in (0, 5, 10):
        written, frame = increments[index], solution.snapshot(index)
        assert frame.placement == written.placement
        np.testing.assert_array_equal(frame.displacement, written.displacement)
        np.testing.assert_allclose(
            frame.element["von_mises_mpa"], written.element["von_mises_mpa"], rtol=1e-6
        )
        np.testing.assert_array_equal(
            frame.pressure_mpa["upper"], written.contact["upper"].pressure_mpa
        )


def collected(model: SectionModel, increments: list[Increment]) -> Solution:
    collector = SolutionCollector()
    collector.model(model)
    for increment in increments:
        collector.commit(increment)
    scenario = load_scenario("A38-F")
    return collector.finish(scenario, finished=True, message="all of it", about={"elements": 7})


def test_a_snapshot_knows_where_a_jaw_that_turns_is(
    model: SectionModel, increments: list[Increment]
) -> None:
    still = collected(model, increments)
    assert still.snapshot(3).jaw == UNMOVED
    hinge = {"jaw_hinge": np.array([[11.0, 2.0]])}
    turning = dataclasses.replace(
        still,
        model=dataclasses.replace(model, outlines={**model.outlines, **hinge}),
        replayed=load_scenario(
            "A38-F",
            [
                f"head.jaw.time_s=[{still.time_s[0]}, {still.time_s[-1]}]",
                "head.jaw.opening_deg=[7.0, 10.0]",
            ],
        ),
    )
    assert turning.snapshot(0).jaw.angle_rad == 0.0
    last, middle = turning.snapshot(-1).jaw, turning.at(float(still.time_s[[0, -1]].mean())).jaw
    assert last.angle_rad == pytest.approx(np.deg2rad(-3.0))
    assert middle.angle_rad == pytest.approx(np.deg2rad(-1.5))
    assert last.apply([11.0, 2.0]) == pytest.approx([11.0, 2.0])


def test_a_solution_in_memory_equals_the_one_on_disk(
    run_directory: Path, model: SectionModel, increments: list[Increment]
) -> None:
    kept, loaded = collected(model, increments), Solution.load(run_directory)
    assert kept.folder is None
    assert kept.scenario.name == "A38-F"
    assert kept == loaded
    assert loaded == kept
    shorter = collected(model, increments[:-1])
    assert shorter != kept
    other = dataclasses.replace(increments[3], displacement=increments[3].displacement + 1e-12)
    assert collected(model, [*increments[:3], other, *increments[4:]]) != kept
    differing = {"wall_s", "scenario", "elements"}
    for name in kept.summary.keys() - differing:
        assert kept.summary[name] == loaded.summary[name]


def test_a_solution_is_told_in_a_line(
    run_directory: Path, model: SectionModel, increments: list[Increment]
) -> None:
    kept = collected(model, increments)
    assert repr(kept) == "<Solution A38-F: 11 increments, 1.00 to 2.00 s, in memory>"
    assert str(run_directory) in repr(Solution.load(run_directory))
    pressure = kept["upper_lip_window_kpa"]
    assert repr(pressure) == "<History upper_lip_window_kpa: 0 to 60 kPa, 1.00 to 2.00 s>"
    assert repr(kept.at(1.5)) == "<Snapshot at 1.500 s, contact pressure to 60.0 kPa>"


def test_outputs_have_names_units_and_values_between_increments(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    pressure = solution["upper_lip_pressure_kpa"]
    assert pressure.quantity.unit == "kPa"
    assert pressure.at(1.5) == pytest.approx(60.0)
    assert pressure.at(1.55) == pytest.approx((pressure.at(1.5) + pressure.at(1.6)) / 2)
    assert pressure.at(99.0) == pytest.approx(pressure.values[-1])
    frame = solution.at(1.45)
    expected = (solution.snapshot(4).displacement + solution.snapshot(5).displacement) / 2
    np.testing.assert_allclose(frame.displacement, expected, atol=1e-12)


def test_an_unknown_output_names_the_nearest(run_directory: Path) -> None:
    with pytest.raises(SolutionError, match="did you mean 'upper_lip_pressure_kpa'"):
        Solution.load(run_directory)["upper_lip_presure_kpa"]


def test_the_files_carry_columns_units_and_peaks(run_directory: Path) -> None:
    header = (run_directory / "history.csv").read_text().splitlines()[0]
    assert header.split(",") == [quantity.name for quantity in HISTORY]
    summary = json.loads((run_directory / "summary.json").read_text())
    assert summary["finished"] is True
    assert summary["upper_lip_pressure_kpa"] == pytest.approx(60.0)
    assert summary["dermis_min_log_strain"] == pytest.approx(-0.4)
    assert summary["upper_lip_crest_contrast"] == pytest.approx(0.4)
    history = Solution.load(run_directory)["upper_lip_force_n"]
    impulse = np.trapezoid(history.values, history.time_s)
    assert impulse > 1.0
    assert summary["upper_lip_impulse_ns"] == pytest.approx(impulse, rel=1e-6)
    with h5py.File(run_directory / "fields.h5") as store:
        assert store["element/von_mises_mpa"].attrs["unit"] == "MPa"
        assert store["increments/displacement"].shape[0] == 11


def test_other_programs_name_the_axes(run_directory: Path) -> None:
    xarray = needed_module("xarray")
    needed_module("h5netcdf")
    solution = Solution.load(run_directory)
    expected = {
        "element": {"von_mises_mpa": ("time_s", "triangle")},
        "increments": {
            "displacement": ("time_s", "node", "axis"),
            "placement": ("time_s", "angle_x_y"),
        },
        "contact/upper": {"pressure_mpa": ("time_s", "arc_mm")},
        "mesh": {"nodes": ("node", "axis"), "triangles6": ("triangle", "triangle_node")},
    }
    for group, names in expected.items():
        file = run_directory / "fields.h5"
        with xarray.open_dataset(file, group=group, engine="h5netcdf") as found:
            for name, axes in names.items():
                assert found[name].dims == axes
    with xarray.open_dataset(file, group="contact/upper", engine="h5netcdf") as found:
        along = solution.contact["upper"]
        np.testing.assert_array_equal(found["arc_mm"], along.arc_mm)
        np.testing.assert_array_equal(found["pressure_mpa"], along.fields["pressure_mpa"])
    with xarray.open_dataset(file, engine="h5netcdf") as found:
        np.testing.assert_array_equal(found["time_s"], solution.time_s)


def test_the_documentation_names_every_column_and_dataset(run_directory: Path) -> None:
    page = Path(__file__).parents[3] / "docs" / "reference" / "files.md"
    text = page.read_text(encoding="utf-8")
    assert all(f"`{quantity.name}`" in text for quantity in HISTORY)
    with h5py.File(run_directory / "fields.h5") as store:
        for group in ("mesh", "increments", "element"):
            assert all(f"`{group}/{name}`" in text for name in store[group])


def test_a_killed_run_goes_on_where_it_was(
    tmp_path: Path, model: SectionModel, increments: list[Increment], run_directory: Path
) -> None:
    out = tmp_path / "run"
    with SolutionWriter(out, TOML, resume=False) as killed:  # the end of a process frees the place
        killed.model(model)
        for increment in increments[:4]:
            killed.commit(increment)
    # What a kill in the middle of the next write leaves behind.
    (killed.folder / "increments" / ".000004.partial.npz").write_bytes(b"half a file")
    (killed.folder / "checkpoint-000004.npz").write_bytes(b"half a file")
    assert not out.exists()

    resumed = SolutionWriter(out, TOML, resume=True)
    last = resumed.last()
    assert last is not None
    assert last.time_s == increments[3].time_s
    np.testing.assert_array_equal(last.checkpoint["stick"], increments[3].checkpoint["stick"])
    np.testing.assert_array_equal(last.displacement, increments[3].displacement)
    go_on(resumed, increments)

    assert (out / "history.csv").read_text() == (run_directory / "history.csv").read_text()
    for name in ("increments/displacement", "element/log_strain_min", "contact/upper/gap_mm"):
        with h5py.File(out / "fields.h5") as a, h5py.File(run_directory / "fields.h5") as b:
            np.testing.assert_array_equal(a[name][:], b[name][:])
    assert sorted(path.name for path in out.iterdir()) == [
        ".drinksim",
        "fields.h5",
        "history.csv",
        "inputs.json",
        "run.log",
        "scenario.toml",
        "summary.json",
    ]


def go_on(writer: SolutionWriter, increments: list[Increment]) -> None:
    """Compute the rest of a run and finish it."""
    for increment in increments[writer.count :]:
        writer.commit(increment)
    writer.finish(finished=True, message="all of it", about={})


def unfinished(out: Path, model: SectionModel, increments: list[Increment], count: int) -> Path:
    with SolutionWriter(out, TOML) as writer:
        writer.model(model)
        for increment in increments[:count]:
            writer.commit(increment)
    return writer.folder


def test_an_unfinished_run_is_neither_wiped_nor_continued_unasked(
    tmp_path: Path, model: SectionModel, increments: list[Increment]
) -> None:
    out = tmp_path / "run"
    unfinished(out, model, increments, 3)
    with pytest.raises(SolutionError, match=r"3 increments.*--resume.*--overwrite"):
        SolutionWriter(out, TOML)
    with SolutionWriter(out, TOML, resume=True) as resumed:
        assert resumed.count == 3
    with SolutionWriter(out, TOML, overwrite=True) as anew:
        assert anew.last() is None


@pytest.mark.parametrize(
    ("toml", "inputs", "word"),
    [
        (TOML + "# other\n", {"package.outline": "a"}, "other settings"),
        (TOML, {"package.outline": "b"}, r"another file for package\.outline"),
        (TOML, {}, r"another file for package\.outline"),
    ],
)
def test_other_inputs_are_not_resumed(
    tmp_path: Path, increments: list[Increment], toml: str, inputs: dict[str, str], word: str
) -> None:
    out = tmp_path / "run"
    with SolutionWriter(out, TOML, inputs={"package.outline": "a"}) as writer:
        writer.commit(increments[0])
    with pytest.raises(SolutionError, match=word):
        SolutionWriter(out, toml, inputs=inputs, resume=True)
    with SolutionWriter(out, toml, inputs=inputs, overwrite=True) as anew:
        assert anew.last() is None


def test_another_version_is_not_resumed(
    tmp_path: Path, increments: list[Increment], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    with SolutionWriter(out, TOML) as writer:
        writer.commit(increments[0])
    monkeypatch.setattr("scenarios.results.integrity.version", lambda name: "9.9")
    with pytest.raises(SolutionError, match=r"drinksim .*, this is 9\.9"):
        SolutionWriter(out, TOML, resume=True)


@pytest.mark.parametrize("damaged", ["increments/000003.npz", "checkpoint-000003.npz"])
def test_a_damaged_last_increment_gives_way_to_the_one_before(
    tmp_path: Path,
    model: SectionModel,
    increments: list[Increment],
    run_directory: Path,
    damaged: str,
) -> None:
    out = tmp_path / "run"
    file = unfinished(out, model, increments, 4) / damaged
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0xFF
    file.write_bytes(content)
    resumed = SolutionWriter(out, TOML, resume=True)
    assert resumed.count == 3
    go_on(resumed, increments)
    assert (out / "history.csv").read_bytes() == (run_directory / "history.csv").read_bytes()


def test_a_damaged_earlier_increment_is_named(
    tmp_path: Path, model: SectionModel, increments: list[Increment]
) -> None:
    out = tmp_path / "run"
    folder = unfinished(out, model, increments, 4)
    (folder / "increments" / "000001.npz").write_bytes(b"cut")
    with pytest.raises(SolutionError, match=r"increment 2 is damaged.*--overwrite"):
        SolutionWriter(out, TOML, resume=True)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("history.csv", lambda content: content.replace(b"1", b"2", 1)),
        ("fields.h5", lambda content: content[:-100]),
        ("scenario.toml", lambda content: content + b"# edited\n"),
        ("summary.json", lambda content: content.replace(b"all of it", b"all is well")),
        ("summary.json", lambda content: content[: len(content) // 2]),
        ("summary.json", lambda content: b"[" * 100_000),
        ("fields.h5", None),
    ],
)
def test_a_run_whose_files_do_not_belong_together_is_not_shown(
    tmp_path: Path, model: SectionModel, increments: list[Increment], name: str, change
) -> None:
    out = tmp_path / "run"
    unfinished(out, model, increments, 2)
    go_on(SolutionWriter(out, TOML, resume=True), increments)
    Solution.load(out)
    file = out / name
    if change is None:
        file.unlink()
    else:
        file.write_bytes(change(file.read_bytes()))
    with pytest.raises(SolutionError, match=name.replace(".", r"\.")):
        Solution.load(out)


def test_another_motion_is_not_resumed(tmp_path: Path) -> None:
    writer = SolutionWriter(tmp_path / "run", TOML, resume=False)
    motion = tmp_path / "motion.csv"
    motion.write_text("one")
    writer.keep(motion, writer.folder / "motion" / "motion.csv")
    writer.keep(motion, writer.folder / "motion" / "motion.csv")
    motion.write_text("other")
    with pytest.raises(SolutionError, match=r"another motion\.csv"):
        writer.keep(motion, writer.folder / "motion" / "motion.csv")


def test_a_run_that_fails_before_its_first_increment_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(ZeroDivisionError),
        SolutionWriter(tmp_path / "run", TOML, resume=False),
    ):
        _ = 1 / 0
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_result_is_replaced_and_other_files_are_not(
    tmp_path: Path, model: SectionModel, increments: list[Increment]
) -> None:
    out = tmp_path / "run"
    for message in ("first", "second"):
        writer = SolutionWriter(out, TOML, resume=False)
        writer.model(model)
        writer.commit(increments[0])
        writer.finish(finished=False, message=message, about={})
    assert Solution.load(out).message == "second"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]

    letters = tmp_path / "letters"
    letters.mkdir()
    (letters / "dear.txt").write_text("Dear")
    with pytest.raises(OutputError, match="give another directory"):
        SolutionWriter(letters, TOML, resume=False)


def test_an_unfinished_run_says_how_to_finish_it(
    tmp_path: Path, increments: list[Increment]
) -> None:
    SolutionWriter(tmp_path / "run", TOML, resume=False).commit(increments[0])
    with pytest.raises(SolutionError, match="--resume"):
        Solution.load(tmp_path / "run")
    with pytest.raises(SolutionError, match="drinksim replay"):
        Solution.load(tmp_path / "elsewhere")


def test_a_history_without_a_column_is_refused(increments: list[Increment]) -> None:
    history = dict(increments[0].history)
    del history["upper_lip_contact_mm"]
    with pytest.raises(SolutionError, match="upper_lip_contact_mm"):
        dataclasses.replace(increments[0], history=history).row()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system starts no process by forking")
@pytest.mark.slow
def test_a_run_killed_at_any_file_operation_comes_to_the_same_end(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.support.killed_writer", str(tmp_path)]
    ended = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[3]
    )
    assert ended.returncode == 0, ended.stderr
    assert int(ended.stdout) > 50
