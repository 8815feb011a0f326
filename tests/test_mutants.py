"""Every parser bears damaged files; `benchmarks/mutants.py` reads hundreds of them."""

from __future__ import annotations

import subprocess
import sys

import pytest

from benchmarks.mutant_seeds import PARSERS

COUNT = 4


@pytest.mark.slow
def test_some_mutants_of_every_parser() -> None:
    # A process of its own: children inherit the memory of a test run, which is counted.
    command = [sys.executable, "-m", "benchmarks.mutants", "--count", str(COUNT), "--seed", "18"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = [line.split("|")[1:4] for line in done.stdout.splitlines()[2:]]
    assert [name.strip() for name, _, _ in rows] == list(PARSERS)
    assert all(int(read) + int(refused) == COUNT for _, read, refused in rows)
