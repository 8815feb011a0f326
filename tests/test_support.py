"""What is missing skips a test, or fails it where nothing may miss; what is shared is whole."""

from pathlib import Path

import pytest

from tests.conftest import FIRST, turn
from tests.support.optional import (
    DATA,
    ROOT,
    STRICT,
    data_folder,
    needed_module,
    needed_program,
    recorded_file,
)
from tests.support.shared import made_once


@pytest.fixture(params=["0", "1"])
def outcome(request, monkeypatch):
    monkeypatch.setenv(STRICT, request.param)
    return pytest.fail.Exception if request.param == "1" else pytest.skip.Exception


def test_what_is_missing_is_named_with_its_remedy(outcome, tmp_path):
    with pytest.raises(outcome, match=r"none\.bvh is missing.*DRINKSIM_DATA"):
        recorded_file("cmu/none.bvh", tmp_path)
    with pytest.raises(outcome, match=r"program no-such-program is missing.*package no-package"):
        needed_program("no-such-program", package="no-package")
    with pytest.raises(outcome, match="library no_such_library is missing"):
        needed_module("no_such_library")


def test_a_library_that_is_there_but_broken_is_an_error(tmp_path, monkeypatch):
    (tmp_path / "broken_library.py").write_text("import no_such_library_either\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="no_such_library_either"):
        needed_module("broken_library")


def test_what_is_there_is_handed_out(tmp_path):
    (tmp_path / "sip.bvh").write_text("")
    assert recorded_file("sip.bvh", tmp_path) == tmp_path / "sip.bvh"
    assert Path(needed_program("no-such-program", "sh", package="dash")).name == "sh"
    assert needed_module("json").__name__ == "json"


def test_recordings_lie_beside_the_checkout_or_where_the_variable_says():
    assert data_folder({}) == ROOT.parent / "shared" / "data"
    assert data_folder({DATA: "/elsewhere"}) == Path("/elsewhere")


def test_what_runs_first_exists_and_nothing_else_is_moved():
    assert all((ROOT / place).exists() for place in FIRST)
    order = ["tests/test_layout.py::a", "tests/mocap/test_facing.py::b", f"{FIRST[0]}::c"]
    assert sorted(order, key=turn) == order[::-1]


def test_what_is_shared_is_made_once_and_whole(tmp_path, monkeypatch):
    made = []

    def make(place):
        made.append(place)
        place.mkdir()
        if len(made) == 1:
            raise KeyboardInterrupt
        (place / "whole").touch()

    monkeypatch.setenv("PYTEST_XDIST_WORKER", "gw0")
    with pytest.raises(KeyboardInterrupt):
        made_once(tmp_path / "gw0", "thing", make)
    made[0].rmdir()
    of_workers = {made_once(tmp_path / worker, "thing", make) for worker in ("gw0", "gw1")}
    assert of_workers == {tmp_path / "shared" / "thing"}
    assert (tmp_path / "shared" / "thing" / "whole").is_file()
    assert len(made) == 2
