"""What many tests begin with, made once for all processes that run tests."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from filelock import FileLock


def made_once(base: Path, name: str, make: Callable[[Path], object]) -> Path:
    """Return a path that ``make`` filled, in this process or in another worker's; only read it.

    ``base`` is the folder of this process's test files, which lies beside those of other workers.
    """
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "shared"
    shared.mkdir(exist_ok=True)
    place, unfinished = shared / name, shared / f"{name}.unfinished"
    with FileLock(shared / f"{name}.lock"):
        if not place.exists():
            make(unfinished)
            unfinished.rename(place)
    return place
