"""Tables of boundary conditions for finite elements: displacement of rigid bodies against time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion.motion import Motion

Array: TypeAlias = NDArray[np.float64]

DEGREES_OF_FREEDOM = ("u1", "u2", "ur3")


def displacement_tables(motion: Motion) -> dict[str, Array]:
    """Return time and displacement since the start (n, 2) by table name, mm and rad.

    ``head_*`` and ``package_*`` are displacements of the first marker in the world plane;
    ``relative_*`` is that of the package's first marker in the head frame.
    """
    relative = motion.relative_mm - motion.relative_mm[0]
    package = motion.package_mm - motion.package_mm[0]
    columns: Mapping[str, tuple[Array, Array, Array]] = {
        "head": (motion.head_mm[:, 0], motion.head_mm[:, 1], motion.head_rad),
        "package": (package[:, 0], package[:, 1], motion.package_rad),
        "relative": (relative[:, 0], relative[:, 1], motion.relative_rad),
    }
    time = motion.time_s - motion.time_s[0]
    return {
        f"{body}_{name}": np.column_stack([time, values])
        for body, parts in columns.items()
        for name, values in zip(DEGREES_OF_FREEDOM, parts, strict=True)
    }


def write_boundary_conditions(motion: Motion, folder: Path) -> None:
    """Write one tab-separated table per body and degree of freedom into ``folder``.

    Each row is the time since the start (s) and the displacement (mm or rad), as Abaqus expects
    them under ``*AMPLITUDE, DEFINITION=TABULAR``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in displacement_tables(motion).items():
        lines = [f"{time:.6f}\t{value:.9f}\n" for time, value in table]
        (folder / f"{name}.txt").write_text("".join(lines), encoding="utf-8")
