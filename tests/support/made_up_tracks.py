"""Tracks made up for a test."""

import numpy as np

from mocap.tracking.tracks import Tracks


def seen_at(times: np.ndarray) -> Tracks:
    """One marker seen at some times, whose frames are not known."""
    n = times.size
    return Tracks(
        frame=np.arange(n),
        time_s=times,
        names=("ear",),
        position_px=np.ones((n, 1, 2)),
        sigma_px=np.ones((n, 1)),
        status=np.full((n, 1), "seen", dtype="<U9"),
    )
