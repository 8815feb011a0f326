"""How long a first run takes to its first increment, on a machine with no compiled kernels.

    python -m benchmarks.first_run [SCENARIO] [--resolution coarse] [--warm]

In a process of its own and with an empty cache of kernels: seconds of processor time and by the
clock from the start to the end of the imports, of the conversion of the video, of the model, and to
the first increment. With ``--warm`` the same once more with the cache that this left.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile

ONE_RUN = """
import sys, time
began = time.perf_counter()
def told(what):
    print(f"| {what} | {time.process_time():.1f} | {time.perf_counter() - began:.1f} |", flush=True)
from scenarios.settings.scenario import load_scenario
from scenarios.sip.replay import replay
from scenarios.sip.run import with_known_motion
told("imports")
scenario = load_scenario(sys.argv[1], ["numerics.resolution=" + sys.argv[2]])
known = with_known_motion(scenario, lambda share, what: None)
told("motion from the video")
def first(increment):
    told("first increment")
    raise KeyboardInterrupt
replay(known, on_model=lambda model: told("model"), on_increment=first)
"""


def main() -> None:
    """Run in a process of its own, with kernels uncompiled, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", nargs="?", default="A38-F")
    parser.add_argument("--resolution", default="coarse")
    parser.add_argument("--warm", action="store_true", help="once more, with compiled kernels")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as cache:
        for kind in ("uncompiled", "compiled")[: 2 if options.warm else 1]:
            print(f"| {kind}, to the end of | processor, s | clock, s |\n|---|---|---|", flush=True)
            subprocess.run(
                [sys.executable, "-c", ONE_RUN, options.scenario, options.resolution],
                env={**os.environ, "NUMBA_CACHE_DIR": cache},
                check=True,
            )


if __name__ == "__main__":
    main()
