"""What a researcher writes, from start to end, and the scripts in examples/."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import skfem
from matplotlib import pyplot

import drinksim as ds
from scenarios.sip import run
from tests.support.made_up_sip import MadeUpReplay
from tests.support.optional import needed_module

needed_module("pandas")
needed_module("xarray")

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a film of a sip and its markers, in which one works."""
    filmed = ds.load_scenario("A38-F").recording
    assert filmed is not None
    for file, name in ((filmed.video, "sip.mp4"), (filmed.markers, "markers.toml")):
        (tmp_path / name).write_bytes(Path(file).read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_a_sip_is_solved_questioned_and_reported(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pyplot.switch_backend("agg")
    with monkeypatch.context() as made_up:
        made_up.setattr(run, "replay", MadeUpReplay())
        ds.load_scenario("A38-F").solve(out="other")

    # So little of the film hardly shows the head nod; a longer piece is in examples/.
    with pytest.warns(ds.RecordingWarning, match="hardly tells whether ear and nose are equally"):
        motion = ds.convert("sip.mp4", markers="markers.toml", end_s=1.3)
    scenario = ds.load_scenario("A38-F").with_(motion=motion, contact={"friction": 0.5})
    scenario = scenario.with_(numerics={"resolution": "coarse"})
    before = sorted(recording.iterdir())
    solution = scenario.solve(progress=True)
    pressure = solution["upper_lip_window_kpa"].plot()
    section = solution.at(1.2).plot("von_mises")
    table, fields = solution.to_dataframe(), solution.to_xarray()
    assert sorted(recording.iterdir()) == before
    ds.report([solution, ds.Solution.load("other")], "page.html")

    assert solution.finished
    assert solution.motion == motion
    assert (pressure.lines[0].get_ydata() == table["upper_lip_window_kpa"]).all()
    assert section.get_title(loc="left") == "1.20 s"
    assert fields.sizes["time_s"] == len(table) == solution.time_s.size
    page = Path("page.html").read_text(encoding="utf-8")
    assert "contact.friction" in page
    pyplot.close("all")


def test_a_block_is_pressed() -> None:
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 20, 21), np.linspace(0, 12, 13))
    mesh = mesh.with_boundaries({"top": lambda x: x[1] == 12, "bottom": lambda x: x[1] == 0})
    outline = ds.fem.Outline.circle((10.0, 18.0), 6.0)

    body = ds.fem.Body(
        mesh, ds.fem.Ogden(mu_mpa=[0.05], alpha=[10.789], poisson=0.49), plane="stress"
    )
    contact = ds.fem.RigidContact(body.surface("top"), outline, friction=1.0)
    model = ds.fem.Model(body, contacts=[contact], held=body.dofs("bottom"))
    result = ds.fem.solve_static(model, ds.fem.Load(move=(0, -1.0)))

    assert result.converged
    lowest = result.displacement[np.argmin(np.linalg.norm(body.nodes - [10.0, 12.0], axis=1))]
    assert lowest[1] == pytest.approx(-1.0, abs=0.01)
    held = result.reaction[body.dofs("bottom", along="y")].sum()
    assert held == pytest.approx(-result.contacts[0].force[:, 1::2].sum(), rel=1e-6)
    assert held > 0.05


@pytest.mark.slow
@pytest.mark.parametrize("script", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_a_script_runs_anywhere_and_says_what_it_found(script: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", script], cwd=tmp_path, capture_output=True, text=True,
        check=False, env={**os.environ, "PYTHONPATH": str(EXAMPLES.parent)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert len(done.stdout.splitlines()) > 3


def test_there_is_a_script_for_the_sip_and_one_for_the_mechanics() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == {"sip.py", "pressed_block.py"}
