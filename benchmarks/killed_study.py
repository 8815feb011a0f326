"""A study of formulas, killed at random moments, ends with the table of an undisturbed one.

python -m benchmarks.killed_study --kills 20
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.support.killed_study import killed_and_finished, table_of, undisturbed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        killed, known = killed_and_finished(
            Path(folder) / "killed", kills=options.kills, seed=options.seed
        )
        whole = undisturbed(Path(folder) / "whole", len(killed.rows))
    same = table_of(killed) == table_of(whole)
    print(f"killed {len(known)} times, when {known} of {len(killed.rows)} sips were there")
    print(f"the table is {'the same' if same else 'ANOTHER'} as that of an undisturbed study")


if __name__ == "__main__":
    main()
