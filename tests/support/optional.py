"""What only some machines have: programs, libraries and recordings that tests cannot bring along.

A test that needs one of them says so here and is skipped where it is missing. Where `STRICT` is set
to 1, as continuous integration sets it, the same test fails instead: there nothing may be missing.
"""

from __future__ import annotations

import importlib
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import NoReturn

import pytest

ROOT = Path(__file__).resolve().parents[2]

STRICT = "DRINKSIM_STRICT"
"""Environment variable: 1 makes tests fail whose program, library or recording is missing."""

DATA = "DRINKSIM_DATA"
"""Environment variable: the folder of recordings that others made."""


def missing(what: str, *, remedy: str) -> NoReturn:
    """Skip the test, or the file that calls this while it is imported; fail if nothing may miss."""
    if os.environ.get(STRICT) == "1":
        pytest.fail(f"{what} is missing, and {STRICT} is 1; {remedy}", pytrace=False)
    pytest.skip(f"{what} is missing; {remedy}", allow_module_level=True)


def needed_program(*names: str, package: str) -> str:
    """Return the path of the first of these programs that is installed.

    ``package`` is Debian's that holds it.
    """
    for name in names:
        if found := shutil.which(name):
            return found
    missing(f"the program {names[0]}", remedy=f"install Debian's package {package}")


def needed_module(name: str) -> ModuleType:
    """Import a library that the product itself can do without."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name.split(".", maxsplit=1)[0]:
            raise
    missing(f"the library {name}", remedy='install the extra "test"')


def data_folder(environment: Mapping[str, str] = os.environ, root: Path = ROOT) -> Path:
    """Return the folder that `DATA` names, or else ``shared/data`` beside the checkout."""
    named = environment.get(DATA)
    return Path(named) if named else root.parent / "shared" / "data"


def recorded_file(name: str, folder: Path | None = None) -> Path:
    """Return the path of a recording that others made, such as ``projectile/projetil.mp4``."""
    path = (folder or data_folder()) / name
    if not path.is_file():
        missing(f"the recording {path}", remedy=f"let {DATA} name the folder that holds {name}")
    return path
