"""A made-up motion in which no two coordinates are alike: test data, not a result."""

from __future__ import annotations

from typing import Any

import numpy as np

from mocap.motion.motion import MarkedBody, Motion


def made_up_motion(time_s: np.ndarray, **options: Any) -> Motion:
    """Return a package that comes and turns while the head nods; options as of `Motion.of`."""
    share = (time_s - time_s[0]) / (time_s[-1] - time_s[0])
    bodies = {
        "head_body": MarkedBody("head", ("ear", "nose"), 0.2143),
        "package_body": MarkedBody("package", ("package_lower", "package_upper"), 2.1957),
    }
    return Motion.of(
        time_s,
        np.column_stack([120 - 31 * share**2, -58 + 17 * np.sin(share)]),
        0.4 * share**2,
        sigma=np.column_stack([0.05 + 0 * share, 0.07 + 0 * share, 0.002 * share]),
        head_mm=np.column_stack([2 * share, -3 * share**2]),
        head_rad=-0.1 * share,
        **(bodies | options),
    )
