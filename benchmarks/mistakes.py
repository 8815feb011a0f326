"""Plausible mistakes typed at a terminal: what is said about each, and how soon.

    python -m benchmarks.mistakes [NAME ...] [--keep FOLDER]

Every mistake of `benchmarks.mistake_list` and `benchmarks.decision_mistakes` is made in a folder of
its own and typed as a command. It has to be refused (exit code 2, one line on the standard error)
or flagged (a warning), with words that name the culprit, its value and the remedy, before `SECONDS`
have passed: of the processor, so that other work on the machine does not count. A command is ended
as soon as the warning is there: what it would compute is not waited for.

A row of the table: the mistake, what was wanted and whether it came, how soon, and what was said.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.decision_mistakes import DECISIONS
from benchmarks.mistake_list import MISTAKES, Mistake, Right

SECONDS = 3.0
PATIENCE_S = 40.0
"""A command that has said nothing by then, on the clock, is ended: it went on in silence."""

REFUSED, ENDED = 2, -15


@dataclass(frozen=True)
class Said:
    """How a command ended.

    Attributes
    ----------
    code
        Exit code, `ENDED` if it was ended here.
    text
        All that it said.
    in_time
        Whether what was waited for was said.
    seconds
        Time of the processor that it took.
    """

    code: int
    text: str
    in_time: bool
    seconds: float


def typed(arguments: Sequence[str], folder: Path, *, until: str) -> Said:
    """Type a command in a folder and return what it says, at the latest when ``until`` matches."""
    command = [sys.executable, "-m", "drinksim", *arguments]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(
        command, cwd=folder, env=environment, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, errors="replace",
    )  # fmt: skip
    timer = threading.Timer(PATIENCE_S, process.terminate)
    timer.start()
    lines, found = [], False
    assert process.stdout is not None
    for line in process.stdout:
        lines.append(line.rstrip())
        if not found and re.search(until, line):
            found = True
            if line.startswith("drinksim: warning"):
                process.terminate()
    _, status, usage = os.wait4(process.pid, 0)
    timer.cancel()
    code = os.waitstatus_to_exitcode(status)
    return Said(code, "\n".join(lines), found, usage.ru_utime + usage.ru_stime)


def fault(mistake: Mistake, said: Said) -> str:
    """Return what is wrong with what was said, empty if nothing is."""
    if "Traceback" in said.text:
        return "a traceback"
    if not said.in_time:
        return f"not said (exit code {said.code})"
    if mistake.right is Right.REFUSED and said.code != REFUSED:
        return f"exit code {said.code}"
    if mistake.right is Right.FLAGGED and said.code not in (0, ENDED):
        return f"exit code {said.code}"
    return f"only after {said.seconds:.1f} s" if said.seconds > SECONDS else ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; return 1 if anything passes in silence."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("names", nargs="*", metavar="NAME", help="some mistakes instead of all")
    options.add_argument("--keep", type=Path, help="folder in which the files stay")
    chosen = options.parse_args(arguments)
    at_fault = 0
    with tempfile.TemporaryDirectory() as temporary:
        for mistake in (*MISTAKES, *DECISIONS):
            if chosen.names and mistake.name not in chosen.names:
                continue
            folder = (chosen.keep or Path(temporary)).absolute() / re.sub(r"\W+", "-", mistake.name)
            folder.mkdir(parents=True)
            said = typed(mistake.make(folder), folder, until=mistake.says)
            wrong = fault(mistake, said)
            at_fault += bool(wrong)
            last = said.text.splitlines()[-1:] or [""]
            text = next((t for t in said.text.splitlines() if re.search(mistake.says, t)), last[0])
            print(
                f"| {mistake.name} | {mistake.right.value} | {wrong or 'ok'} | {said.seconds:.1f} "
                f"| {text[:300]} |",
                flush=True,
            )
    print(f"{at_fault} at fault")
    return int(at_fault > 0)


if __name__ == "__main__":
    sys.exit(main())
