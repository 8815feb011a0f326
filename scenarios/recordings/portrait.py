"""A head in profile, as rendered in the recordings.

The outline of the face is the one that the simulation uses. It lies in the world plane z = 0, so
that in the picture the neck of the package meets the lips where it meets them in the simulation.
The ear and the head's markers lie `FACE_DEPTH_MM` nearer the camera, in one plane. That is a
simplification: a nose marker on a real person lies deeper than an ear marker.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.rigid import RigidMotion
from mocap.synthetic.camera import Colour
from mocap.synthetic.scene import Marker, SceneBody, ScenePolygon
from scenarios.recordings.strokes import arc, ellipse, pair, shifted, smooth, smooth_line, stroke

Array = NDArray[np.float64]

# Half the distance between the tragi, 131.4 mm (Prog Orthod 2013), less the ear's own thickness.
FACE_DEPTH_MM = 60.0

BACKGROUND: Colour = (0.66, 0.70, 0.72)
SKIN: Colour = (0.86, 0.67, 0.56)
SHADE: Colour = (0.50, 0.31, 0.25)
EAR: Colour = (0.83, 0.60, 0.50)
GLOW: Colour = (0.97, 0.82, 0.72)
BLUSH: Colour = (0.84, 0.48, 0.42)
LIP: Colour = (0.74, 0.42, 0.39)
MOUTH: Colour = (0.25, 0.09, 0.09)
HAIR: Colour = (0.21, 0.15, 0.11)
STRAND: Colour = (0.33, 0.24, 0.17)
EYE_WHITE: Colour = (0.90, 0.88, 0.85)
TOOTH: Colour = (0.88, 0.85, 0.78)
IRIS: Colour = (0.30, 0.24, 0.18)
SHIRT: Colour = (0.25, 0.33, 0.42)


def head_body(section: HeadSection, motion: RigidMotion) -> SceneBody:
    """Return the head in profile with the ear and the nose marker."""
    spots = section.landmarks
    face = _silhouette(np.asarray(section.profile))
    shapes = [
        ScenePolygon(face, SKIN, name="face"),
        *_face_shades(section),
        *_eye(section),
        *_mouth(section),
        *_ear(),
        *_hair(section),
    ]
    markers = (
        Marker.patch("ear", pair(spots["ear"]), turn_deg=6.0, depth_mm=FACE_DEPTH_MM),
        Marker.patch("nose", pair(spots["nose"]), turn_deg=-24.0, depth_mm=FACE_DEPTH_MM),
    )
    return SceneBody("head", motion, tuple(shapes), markers)


def jaw_body(section: HeadSection, motion: RigidMotion) -> SceneBody:
    """Return the two markers on the skin over the jaw."""
    turns = {"jaw_front": 15.0, "jaw_back": -8.0}
    markers = tuple(
        Marker.patch(name, pair(section.landmarks[name]), turn_deg=turn, depth_mm=FACE_DEPTH_MM)
        for name, turn in turns.items()
    )
    return SceneBody("jaw", motion, markers=markers)


def trunk_body() -> SceneBody:
    """Return the shoulder, which rests."""
    shoulder = smooth(
        [(-190, -150), (-95, -128), (-40, -150), (10, -178), (60, -205), (110, -290), (-190, -290)]
    )
    resting = RigidMotion(np.zeros(1), np.zeros(1), np.zeros((1, 2)))
    return SceneBody("trunk", resting, (ScenePolygon(shoulder, SHIRT),))


def _silhouette(profile: Array) -> Array:
    """Close the profile (n, 2; forehead to neck) round the neck and the back of the skull."""
    (x0, y0), (x1, y1) = profile[0], profile[-1]
    behind = [
        (x1 - 4, y1 - 120),
        (-70, y1 - 120),
        (-66, -110),
        (-74, -60),
        (-92, 0),
        (-95, 60),
        (-60, 115),
        (0, 132),
        (x0 - 22, y0 + 50),
        (x0 - 5, y0 + 20),
    ]
    return np.vstack([profile, behind])


def _face_shades(section: HeadSection) -> list[ScenePolygon]:
    spots = {name: np.asarray(point) for name, point in section.landmarks.items()}
    chin, nose, base = spots["menton"], spots["nose"], spots["subnasale"]
    profile = np.asarray(section.profile)
    under_jaw: list[ArrayLike] = [
        (2, -28),
        (8, -62),
        (30, -86),
        shifted(chin, -22, -2),
        shifted(chin, -4, -3),
        shifted(chin, -30, -60),
        (-10, -200),
        (-80, -200),
        (-40, -60),
    ]
    ala = shifted(base, -15, 9)
    return [
        _shade(under_jaw, SHADE, 0.50, 5.0),
        ScenePolygon(stroke(profile, 7.0), SHADE, 0.35, 3.5, inside="face"),
        _shade(ellipse((58, -22), (26, 20), -20), GLOW, 0.40, 10.0),
        _shade(ellipse((52, -38), (22, 16), -20), BLUSH, 0.22, 9.0),
        _shade(ellipse((20, 40), (26, 30), 0), SHADE, 0.16, 10.0),
        _shade(ellipse(shifted(nose, -12, 26), (5, 17), 24), SHADE, 0.22, 4.0),
        _shade(ellipse((nose + ala) / 2 + (1, 2), (6, 4), 20), GLOW, 0.35, 3.0),
        _shade(stroke(arc(ala, 7.5, 60, 250), 1.6), SHADE, 0.50, 1.2),
        _shade(ellipse(shifted(base, -2, 5.5), (3.2, 1.3), 18), MOUTH, 0.75, 0.5),
        _shade(
            stroke(
                smooth_line([shifted(ala, -6, 3), shifted(ala, -13, -9), shifted(ala, -17, -22)]),
                2.0,
            ),
            SHADE,
            0.28,
            1.6,
        ),
    ]


def _eye(section: HeadSection) -> list[ScenePolygon]:
    x, y = shifted(_nasion(section), -15, -8)
    upper = smooth_line([(x - 17, y - 2), (x - 8, y + 4.5), (x - 1, y + 2.5), (x + 0.5, y - 1)])
    lower = smooth_line([(x + 0.5, y - 1), (x - 2, y - 4), (x - 9, y - 4.5), (x - 17, y - 2)])
    white = np.vstack([upper, lower[1:-1]])
    brow = smooth_line([(x - 26, y + 15), (x - 12, y + 20), (x + 4, y + 15)])
    iris = shapely.Polygon(ellipse((x - 3.2, y - 0.3), (3.2, 5.0), 0))
    seen = np.asarray(iris.intersection(shapely.Polygon(white)).exterior.coords)[:-1]
    pupil = ellipse((x - 2.3, y - 0.3), (1.2, 2.2), 0)
    return [
        _shade(ellipse((x - 8, y + 3), (17, 11), 8), SHADE, 0.30, 4.0),
        ScenePolygon(white, EYE_WHITE, 0.95),
        ScenePolygon(seen, IRIS),
        ScenePolygon(pupil, (0.05, 0.04, 0.04)),
        _shade(stroke(upper, 1.7), HAIR, 0.85, 0.3),
        _shade(stroke(lower, 0.7), SHADE, 0.6, 0.3),
        _shade(stroke(shifted(upper, -1, 3.6), 0.8), SHADE, 0.5, 0.5),
        _shade(stroke(shifted(upper[-14:-2], 1.4, 0.6), 1.0), HAIR, 0.6, 0.4),
        _shade(stroke(brow, 4.2), HAIR, 0.75, 1.1),
    ]


def _mouth(section: HeadSection) -> list[ScenePolygon]:
    spots = {name: np.asarray(point) for name, point in section.landmarks.items()}
    profile = np.asarray(section.profile)
    upper, lower = spots["stomion_upper"], spots["stomion_lower"]
    corner = (upper + lower) / 2 + np.array([-14.0, -2.0])
    top = spots["upper_lip"][1] + 4.5
    bottom = spots["lower_lip"][1] - 4.5
    near = profile[:, 0] > corner[0]
    red_above = profile[near & (profile[:, 1] <= top) & (profile[:, 1] >= upper[1])]
    red_below = profile[near & (profile[:, 1] <= lower[1]) & (profile[:, 1] >= bottom)]
    opening = np.vstack([shifted(upper, 2, 0), shifted(lower, 2, 0), corner])
    teeth = [
        ScenePolygon(tooth.sampled(0.3), TOOTH, 0.9, 0.3, inside="mouth")
        for tooth in (section.upper_tooth, section.lower_tooth)
    ]
    return [
        ScenePolygon(opening, MOUTH, 0.95, name="mouth", inside="face"),
        *teeth,
        ScenePolygon(np.vstack([red_above, upper, corner]), LIP, 0.85, 0.4, inside="face"),
        ScenePolygon(np.vstack([lower, red_below, corner]), LIP, 0.85, 0.4, inside="face"),
        _shade(ellipse(shifted(corner, -1, -1), (4, 3), 0), SHADE, 0.4, 2.0),
    ]


def _ear() -> list[ScenePolygon]:
    depth = FACE_DEPTH_MM
    rim = smooth(
        [
            (-1, 10),
            (-5, 22),
            (-15, 31),
            (-27, 27),
            (-33, 12),
            (-29, -6),
            (-19, -20),
            (-12, -31),
            (-5, -29),
            (-2, -17),
        ]
    )
    helix = smooth_line([(-6, 9), (-8, 20), (-16, 26), (-25, 22), (-29, 10), (-26, -5)])
    fold = smooth_line([(-11, 18), (-18, 17), (-22, 8), (-20, -5), (-13, -14)])
    bowl = smooth([(-4, 8), (-12, 11), (-17, 3), (-14, -9), (-6, -12), (-3, -4)])
    return [
        ScenePolygon(shifted(rim, -2.5, -2.0), MOUTH, 0.35, 2.5, depth),
        ScenePolygon(rim, EAR, 1.0, 0.3, depth, name="ear"),
        ScenePolygon(stroke(rim, 4), SHADE, 0.30, 1.5, depth, inside="ear"),
        ScenePolygon(stroke(helix, 3.2), SHADE, 0.55, 1.1, depth, inside="ear"),
        ScenePolygon(stroke(shifted(helix, -2.6, 0.8), 2.2), GLOW, 0.45, 0.8, depth, inside="ear"),
        ScenePolygon(stroke(fold, 2.6), GLOW, 0.35, 1.0, depth, inside="ear"),
        ScenePolygon(bowl, MOUTH, 0.50, 2.0, depth, inside="ear"),
        ScenePolygon(ellipse((-9, -24), (4, 5), 20), BLUSH, 0.35, 2.0, depth, inside="ear"),
    ]


def _hair(section: HeadSection) -> list[ScenePolygon]:
    x0, y0 = np.asarray(section.profile)[0]
    cap = np.vstack(
        [
            smooth_line(
                [(x0 - 14, y0 + 60), (x0 - 20, y0 + 30), (44, 60), (30, 48), (18, 30), (10, 8)]
            ),
            smooth_line([(5, 6), (2, 20), (-10, 36), (-26, 40), (-40, 26), (-42, 0), (-44, -30)]),
            smooth_line(
                [(-56, -62), (-78, -60), (-98, -10), (-104, 60), (-66, 125), (0, 145), (60, 130)]
            ),
        ]
    )
    generator = np.random.default_rng(17)
    strands = []
    for _ in range(90):
        x, y = generator.uniform((-98, -45), (40, 120))
        turn = np.arctan2(y - 20, x + 20) - np.pi / 2 + generator.normal(0, 0.15)
        along = np.linspace(-1, 1, 5)[:, None] * generator.uniform(8, 16)
        direction = np.array([[np.cos(turn), np.sin(turn)]])
        bend = np.array([[-np.sin(turn), np.cos(turn)]]) * generator.normal(0, 0.01)
        line = np.array([x, y]) + along * direction + along**2 * bend
        strands.append(
            ScenePolygon(stroke(line, 0.8), STRAND, 0.55, 0.3, FACE_DEPTH_MM / 2, inside="hair")
        )
    return [ScenePolygon(cap, HAIR, 0.97, 0.8, FACE_DEPTH_MM / 2, name="hair"), *strands]


def _nasion(section: HeadSection) -> Array:
    """Return the deepest point of the profile between forehead and nose."""
    profile = np.asarray(section.profile)
    tip = int(np.argmax(profile[:, 0]))
    above = profile[:tip]
    bridge = above[above[:, 1] < profile[tip, 1] + 60]
    return np.asarray(bridge[int(np.argmin(bridge[:, 0]))])


def _shade(
    corners: ArrayLike | Sequence[ArrayLike], colour: Colour, opacity: float, softness_mm: float
) -> ScenePolygon:
    return ScenePolygon(np.array(corners, float), colour, opacity, softness_mm, inside="face")
