"""Arrays as a page holds them: rounded to what it shows, differences from row to row, compressed.

The page shows a value with a fixed number of decimals. It holds the value rounded to them, so what
is read there is what the run directory holds, to the digits shown. Most rows differ little from the
row before, so that differences compress to a fifth.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

ABSENT = {"int16": np.iinfo(np.int16).min, "int32": np.iinfo(np.int32).min}
"""What stands for nan, by type."""


def packed(values: NDArray[Any], decimals: int) -> dict[str, Any]:
    """Return an array as an object of JSON; ``unpacked`` in ``scripts/arrays.js`` reads it.

    Parameters
    ----------
    values
        (rows, ...), nan where there is no value.
    decimals
        what is kept behind the point: the error is at most half a unit of the last place.

    Raises
    ------
    OverflowError
        If a value is too large for 32 bits at these decimals.
    """
    scaled = np.rint(np.asarray(values, float) * 10.0**decimals)
    largest = float(np.nanmax(np.abs(scaled), initial=0.0))
    kind = "int16" if largest < -ABSENT["int16"] else "int32"
    if largest >= -ABSENT["int32"]:
        raise OverflowError(f"{largest} does not fit into 32 bits")
    whole = np.where(np.isnan(scaled), ABSENT[kind], scaled).astype(kind)
    # Integers wrap around, and so do their sums on the page: no difference is too large.
    steps = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))
    data = zlib.compress(np.ascontiguousarray(steps, steps.dtype.newbyteorder("<")).tobytes(), 6)
    return {
        "data": base64.b64encode(data).decode("ascii"),
        "shape": list(whole.shape),
        "type": kind,
        "decimals": decimals,
    }
