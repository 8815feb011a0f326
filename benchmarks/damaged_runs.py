"""Run directories damaged in every way: none is shown in silence, none ends in a traceback.

    python -m benchmarks.damaged_runs [--count 150] [--first 0] [--seconds S] [--seed 0]

A short run is replayed, and copies of it are damaged: a file is cut, some of its bits are flipped,
it is removed, emptied, or another run's; a table holds a text or no number, or its rows are turned
round; a number of the summary is another one. Every third damage is sealed, as by somebody who
mends the checksums too. `report`, `animate`, `export` and `replay --resume` then meet each copy.
They end with one line, or a result; with a result only if the file is none that a run is read from,
or if the damage was sealed.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.short_sip import short_sip
from scenarios.cli.main import main as drinksim
from scenarios.results.integrity import FILES, ITSELF, sealed
from scenarios.results.summary import SUMMARY_FILE
from scenarios.sip.run import solve

NO_TRACEBACK = (0, 2, 3)
SHOWN = 0

Damage = Callable[[Path, Path, random.Random], None]


def cut(file: Path, other: Path, rng: random.Random) -> None:
    """Cut the end of a file off."""
    data = file.read_bytes()
    file.write_bytes(data[: rng.randrange(len(data))] if data else b"")


def flipped(file: Path, other: Path, rng: random.Random) -> None:
    """Flip some bits of a file."""
    data = bytearray(file.read_bytes())
    for _ in range(rng.choice((1, 8, 64)) if data else 0):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    file.write_bytes(bytes(data))


def removed(file: Path, other: Path, rng: random.Random) -> None:
    """Remove a file."""
    file.unlink()


def emptied(file: Path, other: Path, rng: random.Random) -> None:
    """Leave nothing in a file."""
    file.write_bytes(b"")


def exchanged(file: Path, other: Path, rng: random.Random) -> None:
    """Put another run's file in the place of this one's."""
    shutil.copyfile(other, file)


def edited(file: Path, other: Path, rng: random.Random) -> None:
    """Change a table's cell to a text or to no number, or turn its rows round."""
    lines = file.read_bytes().splitlines()
    if len(lines) < 3:
        return emptied(file, other, rng)
    if rng.random() < 0.3:
        lines = [lines[0], *lines[:0:-1]]
    else:
        at = rng.randrange(1, len(lines))
        cells = lines[at].split(b",")
        cells[rng.randrange(len(cells))] = rng.choice((b"nan", b"n/a", b"", b"inf", b"1e999"))
        lines[at] = b",".join(cells)
    file.write_bytes(b"\n".join(lines) + b"\n")
    return None


DAMAGES: tuple[Damage, ...] = (cut, flipped, flipped, removed, emptied, exchanged, edited, edited)


def commands(run: Path, scenario: str, out: Path) -> dict[str, list[str]]:
    """Return what is typed about a run directory, by command."""
    return {
        "report": ["report", str(run), "--out", str(out / "page.html")],
        "animate": ["animate", str(run), "--out", str(out / "frames.png")],
        "export": ["export", str(run), "--format", "vtk", "--out", str(out / "vtk")],
        "resume": ["replay", scenario, "--out", str(run), "--resume"],
    }


def told(arguments: Sequence[str]) -> tuple[int, str]:
    """Run a command in a process of its own; return its exit code and all that it said."""
    sink, source = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(sink)
        said = io.StringIO()
        code = 1
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            try:
                code = drinksim(arguments)
            except BaseException as error:
                said.write(f"{type(error).__name__}: {error}")
        os.write(source, said.getvalue().encode("utf-8", "backslashreplace")[:4000])
        os._exit(code)
    os.close(source)
    with os.fdopen(sink, "rb") as stream:
        text = stream.read().decode("utf-8", "replace")
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text


def reseal(run: Path) -> None:
    """Write the checksums of a run directory anew, if its summary can still be read."""
    file = run / SUMMARY_FILE
    try:
        summary = json.loads(file.read_text(encoding="utf-8"))
        content = {name: value for name, value in summary.items() if name not in (FILES, ITSELF)}
        file.write_text(json.dumps(sealed(content, run)), encoding="utf-8")
    except (OSError, ValueError, AttributeError):
        return


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; return 1 if anything is at fault."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--count", type=int, default=150)
    options.add_argument("--first", type=int, default=0, help="number at which to go on")
    options.add_argument("--seconds", type=float, default=1e9, help="no damage after so many")
    options.add_argument("--seed", type=int, default=0)
    chosen = options.parse_args(arguments)
    began, done = time.monotonic(), 0
    counts: dict[str, Counter[str]] = {}
    at_fault = 0
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        scenario = short_sip(place)
        solve(scenario, out=place / "run")
        solve(scenario.with_(contact={"friction": 0.5}), out=place / "other")
        own = shutil.copyfile(place / "run" / "scenario.toml", place / "again.toml")
        for folder in ("motion", "inputs"):
            shutil.copytree(place / "run" / folder, place / folder)
        files = [f for f in sorted((place / "run").rglob("*")) if f.is_file()]
        known = json.loads((place / "run" / SUMMARY_FILE).read_text())[FILES].keys()
        for number in range(chosen.first, chosen.count):
            if time.monotonic() - began > chosen.seconds:
                break
            done, rng = done + 1, random.Random(f"{chosen.seed} {number}")
            name = files[number % len(files)].relative_to(place / "run").as_posix()
            damage = rng.choice(DAMAGES)
            damaged = place / "damaged" / "run"
            shutil.copytree(place / "run", damaged)
            damage(damaged / name, place / "other" / name, rng)
            same = (damaged / name).is_file() and (damaged / name).read_bytes() == (
                place / "run" / name
            ).read_bytes()
            is_sealed = number % 3 == 2
            if is_sealed:
                reseal(damaged)
            may_be_shown = same or is_sealed or name not in {*known, SUMMARY_FILE, "inputs.json"}
            for command, words in commands(damaged, str(own), place / "damaged").items():
                code, text = told(words)
                counts.setdefault(command, Counter())["shown" if code == SHOWN else "refused"] += 1
                fault = code not in NO_TRACEBACK or "Traceback" in text
                fault |= code == SHOWN and not may_be_shown
                fault |= code != SHOWN and len(text.strip().splitlines()) != 1
                if fault:
                    at_fault += 1
                    print(
                        f"{number} {damage.__name__} {name}{' sealed' * is_sealed}, {command}: "
                        f"{code} {text.strip()[:400]}",
                        file=sys.stderr,
                        flush=True,
                    )
            shutil.rmtree(place / "damaged")
    for command, kinds in counts.items():
        print(f"| {command} | {kinds['refused']} refused | {kinds['shown']} shown |")
    print(f"{at_fault} at fault of {done} damaged run directories from {chosen.first}")
    return int(at_fault > 0)


if __name__ == "__main__":
    sys.exit(main())
