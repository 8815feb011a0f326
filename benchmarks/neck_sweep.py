"""Twelve dimensions of a neck, each varied by ± 10 % in eleven values: pressures move smoothly.

    python -m benchmarks.neck_sweep --out DIR [--scenario A38-F] [--resolution coarse]
        [--set KEY=VALUE ...] [--dimensions NAME ...] [--seconds S] [--pictures]

The neck follows the film, carried by its lower rim edge. Every sip is kept in DIR: a call that was
interrupted, or that its seconds ended, goes on where it was. With ``--pictures`` each neck has its
preview in DIR, and each dimension a sheet of them. A jump is the difference between neighbours over
the smaller of the two, in per cent; what is found odd about a neck before the sip is counted.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry2d.foundation.output import file_at_once
from geometry2d.neck import NeckMeasurements
from scenarios.campaign.cases import case_of
from scenarios.campaign.engine import opened_engine
from scenarios.campaign.sip import SipRow, SipTask, solved_sip
from scenarios.results.quantities import LIPS
from scenarios.settings.scenario import Scenario, load_scenario
from scenarios.sip.replay import placed_neck
from scenarios.sip.run import with_known_motion
from scenarios.views.preview import write_preview

SHARES = np.linspace(0.9, 1.1, 11)
"""Of a dimension as the scenario's neck has it."""

JUMP_PERCENT = 15.0
"""What neighbours may differ by at most."""

DIMENSIONS = (
    "opening's diameter",
    "thread's height",
    "pitch_mm",
    "flank_deg",
    "crest_width_mm",
    "land_mm",
    "wall_thickness_mm",
    "rim_radius_mm",
    "crest_radius_mm",
    "root_radius_mm",
    "length_mm",
    "mark_behind_thread_mm",
)
"""The first two move the thread's and its root's diameter together, and the thread's alone."""


@dataclass(frozen=True)
class Varied:
    """A neck of the sweep: which dimension, its share of what it was, its value, and its sip."""

    dimension: str
    value: float
    scenario: Scenario


def changed(neck: NeckMeasurements, dimension: str, share: float) -> dict[str, float]:
    """Return the measurements of a neck with a dimension so many times what it is, and its value.

    The value, mm or degrees, is the last one.
    """
    if dimension == "opening's diameter":
        root = share * neck.root_diameter_mm
        thread = root + neck.thread_diameter_mm - neck.root_diameter_mm
        return {"thread_diameter_mm": thread, "root_diameter_mm": root}
    if dimension == "thread's height":
        height = share * (neck.thread_diameter_mm - neck.root_diameter_mm)
        return {"thread_diameter_mm": neck.root_diameter_mm + height}
    return {dimension: share * getattr(neck, dimension)}


def necks(base: Scenario, dimensions: Sequence[str]) -> Iterator[Varied]:
    """Yield the necks of the sweep, dimension by dimension, each in ascending order."""
    measurements = base.package.measurements
    for dimension in dimensions:
        for share in SHARES:
            if np.isclose(share, 1.0):
                own = changed(measurements, dimension, 1.0)
                yield Varied(dimension, list(own.values())[-1], base)
                continue
            keys = changed(measurements, dimension, float(share))
            scenario = base.with_(package={k: round(v, 6) for k, v in keys.items()})
            yield Varied(dimension, list(keys.values())[-1], scenario)


def computed(varied: list[Varied], out: Path, seconds: float) -> list[SipRow | None]:
    """Return the rows of the sips that are whole in ``out`` after at most so many seconds."""
    cases = [case_of(each.scenario, {}, out) for each in varied]
    texts = {case.identity: case.scenario_toml for case in cases}
    missing = [name for name in texts if SipRow.read(out / name) is None]
    tasks = [SipTask(str(out / name), texts[name], keep="histories") for name in missing]
    began = time.monotonic()
    if tasks:
        with opened_engine(workers=2) as engine, closing(engine.ended(solved_sip, tasks)) as ended:
            for _ in ended:
                if time.monotonic() - began > seconds:
                    break
    return [SipRow.read(out / case.identity) for case in cases]


def largest_jump_percent(values: list[float]) -> tuple[float, int]:
    """Return the largest difference of neighbours, % of the smaller, and the second's index."""
    ascending = np.array(values)
    jumps = np.abs(np.diff(ascending)) / np.minimum(ascending[1:], ascending[:-1])
    return 100 * float(jumps.max()), int(jumps.argmax()) + 1


def row(varied: list[Varied], rows: list[SipRow | None], odd: list[str]) -> str:
    """Return a dimension as a row of the table."""
    first, last = varied[0].value, varied[-1].value
    cells = [varied[0].dimension, f"{first:.3g} … {last:.3g}"]
    done = [each.measures for each in rows if each is not None and each.measures]
    if len(done) < len(varied):
        ends = {each.status for each in rows if each is not None}
        return f"| {' | '.join([*cells, f'{len(done)} of {len(varied)} {sorted(ends)}'])} |"
    for lip in LIPS:
        pressures = [each[f"{lip}_lip_window_kpa_peak"] for each in done]
        jump, at = largest_jump_percent(pressures)
        cells += [" ".join(f"{each:.0f}" for each in pressures), f"{jump:.0f}"]
        cells[-1] += f" to {varied[at].value:.4g}" if jump > JUMP_PERCENT else ""
    return f"| {' | '.join([*cells, '; '.join(odd) or 'none'])} |"


def pictures(varied: list[Varied], out: Path) -> None:
    """Draw the previews of a dimension's necks, if they are missing, and a sheet of them."""
    from matplotlib.figure import Figure
    from matplotlib.image import imread

    dimension = varied[0].dimension.replace(" ", "-").replace("'", "")
    files = [out / f"{dimension}-{number:02d}.png" for number in range(len(varied))]
    for each, file in zip(varied, files, strict=True):
        if not file.is_file():
            write_preview(each.scenario, file, progress=lambda share, what: None)
    sheet = Figure(figsize=(18, 22))
    for place, (each, file) in enumerate(zip(varied, files, strict=True)):
        axes = sheet.add_axes(((place % 2) / 2, 1 - (place // 2 + 1) / 6, 0.5, 0.96 / 6))
        axes.imshow(imread(file))
        axes.set_axis_off()
        axes.set_title(f"{each.dimension} {each.value:.4g}", fontsize=9)
    with file_at_once(out / f"{dimension}.png") as partial:
        sheet.savefig(partial, dpi=75)


def odd_about(varied: list[Varied]) -> list[str]:
    """Return what is found odd about a dimension's necks before a sip, and for how many."""
    count: dict[str, int] = {}
    for each in varied:
        for finding in placed_neck(each.scenario).findings:
            count[finding.subject] = count.get(finding.subject, 0) + 1
    return [f"{subject}: {number}" for subject, number in count.items()]


def filmed(name: str, settings: Sequence[str], out: Path) -> Scenario:
    """Return the scenario with its motion in a file of ``out``."""
    scenario = load_scenario(name, settings)
    file = out / "motion.csv"
    if not file.is_file():
        out.mkdir(parents=True, exist_ok=True)
        known = with_known_motion(scenario, lambda share, what: None)
        with file_at_once(file) as partial:
            known.known_motion().write(partial)
    return scenario.with_motion(file)


def main() -> None:
    """Compute what is missing, for as long as is allowed, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--scenario", default="A38-F")
    parser.add_argument("--resolution", default="coarse")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--dimensions", nargs="*", default=DIMENSIONS, choices=DIMENSIONS)
    parser.add_argument("--seconds", type=float, default=1e9, help="no new sip after so many")
    parser.add_argument("--pictures", action="store_true", help="draw the previews too")
    options = parser.parse_args()
    out: Path = options.out.resolve()
    settings = [f"numerics.resolution={options.resolution}", *options.set]
    base = filmed(options.scenario, settings, out)
    varied = list(necks(base, options.dimensions))
    rows = computed(varied, out, options.seconds)
    head = ["dimension", "mm or degrees"]
    head += [text for lip in LIPS for text in (f"{lip} window, kPa", "largest jump, %")]
    print(f"| {' | '.join([*head, 'findings'])} |\n|{'---|' * (len(head) + 1)}")
    for start in range(0, len(varied), len(SHARES)):
        own = slice(start, start + len(SHARES))
        print(row(varied[own], rows[own], odd_about(varied[own])), flush=True)
        if options.pictures:
            pictures(varied[own], out)


if __name__ == "__main__":
    main()
