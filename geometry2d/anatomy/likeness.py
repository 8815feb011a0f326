"""Parts of a head that are only for pictures: the silhouette around the lips, and the bones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.anthropometry import HeadMeasurements
from geometry2d.anatomy.closed_face import ClosedFace, shift
from geometry2d.anatomy.lips import Lip, Placing
from geometry2d.curves import (
    arc_lengths,
    at_arc_lengths,
    heading_deg,
    smoothed,
    stretch,
    through_landmarks,
)

Array = NDArray[np.float64]

BROW_SMOOTHING_MM = 3.0
"""Gaussian width that smooths forehead and bridge of the nose, mm."""


def face_profile(
    m: HeadMeasurements,
    face: ClosedFace,
    upper: Lip,
    lower: Lip,
    in_head: Placing,
    with_jaw: Placing,
) -> Array:
    """Return the silhouette (n, 2), mm, from the hairline through the lips to the neck.

    Parameters
    ----------
    m, face
        Measurements and the landmarks of the closed face.
    upper, lower
        The lips; their skin is the middle part.
    in_head, with_jaw
        Maps of the upper and the lower face into the head.
    """
    nose = stretch(upper.chain, upper.margin, float(arc_lengths(upper.chain)[-1]))[::-1]
    dorsum_deg = heading_deg(nose[:2])
    bridge = nose[0] - face.nasion
    glabella = np.array([m.glabella_projection_mm, face.nasion[1] + 13.0])
    forehead = in_head(
        through_landmarks(
            [
                glabella + shift(-27.0, 63.0),
                glabella + shift(-6.0, 32.0),
                glabella,
                face.nasion,
                face.nasion + 0.45 * bridge + shift(0.7, 0.3),
                nose[0],
            ],
            [-42.0, -76.0, -92.0, -84.0, heading_deg([shift(0.0, 0.0), bridge]), dorsum_deg],
        )
    )
    forehead = smoothed(forehead, BROW_SMOOTHING_MM)
    chin = with_jaw(stretch(lower.chain, 0.0, lower.margin)[::-1])
    end = chin[-1]
    neck = through_landmarks(
        [
            end,
            end + shift(-12.0, -1.0),
            end + shift(-23.0, -13.0),
            end + shift(-20.0, -34.0),
            end + shift(-22.5, -50.0),
            end + shift(-21.0, -72.0),
        ],
        [heading_deg(chin[-2:]), 190.0, 262.0, 276.0, 264.0, 276.0],
    )
    return np.concatenate([forehead[:-1], in_head(nose), chin, neck[1:]])


def cranium(profile: Array) -> Array:
    """Return the back of the head (n, 2), mm, from the profile's lower end over the crown.

    It closes the silhouette: a cranium of usual size about the ear marker.
    """
    return through_landmarks(
        [
            [profile[-1, 0] - 96.0, profile[-1, 1]],
            [-62.0, -62.0],
            [-103.0, 32.0],
            [-10.0, 134.0],
            profile[0],
        ],
        [82.0, 92.0, 88.0, 0.0, heading_deg(profile[:2])],
    )


def ear() -> list[Array]:
    """Return helix and concha of an ear of usual size (63 mm) as curves (n, 2), mm.

    The ear marker is on the tragus, the origin. No measurement uses the ear.
    """
    helix = through_landmarks(
        [(0.5, 4.0), (2.0, 18.0), (-14.0, 34.0), (-32.0, 20.0), (-22.0, -12.0), (-7.0, -29.0),
         (0.0, -14.0), (0.5, -3.0)],
        [80.0, 95.0, 180.0, 268.0, 298.0, 0.0, 88.0, 80.0],
    )  # fmt: skip
    concha = through_landmarks(
        [(-5.0, 15.0), (-13.0, 24.0), (-23.0, 14.0), (-15.0, -9.0), (-5.0, -10.0), (-1.5, -4.0)],
        [100.0, 180.0, 265.0, 305.0, 20.0, 75.0],
    )
    return [helix, concha]


def upper_jaw(lip: Lip) -> Array:
    """Return the polygon (n, 2) of upper jaw, palate and nasal septum behind a lip."""
    front = stretch(lip.chain, 0.0, lip.fornix)
    top, gum = front[0], front[-1]
    palate = _palate(lip)
    septum = through_landmarks(
        [palate[-1] + shift(0.0, 6.0), gum + shift(-7.0, 13.0), top + shift(-9.0, 4.0), top],
        [0.0, 25.0, 35.0, -50.0],
    )
    return np.concatenate([front[:-1], palate, septum[:-1]])


def lower_jaw(lip: Lip) -> Array:
    """Return the polygon (n, 2) of the lower jaw behind a lip."""
    front = stretch(lip.chain, lip.fornix, float(arc_lengths(lip.chain)[-1]))
    return np.concatenate([front, _inside_of_jaw(lip)[1:-1]])


def mouth(upper: Lip, lower: Lip, in_head: Placing, with_jaw: Placing) -> Array:
    """Return the polygon (n, 2) of the mouth's cavity between lips, palate and lower jaw."""
    roof = np.concatenate([stretch(upper.chain, upper.fornix, upper.margin)[::-1], _palate(upper)])
    inside = _inside_of_jaw(lower)
    bottom = np.concatenate(
        [inside[len(inside) // 3 :], stretch(lower.chain, lower.margin, lower.fornix)[::-1]]
    )
    above, below = in_head(roof), with_jaw(bottom)
    back = through_landmarks(
        [above[-1], 0.5 * (above[-1] + below[0]) + shift(-14.0, -4.0), below[0]],
        [200.0, 268.0, -15.0],
    )
    return np.concatenate([above[:-1], back, below[1:]])


def _palate(lip: Lip) -> Array:
    gum = at_arc_lengths(lip.chain, lip.fornix)
    return through_landmarks(
        [gum, gum + shift(-9.0, -3.5), gum + shift(-17.0, 5.0), gum + shift(-46.0, 8.0)],
        [255.0, 150.0, 130.0, 180.0],
    )


def _inside_of_jaw(lip: Lip) -> Array:
    """Return the inner side (n, 2), mm, of the lower jaw, from its lower border up to the gum."""
    end = lip.chain[-1]
    gum = at_arc_lengths(lip.chain, lip.fornix)
    return through_landmarks(
        [end, end + shift(2.0, 4.0), gum + shift(-12.0, -18.0), gum + shift(-9.0, 3.0), gum],
        [150.0, 20.0, 72.0, 75.0, -60.0],
    )
