"""A short replay, killed again and again, goes on to the same bytes every time.

    python -m benchmarks.kills [--count 200] [--first 0] [--seconds S] [--seed 0] [--keep FOLDER]

Every other kill comes at a random time of the replay, the others at a random one of its operations
on files and folders (opening, renaming, removing, making, listing). The replay is then resumed once
in another process; what it leaves has to be byte for byte what a replay leaves that nobody killed,
and nothing else may lie beside it. A series may be done in parts, each from its first number on.
Prints a row of a table: kills, how many came before there was anything to go on from, and how many
failed.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.short_sip import short_sip
from geometry2d.foundation.errors import DrinksimError
from scenarios.settings.scenario import Scenario
from scenarios.sip.run import solve

OPERATIONS = {
    "open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.listdir", "os.scandir",
    "shutil.copyfile", "shutil.rmtree",
}  # fmt: skip
SAME = ("history.csv", "fields.h5", "scenario.toml", "inputs.json", "motion/motion.csv")
REFUSED = 2


@dataclass(frozen=True)
class Ended:
    """Exit code of a process (negative: its signal), its file operations, and its seconds."""

    code: int
    operations: int
    seconds: float


def in_a_process(
    work: Callable[[], object], *, at_operation: int | None = None, after_s: float | None = None
) -> Ended:
    """Do work in a process that is killed at one of its file operations, or after a time."""
    sink, source = os.pipe()
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        os.close(sink)
        _work_and_count(work, at_operation, source)
    os.close(source)
    timer = threading.Timer(after_s or 0.0, os.kill, (child, signal.SIGKILL))
    if after_s is not None:
        timer.start()
    said = os.read(sink, 100)
    _, status = os.waitpid(child, 0)
    timer.cancel()
    os.close(sink)
    return Ended(os.waitstatus_to_exitcode(status), int(said or b"0"), time.monotonic() - began)


def _work_and_count(work: Callable[[], object], at_operation: int | None, source: int) -> None:
    done = 0

    def watch(event: str, _: object) -> None:
        nonlocal done
        if event in OPERATIONS:
            done += 1
            if done == at_operation:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(watch)
    code = 1
    try:
        work()
        code = 0
    except DrinksimError as error:
        print(error, file=sys.stderr)
        code = REFUSED
    finally:
        os.write(source, str(done).encode())
        os._exit(code)


def failure(scenario: Scenario, folder: Path, whole: Path) -> str:
    """Resume a killed replay in a folder, and return what is wrong then; empty if nothing is."""
    out = folder / "run"
    ended = in_a_process(lambda: solve(scenario, out=out, resume=True))
    if ended.code != 0:
        return f"resuming ended with {ended.code}"
    for name in SAME:
        if (out / name).read_bytes() != (whole / name).read_bytes():
            return f"{name} differs"
    beside = {path.name for path in folder.iterdir()} - {"run"}
    return f"{sorted(beside)} lies beside it" if beside else ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the row; return 1 if anything failed."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--count", type=int, default=200)
    options.add_argument("--first", type=int, default=0, help="number at which to go on")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--seconds", type=float, default=1e9, help="no kill after so many")
    options.add_argument("--keep", type=Path, help="folder for what failed")
    chosen = options.parse_args(arguments)
    rng = random.Random(chosen.seed)
    kills = failed = fresh = 0
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        scenario = short_sip(place)
        whole = place / "whole"
        # Kernels are compiled and kept first: no kill shall come before the replay begins.
        in_a_process(lambda: solve(scenario))
        undisturbed = in_a_process(lambda: solve(scenario, out=whole))
        assert undisturbed.code == 0 and undisturbed.operations > 0
        for number in range(chosen.count):
            if time.monotonic() - began > chosen.seconds:
                break
            when = {"at_operation": rng.randint(1, undisturbed.operations)}
            if number % 2:
                when = {"after_s": rng.uniform(0.0, undisturbed.seconds)}
            if number < chosen.first:
                continue
            folder = place / f"{number}"
            folder.mkdir()
            in_a_process(lambda at=folder / "run": solve(scenario, out=at), **when)
            kills += 1
            fresh += not any(folder.glob("run*/increments/*.npz"))
            wrong = failure(scenario, folder, whole)
            if wrong:
                failed += 1
                print(f"{number} {when}: {wrong}", file=sys.stderr, flush=True)
                if chosen.keep is not None:
                    shutil.copytree(folder, chosen.keep / folder.name)
            shutil.rmtree(folder)
    print(
        f"| {kills} kills from {chosen.first} | undisturbed {undisturbed.operations} operations, "
        f"{undisturbed.seconds:.1f} s | {fresh} before the first increment or after the last "
        f"| {failed} failed |"
    )
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
