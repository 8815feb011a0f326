"""The console script ``drinksim``: one command, its errors and its exit code.

Exit codes: 0; 2 for wrong usage or wrong input (one line on the standard error); 3 for a
computation that could not finish (what was computed is kept); 130 for one that was interrupted (the
line says how to go on).
"""

from __future__ import annotations

import errno
import io
import os
import shlex
import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from geometry2d.foundation.errors import DrinksimError
from scenarios.cli.parser import NOT_FINISHED, complain, drinksim_parser, module_of

INTERRUPTED = 130

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a disk that is full, or full for this user or file."""

GOES_ON = ("calibrate",)
"""Commands that use what an interrupted call of theirs computed without being told to."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    _open_streams()
    typed = list(sys.argv[1:] if arguments is None else arguments)
    options = drinksim_parser().parse_args(typed)
    try:
        code = module_of(options.command).run(options)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return complain(f"interrupted{_going_on(options, typed)}", INTERRUPTED)
    except BrokenPipeError:
        # Whoever read our output has enough; nothing is left to be flushed at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        reason = f"{place}{error.strerror or error}"
        if error.errno in NO_ROOM:
            return complain(f"{reason}: what was computed is kept; make room", NOT_FINISHED)
        return complain(f"{reason}: check the path and its permissions")
    except MemoryError:
        remedy = "what was computed is kept; choose a coarser resolution or free some"
        return complain(f"there is not enough memory: {remedy}", NOT_FINISHED)
    except DrinksimError as error:
        return complain(str(error))
    return code


def _open_streams() -> None:
    """Make both outputs take any character, and exist: they are None where they were closed."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 stays open
            setattr(sys, name, nowhere)
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _going_on(options: Namespace, typed: Sequence[str]) -> str:
    """Return how an interrupted command goes on, to be put behind what happened to it."""
    again = [word for word in typed if word != "--overwrite"]
    if "resume" in options and "--resume" not in again:
        again.append("--resume")
    elif "resume" not in options and options.command not in GOES_ON:
        return ""
    return f"; to go on where it was: drinksim {shlex.join(again)}"
