"""A made-up motion that brings the A38 neck to the lower lip of the usual head and away again."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geometry2d.anatomy.head import head_section
from geometry2d.neck import A38_NECK, neck_section
from mocap.motion.motion import MarkedBody, Motion

AWAY_MM, PRESSED_MM = 8.0, 0.4


def approach() -> Motion:
    """Return a motion of two seconds, level, with standard errors."""
    head, rim = head_section(), neck_section(A38_NECK).rim_edge("lower")
    x, y = head.landmarks["nose"]
    time = np.linspace(0.0, 2.0, 41)
    away = AWAY_MM - (AWAY_MM + PRESSED_MM) * np.sin(0.5 * np.pi * time) ** 2
    lower_lip = head.landmarks["lower_lip"]
    place = lower_lip - rim + np.column_stack([away, np.zeros_like(away)])
    return Motion.of(
        time,
        place,
        np.zeros_like(time),
        sigma=np.full((time.size, 3), 1.0) * [0.1, 0.1, 0.002],
        head_body=MarkedBody("head", ("ear", "nose"), float(np.arctan2(y, x))),
        package_body=MarkedBody("package", ("package_lower", "package_upper"), np.pi / 2),
    )


def write_base(folder: Path) -> Path:
    """Write a scenario of this motion, and the motion; return the scenario's file."""
    folder.mkdir(parents=True, exist_ok=True)
    approach().write(folder / "motion.csv")
    file = folder / "base.toml"
    file.write_text(
        'name = "base"\n[motion]\nfile = "motion.csv"\n[numerics]\nresolution = "coarse"\n'
    )
    return file
