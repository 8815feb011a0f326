"""Exact area coverage of polygons on a pixel grid.

A pixel of an ideal sensor collects the light of its whole square. Its value for a flat-coloured
polygon is the fraction of its area that the polygon covers. With exact fractions the centroid of a
rendered shape is that of the polygon, to rounding. Sampled anti-aliasing would move edges by
hundredths of a pixel, the error of a good tracker.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def coverage(corners_px: ArrayLike, shape: tuple[int, int]) -> Array:
    """Return for each pixel the fraction of its area that a simple polygon covers.

    Parameters
    ----------
    corners_px
        (n, 2) corners x, y in px, x right, y down, integers at pixel centres; either orientation.
    shape
        (rows, columns) of the grid; parts of the polygon outside it are ignored.

    Notes
    -----
    Every edge is cut at the grid lines. A part inside one pixel that rises by dy at the mean
    distance x from the pixel's left border adds dy (1 - x) to the signed area of that pixel and dy
    to every pixel right of it (Green's theorem row by row). A cumulative sum over the row gives all
    areas.
    """
    rows, columns = shape
    corners = np.asarray(corners_px, float) + 0.5
    start, end = _edge_pieces(corners, np.roll(corners, -1, axis=0))
    rise = end[:, 1] - start[:, 1]
    middle = (start + end) / 2
    row = np.floor(middle[:, 1]).astype(int)
    kept = (row >= 0) & (row < rows) & (rise != 0)
    row, rise = row[kept], rise[kept]
    x = np.clip(middle[kept, 0], 0, columns)
    column = np.floor(x).astype(int)
    right = x - column
    pitch = columns + 2
    cell = row * pitch + column
    signed = np.bincount(cell, weights=rise * (1 - right), minlength=rows * pitch)
    signed += np.bincount(cell + 1, weights=rise * right, minlength=rows * pitch)
    area = np.abs(np.cumsum(signed.reshape(rows, pitch), axis=1)[:, :columns])
    return np.clip(area, 0, 1)


def _edge_pieces(start: Array, end: Array) -> tuple[Array, Array]:
    """Cut edges (n, 2)-(n, 2) wherever they cross a grid line x = k or y = k."""
    step = end - start
    owners, fractions = [np.arange(len(start))], [np.zeros(len(start))]
    for axis in (0, 1):
        low = np.minimum(start[:, axis], end[:, axis])
        high = np.maximum(start[:, axis], end[:, axis])
        first = np.floor(low).astype(int) + 1
        crossings = np.maximum(np.ceil(high).astype(int) - first, 0)
        owner = np.repeat(np.arange(len(start)), crossings)
        within = np.arange(owner.size) - np.repeat(np.cumsum(crossings) - crossings, crossings)
        line = first[owner] + within
        owners.append(owner)
        fractions.append((line - start[owner, axis]) / step[owner, axis])
    owner, fraction = np.concatenate(owners), np.concatenate(fractions)
    order = np.lexsort((fraction, owner))
    owner, fraction = owner[order], np.clip(fraction[order], 0, 1)
    is_last = np.append(owner[1:] != owner[:-1], True)
    following = np.where(is_last, 1.0, np.append(fraction[1:], 1.0))
    begin = start[owner] + fraction[:, None] * step[owner]
    finish = start[owner] + following[:, None] * step[owner]
    return begin, finish
