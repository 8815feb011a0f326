"""Whether a coarser resolution ranks ten necks as a finer one does.

    python -m benchmarks.quick_ranking --out DIR [--scenario A38-F] [--coarser quick]
        [--finer standard] [--seconds S]

Two necks of the library, and eight that differ from the first in land, thread height, rim radius
and pitch, follow one film, carried by the lower rim edge. Every sip is kept in DIR: a call that was
interrupted, or that its seconds ended, goes on where it was. For each peak of what lips feel, the
necks in the order of the finer resolution with the values of both, and how many of the pairs of
necks that differ by more than 5 or 10 % at the finer one the coarser one puts the same way round.
"""

from __future__ import annotations

import argparse
from itertools import combinations
from pathlib import Path

import numpy as np

from benchmarks.neck_sweep import Varied, changed, computed, filmed
from scenarios.campaign.sip import SipRow
from scenarios.results.quantities import LIPS
from scenarios.settings.scenario import Scenario

SHARES = {
    "land_mm": (0.75, 2.0),
    "thread's height": (0.5, 1.5),
    "rim_radius_mm": (0.5, 1.15),
    "pitch_mm": (0.8, 1.25),
}
"""Of the first neck's own dimensions."""

OTHER_NECK = "DC"

PEAKS = tuple(
    f"{lip}_lip_{name}"
    for name in ("window_kpa", "window_1mm_kpa", "window_1_5mm_kpa", "force_n")
    for lip in LIPS
)

APART_PERCENT = (5.0, 10.0)
"""What a pair of necks differs by at least that counts."""


def ten_necks(base: Scenario) -> list[Varied]:
    """Return the necks, each with its name, its changed dimension and its sip."""
    own = base.package.measurements
    necks = [
        Varied(base.package.neck, 1.0, base),
        Varied(OTHER_NECK, 1.0, base.with_(package={"neck": OTHER_NECK})),
    ]
    for dimension, shares in SHARES.items():
        for share in shares:
            keys = {name: round(value, 6) for name, value in changed(own, dimension, share).items()}
            necks.append(Varied(dimension, share, base.with_(package=keys)))
    return necks


def ranking(necks: list[Varied], coarser: list[SipRow], finer: list[SipRow], peak: str) -> str:
    """Return how two resolutions rank the necks by one peak, as a row of a table."""
    rough, exact = (
        np.array([row.measures[f"{peak}_peak"] for row in rows]) for rows in (coarser, finer)
    )
    order = np.argsort(exact)
    cells = [peak]
    cells.append(
        ", ".join(
            f"{necks[k].dimension}{'' if necks[k].value == 1 else f' ×{necks[k].value:g}'} "
            f"{exact[k]:.3g} ({rough[k]:.3g})"
            for k in order
        )
    )
    for percent in APART_PERCENT:
        pairs = [
            (one, other)
            for one, other in combinations(order, 2)
            if exact[other] > (1 + percent / 100) * exact[one]
        ]
        kept = sum(rough[other] > rough[one] for one, other in pairs)
        cells.append(f"{kept} of {len(pairs)}")
    off = 100 * (rough / exact - 1)
    cells.append(f"{off.min():+.0f} … {off.max():+.0f}")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Compute what is missing, for as long as is allowed, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--scenario", default="A38-F")
    parser.add_argument("--coarser", default="quick")
    parser.add_argument("--finer", default="standard")
    parser.add_argument("--seconds", type=float, default=1e9, help="no new sip after so many")
    options = parser.parse_args()
    rows: list[list[SipRow]] = []
    for resolution in (options.coarser, options.finer):
        base = filmed(
            options.scenario, [f"numerics.resolution={resolution}"], options.out.resolve()
        )
        necks = ten_necks(base)
        done = computed(necks, options.out.resolve(), options.seconds)
        whole = [row for row in done if row is not None and row.measures]
        print(f"{resolution}: {len(whole)} of {len(necks)} sips are whole", flush=True)
        rows.append(whole)
    if min(map(len, rows)) < len(necks):
        return
    print("| peak | finer (coarser), ascending | pairs > 5 % | > 10 % | coarser off, % |")
    print("|---|---|---|---|---|")
    for peak in PEAKS:
        print(ranking(necks, *rows, peak))


if __name__ == "__main__":
    main()
