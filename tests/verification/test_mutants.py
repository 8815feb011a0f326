"""Every parser against damaged files: a value or our error, within bounds of time and memory.

``python -m benchmarks.mutants`` reads hundreds of mutants a parser; here are the first few of each.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from benchmarks.mutant_seeds import PARSERS
from benchmarks.mutants import FAULTS, attempted, mutant, run, wording
from geometry2d.foundation.errors import DrinksimError
from tests.support.hostile_drawings import DXF, SVG, dxf, svg

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="each mutant is read in a forked process"),
]
MUTANTS = 25


@pytest.mark.parametrize("name", PARSERS)
def test_mutants_end_in_a_value_or_our_error_within_bounds(name: str):
    outcomes = run(name, MUTANTS, seed=1, keep=None)
    assert len(outcomes) == MUTANTS
    assert not [outcome for outcome in outcomes if outcome.kind in FAULTS]


@pytest.mark.parametrize("name", [*SVG, *DXF])
def test_hostile_drawings_end_within_bounds(tmp_path: Path, name: str):
    file = svg(name, tmp_path) if name in SVG else dxf(name, tmp_path)
    assert attempted(PARSERS["svg"].read, file).kind == "refused"


def test_a_mutant_is_the_same_for_the_same_key_and_no_larger_than_allowed():
    sound = b"frame,time_s\n0,1.5\n"
    mutants = [mutant(sound, [sound], f"key {k}") for k in range(200)]
    assert mutants == [mutant(sound, [sound], f"key {k}") for k in range(200)]
    assert len(set(mutants)) > 100
    assert max(map(len, mutants)) <= 2_000_000


def _sleep(_: Path) -> None:
    while True:
        pass


def _balloon(file: Path) -> None:
    raise DrinksimError(f"{file}: {len(bytearray(700_000_000).replace(b'1', b'2'))}")


def _die(_: Path) -> None:
    os.kill(os.getpid(), 9)


def _raise(_: Path) -> None:
    raise KeyError("x")


def _mumble(_: Path) -> None:
    raise DrinksimError("x.csv: None is not subscriptable")


@pytest.mark.parametrize(
    ("read", "kind"),
    [(_sleep, "slow"), (_balloon, "large"), (_die, "died"), (_raise, "error"),
     (_mumble, "badly worded")],
)  # fmt: skip
def test_every_fault_is_told_from_a_refusal(tmp_path: Path, read, kind: str):
    file = tmp_path / "x.csv"
    file.write_text("")
    assert attempted(read, file).kind == kind


def test_wording_is_judged_without_what_the_file_says_itself():
    file = Path("x.csv")
    assert wording("x.csv line 2: column 3 is 'None', not a number", file) == ""
    assert "None" in wording("x.csv: None is missing", file)
    assert "does not name" in wording("line 2: is wrong", file)
    assert "printable" in wording("x.csv: a\nb", file)
