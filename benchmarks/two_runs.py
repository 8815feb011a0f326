"""Two replays into one directory: one of them is refused, whenever it starts.

    python -m benchmarks.two_runs

A short replay with friction 1 starts, and after each of ten delays one with friction 0.5 into the
same directory. What is left has to be, byte for byte, the whole run of one of them, and the other
one ends with exit code 2 and one line.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path

from benchmarks.kills import REFUSED, Ended, in_a_process
from benchmarks.short_sip import short_sip
from scenarios.settings.scenario import Scenario
from scenarios.sip.run import solve

DELAYS = 10
SAME = ("history.csv", "fields.h5", "scenario.toml")


def same_files(one: Path, other: Path) -> bool:
    """Whether two run directories hold the same run."""
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in SAME)


def after(delay_s: float, scenario: Scenario, out: Path, ended: list[Ended]) -> threading.Thread:
    """Return a thread that waits and replays in another process; it adds how that ended."""

    def work() -> None:
        time.sleep(delay_s)
        ended.append(in_a_process(lambda: solve(scenario, out=out)))

    return threading.Thread(target=work)


def main() -> int:
    """Print a row for each delay; return 1 if any is wrong."""
    wrong = 0
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        first = short_sip(place)
        second = first.with_(contact={"friction": 0.5})
        whole = [place / "first", place / "second"]
        took = min(
            in_a_process(lambda s=scenario, out=out: solve(s, out=out)).seconds
            for scenario, out in zip((first, second), whole, strict=True)
        )
        for number in range(DELAYS):
            delay = took * number / (DELAYS - 1)
            out, ended = place / f"{number}", [[], []]
            threads = [
                after(wait, scenario, out, codes)
                for wait, scenario, codes in ((0.0, first, ended[0]), (delay, second, ended[1]))
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            codes = [each[0].code for each in ended]
            winner = codes.index(0) if 0 in codes else None
            right = sorted(codes) == [0, REFUSED] and same_files(out, whole[codes.index(0)])
            wrong += not right
            print(f"| {delay:.1f} s | exit codes {codes} | run of {winner} | {right} |", flush=True)
    print(f"{wrong} of {DELAYS} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
