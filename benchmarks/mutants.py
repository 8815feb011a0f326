"""Every parser against damaged and hostile files: which end in anything but a value or our error.

    python -m benchmarks.mutants [PARSER ...] [--count 400] [--seed 0] [--keep FOLDER]

For each parser the project writes sound files (`mutant_seeds`), and a mutator changes their bytes:
flips, truncation, deletion, duplication, inflated numbers, nesting, and splices of two files.
Mutant number ``n`` of a parser is the same on every machine. Each is read in a child process of its
own, which ends within `SECONDS` and `MEGABYTES` with a value, or with an error of the project whose
text is one line that names the file and holds no word of Python. Everything else is listed, and
with ``--keep`` the file is kept under the parser's name and the mutant's number.

A row of the table: mutants read, refused; then those that are at fault: other errors, processes
that died, too slow, too large, badly worded; then the longest time and the largest memory (of the
whole process: Python with its libraries takes 165 MB before it reads anything).
"""

from __future__ import annotations

import argparse
import os
import random
import re
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.mutant_seeds import PARSERS
from geometry2d.foundation.errors import DrinksimError

SECONDS = 5.0
MEGABYTES = 500.0
LARGEST_FILE = 2_000_000
GUARD_BYTES = 4_000_000_000
"""A child may not take more address space than this: the machine is to survive what is found."""

PYTHON_WORDS = re.compile(
    r"\b(None|True|False|(?<!= )nan|NaN|dtype|ndarray|numpy|Traceback|codec can't|NoneType|"
    r"KeyError|IndexError|TypeError|ValueError|OverflowError|RecursionError|UnicodeDecodeError|str|"
    r"float|int|tuple|list index|datetime|bytes-like)\b|\.partial|' object|0x[0-9a-f]{6}|"
    r"<class|\w\(\)"
)

FAULTS = ("error", "died", "slow", "large", "badly worded")
INFLATED = (
    b"0", b"-1", b"1e308", b"-1e308", b"1e999", b"nan", b"inf", b"4294967295", b"2147483648",
    b"1e-320", b"0.0000001", b"1,5", b"1_000", b"99999999999999999999", b"",
)  # fmt: skip
PAIRS = (
    (b"[", b"]"), (b"{", b"}"), (b"(", b")"), (b"<g>", b"</g>"), (b'"', b'"'),
    (b"JOINT j\n{\nOFFSET 0 0 1\n", b"}\n"), (b"a.", b"a"), (b"[[a]]\n", b""),
    (b'<g transform="scale(2)">', b"</g>"), (b"  0\nINSERT\n  2\nA\n", b""),
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """How one reading ended: ``read``, ``refused`` or one of `FAULTS`, and what was said."""

    kind: str
    text: str
    seconds: float
    megabytes: float


def mutant(data: bytes, files: Sequence[bytes], key: str) -> bytes:
    """Return a file damaged, the same way for the same key; ``files`` are there to splice with."""
    rng = random.Random(key)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice(MUTATIONS)(data, files, rng)[:LARGEST_FILE]
    return data


def flipped(data: bytes, files: Sequence[bytes], rng: random.Random) -> bytes:
    """Return the file with some bytes changed, all over it or close to one another."""
    changed = bytearray(data)
    first, last = _stretch(data, rng) if rng.random() < 0.5 else (0, len(data))
    for _ in range(min(rng.choice((1, 2, 4, 16, 64)), last - first)):
        at = rng.randrange(first, last)
        changed[at] = rng.choice((rng.randrange(256), changed[at] ^ (1 << rng.randrange(8)), 255))
    return bytes(changed)


def truncated(data: bytes, files: Sequence[bytes], rng: random.Random) -> bytes:
    """Return the beginning of the file."""
    return data[: rng.randrange(len(data) + 1)]


def deleted(data: bytes, files: Sequence[bytes], rng: random.Random) -> bytes:
    """Return the file without a stretch of it."""
    first, last = _stretch(data, rng)
    return data[:first] + data[last:]


def duplicated(data: bytes, files: Sequence[bytes], rng: random.Random) -> bytes:
    """Return the file with a stretch of it, or a line, repeated: twice or to the largest size."""
    first, last = _stretch(data, rng)
    if rng.random() < 0.5:
        first = data.rfind(b"\n", 0, first) + 1
        last = data.find(b"\n", last) + 1 or len(data)
    repeated = data[first:last]
    most = (LARGEST_FILE - len(data)) // max(len(repeated), 1)
    count = rng.choice((1, 2, 100, 10_000, most))
    return data[:last] + repeated * max(min(count, most), 0) + data[last:]


def inflated(data: bytes, files: Sequence[bytes], rng: random.Random) -> bytes:
    """Return the file with a number made absurd, in digits or, in a binary file, in bytes."""
    numbers = [m.span() for m in re.finditer(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?", data)]
    text = b"\0" not in data
    if not numbers or (not text and rng.random() < 0.8):
        size = rng.choice((1, 2, 4, 8))
        at = rng.randrange(max(min(len(data), rng.choice((64, 1024, len(data)))), 1))
        value = rng.choice((b"\xff", b"\0", b"\x7f", b"\x80")) * size
        return data[:at] + value + data[at + size :]
    first, last = rng.choice(numbers)
    digits = rng.choice((20, 400, 5000, 200_000))
    value = rng.choice((*INFLATED, b"9" * digits, b"1." + b"3" * digits, data[first:last] * 3))
    return data[:first] + value + data[last:]


def nested(data: bytes, files: Sequence[bytes], rng: random.Random) -> bytes:
    """Return the file with something opened many times in it, and mostly closed again."""
    before, after = rng.choice(PAIRS)
    depth = rng.choice((1, 30, 1000, 20_000, 200_000))
    depth = min(depth, LARGEST_FILE // (len(before) + len(after)))
    first, last = _stretch(data, rng)
    if rng.random() < 0.5:
        last = first
    closed = after * (depth if rng.random() < 0.8 else 0)
    return data[:first] + before * depth + data[first:last] + closed + data[last:]


def spliced(data: bytes, files: Sequence[bytes], rng: random.Random) -> bytes:
    """Return the beginning of the file and the end of another, or with a stretch of another."""
    other = rng.choice(files)
    first, last = _stretch(other, rng)
    at = rng.randrange(len(data) + 1)
    if rng.random() < 0.5:
        return data[:at] + other[first:]
    return data[:at] + other[first:last] + data[at:]


MUTATIONS: tuple[Callable[[bytes, Sequence[bytes], random.Random], bytes], ...] = (
    flipped, truncated, deleted, duplicated, inflated, inflated, nested, spliced,
)  # fmt: skip


def _stretch(data: bytes, rng: random.Random) -> tuple[int, int]:
    """Return where a stretch begins and ends: mostly a few bytes, sometimes much of the file."""
    first = rng.randrange(len(data) + 1)
    length = min(int(2 ** rng.uniform(0, 14)), len(data) - first)
    return first, first + length


def attempted(read: Callable[[Path], object], file: Path) -> Outcome:
    """Return how the reading of a file ends in a process of its own."""
    sink, source = os.pipe()
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        os.setsid()
        _read_and_tell(read, file, source)
    os.close(source)
    said = bytearray()
    over = began + SECONDS
    while select.select([sink], [], [], max(over - time.monotonic(), 0))[0]:
        chunk = os.read(sink, 4096)
        if not chunk:
            break
        said += chunk
    else:
        os.killpg(child, signal.SIGKILL)
    os.close(sink)
    _, status, usage = os.wait4(child, 0)
    seconds = time.monotonic() - began
    megabytes = usage.ru_maxrss / 1e3
    kind, _, text = said.decode("utf-8", "replace").partition("\t")
    if seconds >= SECONDS:
        kind, text = "slow", f"no end after {SECONDS:g} s"
    elif not kind:
        kind, text = "died", f"wait status {status}"
    elif megabytes > MEGABYTES and kind not in FAULTS:
        kind, text = "large", f"{megabytes:.0f} MB; {text}"
    elif kind == "refused" and (fault := wording(text, file)):
        kind, text = "badly worded", f"{fault}: {text}"
    return Outcome(kind, text, seconds, megabytes)


def _read_and_tell(read: Callable[[Path], object], file: Path, source: int) -> None:
    """Read in a child, write the outcome to the pipe, and end the process."""
    resource.setrlimit(resource.RLIMIT_AS, (GUARD_BYTES, GUARD_BYTES))
    quiet = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(quiet, stream)
    warnings.simplefilter("error")
    try:
        read(file)
        said = "read\t"
    except DrinksimError as error:
        said = f"refused\t{error}"
    except BaseException as error:
        said = f"error\t{type(error).__module__}.{type(error).__name__}: {str(error)[:300]}"
    os.write(source, said.encode("utf-8", "backslashreplace")[:60_000])
    os._exit(0)


def wording(text: str, file: Path) -> str:
    """Return what is wrong with a message, empty if nothing is."""
    if file.name not in text and file.stem not in text:
        return "does not name the file"
    if len(text) > 600:
        return f"has {len(text)} characters"
    if not text.isprintable():
        return "is not one printable line"
    said = re.sub(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"", "''", text.replace(str(file), ""))
    found = PYTHON_WORDS.search(said)
    return f"says {found.group()!r}" if found else ""


def row(name: str, outcomes: Sequence[Outcome]) -> str:
    """Return a row of the table."""
    kinds = Counter(outcome.kind for outcome in outcomes)
    cells = [str(kinds[kind]) for kind in ("read", "refused", *FAULTS)]
    cells.append(f"{max(outcome.seconds for outcome in outcomes):.2f}")
    cells.append(f"{max(outcome.megabytes for outcome in outcomes):.0f}")
    return f"| {name} | {' | '.join(cells)} |"


def run(name: str, count: int, seed: int, keep: Path | None) -> list[Outcome]:
    """Return how ``count`` mutants of a parser's files end, listing those at fault on stderr."""
    parser = PARSERS[name]
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        files = parser.seeds(Path(folder))
        for file in files:
            sound = attempted(parser.read, file)
            assert sound.kind == "read", f"{name}: sound file {file.name}: {sound}"
        contents = [file.read_bytes() for file in files]
        for number in range(count):
            like = files[number % len(files)]
            file = like.with_name(f"mutant{like.suffix}")
            sound = contents[number % len(files)]
            file.write_bytes(mutant(sound, contents, f"{name} {seed} {number}"))
            outcomes.append(attempted(parser.read, file))
            if outcomes[-1].kind in FAULTS:
                said = f"{outcomes[-1].kind}: {outcomes[-1].text[:300]}"
                print(f"{name} {number}: {said}", file=sys.stderr, flush=True)
                if keep is not None:
                    (keep / name).mkdir(parents=True, exist_ok=True)
                    shutil.copy(file, keep / name / f"{number}{like.suffix}")
    return outcomes


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; return 1 if anything is at fault."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("parsers", nargs="*", metavar="PARSER", help=", ".join(PARSERS))
    options.add_argument("--count", type=int, default=400)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--keep", type=Path)
    chosen = options.parse_args(arguments)
    print(f"| parser | read | refused | {' | '.join(FAULTS)} | s, at most | MB, at most |")
    print("|---" * (5 + len(FAULTS)) + "|")
    at_fault = False
    for name in chosen.parsers or PARSERS:
        outcomes = run(name, chosen.count, chosen.seed, chosen.keep)
        at_fault |= any(outcome.kind in FAULTS for outcome in outcomes)
        print(row(name, outcomes), flush=True)
    return int(at_fault)


if __name__ == "__main__":
    sys.exit(main())
