"""How long sips take, beside another state of this project, in turn and in one run.

    python -m benchmarks.speed TREE [--scenarios A38-F ...] [--resolution standard] [--repeats 5]

TREE is a checkout of the state to compare with (``git worktree add TREE COMMIT``). Each recording
is converted once, by this state; both replay the same motion in a process of their own, this state
and the other in turn, without a run directory. Kernels are compiled before anything is counted.
Prints medians of seconds by the clock and of processor time, what they took (increments,
iterations), and how far the felt peaks of the two are apart. For a hand that yields name its
reference run: ``--set hand.mode=same --set hand.reference=RUN``.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from scenarios.settings.scenario import load_scenario
from scenarios.sip.run import with_known_motion

HERE = Path(__file__).parents[1]
FOUR = ("A38-F", "A38-AE", "DC-F", "DC-AE")
PEAKS = tuple(f"{lip}_lip_window_kpa" for lip in ("upper", "lower"))

ONE_REPLAY = """
import json, sys, time
from mocap.motion.motion import Motion
from scenarios.results.solution import Solution
from scenarios.settings.scenario import load_scenario
from scenarios.sip.replay import replay
name, motion, settings, peaks = json.loads(sys.argv[1])
scenario = load_scenario(name, settings).with_motion(Motion.read(motion))
hand = scenario.hand
reference = None if hand.mode == "recorded" else Solution.load(hand.reference)
worst = dict.fromkeys(peaks, 0.0)
def look(increment):
    for peak in worst:
        worst[peak] = max(worst[peak], float(increment.history[peak]))
clock, processor = time.perf_counter(), time.process_time()
outcome = replay(scenario, on_increment=look, reference=reference)
print(json.dumps({
    "clock": time.perf_counter() - clock, "processor": time.process_time() - processor,
    "finished": outcome.finished, "message": outcome.message.split(";")[0], "peaks": worst,
}))
"""


def replayed(tree: Path, name: str, motion: Path, settings: list[str]) -> dict:
    """Return what one replay took in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", ONE_REPLAY, json.dumps([name, str(motion), settings, PEAKS])],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        sys.exit(f"{name} in {tree} failed:\n{done.stderr}")
    result: dict = json.loads(done.stdout.splitlines()[-1])
    if not result["finished"]:
        sys.exit(f"{name} in {tree} did not finish: {result['message']}")
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tree", type=Path, help="checkout of the state to compare with")
    parser.add_argument("--scenarios", nargs="+", default=FOUR)
    parser.add_argument("--resolution", default="standard")
    parser.add_argument("--set", dest="settings", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    settings = [f"numerics.resolution={options.resolution}", *options.settings]
    trees = {"here": HERE, "there": options.tree.resolve()}
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.scenarios:
            motion = Path(folder) / f"{name}.csv"
            known = with_known_motion(load_scenario(name), lambda share, what: None)
            known.known_motion().write(motion)
            for tree in trees.values():
                replayed(tree, name, motion, ["numerics.resolution=coarse", *options.settings])
            runs: dict[str, list[dict]] = {which: [] for which in trees}
            for _ in range(options.repeats):
                for which, tree in trees.items():
                    runs[which].append(replayed(tree, name, motion, settings))
            for which, done in runs.items():
                clock, processor = (
                    statistics.median(run[key] for run in done) for key in ("clock", "processor")
                )
                print(f"{name:<8}{which:<6} {clock:7.2f} s, {processor:7.2f} s of processor time: "
                      f"{done[0]['message']}", flush=True)  # fmt: skip
            here, there = runs["here"], runs["there"]
            faster = {
                key: statistics.median(run[key] for run in there)
                / statistics.median(run[key] for run in here)
                for key in ("clock", "processor")
            }
            apart = max(abs(here[0]["peaks"][peak] / there[0]["peaks"][peak] - 1) for peak in PEAKS)
            print(f"{name:<8}{faster['clock']:.2f} times faster by the clock, "
                  f"{faster['processor']:.2f} by processor time; felt peaks {100 * apart:.3g} % "
                  "apart", flush=True)  # fmt: skip
            ratios.append([faster["clock"], faster["processor"]])
    clock, processor = np.exp(np.mean(np.log(ratios), axis=0))
    print(f"geometric means: {clock:.2f} by the clock, {processor:.2f} by processor time")


if __name__ == "__main__":
    main()
