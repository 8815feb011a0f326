"""Where the processor time of a replay goes: seconds, calls and milliseconds of each kind of work.

    python -m benchmarks.where_time_goes [SCENARIO] [--resolution standard] [--set KEY=VALUE ...]

The recording is converted and kernels are compiled before anything is counted. Time is that of the
thread that works; what a kind calls of another kind is counted with both.
"""

from __future__ import annotations

import argparse
import functools
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

from fem2d.body.body import Body
from fem2d.body.sparse import SparsePattern
from fem2d.contact.rigid import RigidContact
from fem2d.contact.self_contact import SelfContact
from fem2d.solvers import commit, linear
from scenarios.settings.scenario import load_scenario
from scenarios.sip.measures import LipMeasures
from scenarios.sip.replay import replay
from scenarios.sip.run import with_known_motion

KINDS: dict[str, tuple[Any, str]] = {
    "assembly of a lip": (Body, "response"),
    "factors of a lip": (linear.RefinedPardiso, "factorise"),
    "solutions of a lip": (linear.RefinedPardiso, "solve"),
    "tests of stability": (commit, "instability_of"),
    "contact with neck and teeth": (RigidContact, "evaluate"),
    "self-contact": (SelfContact, "evaluate"),
    "measures of increments, with strains and stresses": (LipMeasures, "measured"),
    "strains and stresses of increments": (Body, "fields"),
    "tangents put together": (SparsePattern, "matrix"),
}


class Clock:
    """Seconds of processor time and calls of each kind of work, over all threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._seconds: dict[str, float] = defaultdict(float)
        self._calls: dict[str, int] = defaultdict(int)

    def timed(self, kind: str, work: Callable[..., Any]) -> Callable[..., Any]:
        """Return work that is counted."""

        @functools.wraps(work)
        def counted(*values: Any, **named: Any) -> Any:
            begin = time.thread_time()
            try:
                return work(*values, **named)
            finally:
                spent = time.thread_time() - begin
                with self._lock:
                    self._seconds[kind] += spent
                    self._calls[kind] += 1

        return counted

    def table(self) -> str:
        """Return the kinds, the longest first, as a table."""
        rows = ["| | s | calls | ms each |", "|---|---|---|---|"]
        for kind in sorted(self._seconds, key=lambda kind: -self._seconds[kind]):
            seconds, calls = self._seconds[kind], self._calls[kind]
            rows.append(f"| {kind} | {seconds:.1f} | {calls:,} | {1e3 * seconds / calls:.2g} |")
        return "\n".join(rows)


def unseen(increment: object) -> None:
    """Do nothing with an increment."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", nargs="?", default="A38-F")
    parser.add_argument("--resolution", default="standard")
    parser.add_argument("--set", dest="settings", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    settings = [f"numerics.resolution={options.resolution}", *options.settings]
    scenario = with_known_motion(
        load_scenario(options.scenario, settings), lambda share, what: None
    )
    replay(scenario.with_(numerics={"resolution": "coarse"}), on_increment=unseen)
    clock = Clock()
    for kind, (owner, name) in KINDS.items():
        setattr(owner, name, clock.timed(kind, getattr(owner, name)))
    wall, processor = time.perf_counter(), time.process_time()
    outcome = replay(scenario, on_increment=unseen)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    print(f"{options.scenario}: {outcome.message}")
    print(f"{processor:.1f} s of processor time, {wall:.1f} s by the clock\n\n{clock.table()}")


if __name__ == "__main__":
    main()
