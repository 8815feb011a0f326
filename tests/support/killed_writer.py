"""Write a small run again and again, killed at each of its file operations in turn.

Run as a module with a folder: prints how many operations there were. After every kill the run is
gone on with by another process, and its files are compared with those of a run that was let alone.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from scenarios.results.writer import SolutionWriter
from tests.support.made_up_sip import small_increment, small_model

COUNT = 3
TOML = 'name = "killed"\n[motion]\nfile = "motion.csv"\n'
KILLED = 9
OPERATIONS = {"open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.listdir", "os.scandir"}


def write_run(out: Path, *, resume: bool) -> None:
    model = small_model()
    writer = SolutionWriter(out, TOML, resume=resume)
    if writer.is_complete:
        writer.tidy()
        return
    writer.model(model)
    for index in range(writer.count, COUNT):
        writer.commit(small_increment(model, index, COUNT))
    writer.finish(finished=True, message="all of it", about={})


def in_a_process(work: Callable[[], None], *, killed_at: int | None) -> int:
    """Do the work in a process that ends abruptly at one of its file operations."""
    process = os.fork()
    if process == 0:
        done = 0

        def watch(event: str, _: object) -> None:
            nonlocal done
            if event in OPERATIONS:
                done += 1
                if done == killed_at:
                    os._exit(KILLED)

        sys.addaudithook(watch)
        try:
            work()
        except BaseException as error:  # nothing of this process may go on
            print(f"killed at {killed_at}: {error!r}", file=sys.stderr)
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def main(folder: Path) -> int:
    whole = folder / "whole"
    write_run(whole, resume=False)
    kept = {name: (whole / name).read_bytes() for name in ("history.csv", "fields.h5")}
    number = 0
    while True:
        number += 1
        place = folder / f"killed-{number}"
        place.mkdir()
        out = place / "run"
        ended = in_a_process(lambda out=out: write_run(out, resume=False), killed_at=number)
        if ended == 0:
            return number - 1
        assert ended == KILLED, number
        if not (out / "summary.json").is_file():
            again = in_a_process(lambda out=out: write_run(out, resume=True), killed_at=None)
            assert again == 0, number
        for name, content in kept.items():
            assert (out / name).read_bytes() == content, (number, name)
        assert {path.name for path in place.iterdir()} <= {"run", "run.outdated"}, number
        shutil.rmtree(place)


if __name__ == "__main__":
    print(main(Path(sys.argv[1])))
