"""What is public, and what it costs to open the door."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest

import drinksim
import drinksim as ds
from geometry2d.foundation.provided import Provided
from scenarios.results import solution
from scenarios.settings import scenario

PUBLIC = [
    "DrinksimError",
    "Motion",
    "RecordingWarning",
    "Scenario",
    "Solution",
    "__version__",
    "convert",
    "explore",
    "fem",
    "library_names",
    "load_scenario",
    "report",
    "study",
]
ROOT = Path(__file__).parents[2]
STUDY_EXTRA = {"dask", "distributed", "pyarrow", "optuna"}
SLOW_TO_LOAD = {"numba", "scipy", "numpy", "cv2", "av", "matplotlib", "shapely", "h5py", "skfem"}
SLOW_TO_LOAD |= STUDY_EXTRA


def loaded_by(code: str) -> set[str]:
    """Names of the packages that are loaded once some code has run in a new interpreter."""
    script = f"{code}\nimport sys\nprint('\\n'.join(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return {name.partition(".")[0] for name in done.stdout.split()}


def test_the_public_list_is_this_one() -> None:
    assert sorted(PUBLIC) == ds.__all__ == dir(ds)
    for name in PUBLIC:
        assert getattr(ds, name) is not None


def test_what_a_type_checker_sees_is_what_is_imported() -> None:
    tree = ast.parse(Path(drinksim.__file__).read_text(encoding="utf-8"))
    (seen,) = (
        node.body
        for node in tree.body
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name)
    )
    declared = {
        alias.asname: f"{node.module}.{alias.name}"
        for node in seen
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    made_in = {name: f"{module}.{name}" for name, module in drinksim._MADE_IN.items()}
    assert declared == made_in | {"fem": "drinksim.fem"}


def test_an_unknown_name_says_what_there_is() -> None:
    with pytest.raises(AttributeError, match=r"drinksim has no 'lode_scenario': it has .*load_sc"):
        ds.lode_scenario  # type: ignore[attr-defined]  # noqa: B018


def test_opening_the_door_loads_nothing_slow() -> None:
    assert not loaded_by("import drinksim") & SLOW_TO_LOAD


def test_the_list_of_commands_loads_nothing_slow() -> None:
    shown = "from scenarios.cli.main import drinksim_parser; drinksim_parser().format_help()"
    assert not loaded_by(shown) & SLOW_TO_LOAD


def test_scenarios_and_solutions_have_all_their_methods() -> None:
    assert ds.Scenario is not None
    declared = [
        value
        for module in (scenario, solution)
        for value in vars(module).values()
        if isinstance(value, Provided)
    ]
    assert len(declared) == 4
    assert all(callable(each.function) for each in declared)


def test_the_version_is_that_of_the_installed_package() -> None:
    assert ds.__version__ == version("drinksim")


@pytest.mark.parametrize(
    "start", [["-m", "drinksim"], ["-c", "from drinksim.__main__ import main; main()"]]
)
def test_the_command_line_opens_from_here(start: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, *start, "--help"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("usage: drinksim")


def test_the_console_script_is_the_same() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    module, _, name = project["scripts"]["drinksim"].partition(":")
    assert getattr(import_module(module), name) is import_module("drinksim.__main__").main
