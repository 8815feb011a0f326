"""What is drawn for a scenario: a head in profile, a package, the hand that holds it.

The outlines of face and neck are the ones the simulation uses; they lie in the world plane z = 0,
so that in the picture the neck meets the lips where it meets them in the simulation. What is on the
side of the head (ear, cheek, eye) and the head's markers lie `FACE_DEPTH_MM` nearer the camera, in
one plane: a simplification, for a nose marker of a real person lies deeper than an ear marker.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from geometry2d.head import HeadSection
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion
from mocap.synthetic import BLACK, Body, Colour, Marker, Shape

Array = NDArray[np.float64]

# Half the distance between the tragi, 131.4 mm (Prog Orthod 2013), less the ear's own thickness.
FACE_DEPTH_MM = 60.0
HAND_DEPTH_MM = 35.0
MARK_RADIUS_MM = 1.6

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
NAIL: Colour = (0.90, 0.72, 0.66)
TOOTH: Colour = (0.88, 0.85, 0.78)
IRIS: Colour = (0.30, 0.24, 0.18)
SHIRT: Colour = (0.25, 0.33, 0.42)
PLASTIC: Colour = (0.93, 0.93, 0.92)
PLASTIC_SHADE: Colour = (0.62, 0.64, 0.67)
CARTONS: Mapping[str, tuple[Colour, Colour]] = {
    "blue": ((0.20, 0.42, 0.66), (0.90, 0.92, 0.93)),
    "green": ((0.30, 0.53, 0.33), (0.93, 0.91, 0.82)),
}


def head_body(section: HeadSection, motion: RigidMotion) -> Body:
    """Return the head in profile with the ear and the nose marker."""
    spots = section.landmarks
    face = _silhouette(np.asarray(section.profile))
    shapes = [
        Shape(face, SKIN, name="face"),
        *_face_shades(section),
        *_eye(section),
        *_mouth(section),
        *_ear(),
        *_hair(section),
    ]
    markers = (
        Marker.patch("ear", _pair(spots["ear"]), turn_deg=6.0, depth_mm=FACE_DEPTH_MM),
        Marker.patch("nose", _pair(spots["nose"]), turn_deg=-24.0, depth_mm=FACE_DEPTH_MM),
    )
    return Body("head", motion, tuple(shapes), markers)


def jaw_body(section: HeadSection, motion: RigidMotion) -> Body:
    """Return the two markers on the skin over the jaw."""
    turns = {"jaw_front": 15.0, "jaw_back": -8.0}
    markers = tuple(
        Marker.patch(name, _pair(section.landmarks[name]), turn_deg=turn, depth_mm=FACE_DEPTH_MM)
        for name, turn in turns.items()
    )
    return Body("jaw", motion, markers=markers)


def trunk_body() -> Body:
    """Return the shoulder, which rests."""
    shoulder = _smooth(
        [(-190, -150), (-95, -128), (-40, -150), (10, -178), (60, -205), (110, -290), (-190, -290)]
    )
    resting = RigidMotion(np.zeros(1), np.zeros(1), np.zeros((1, 2)))
    return Body("trunk", resting, (Shape(shoulder, SHIRT),))


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


def _face_shades(section: HeadSection) -> list[Shape]:
    spots = {name: np.asarray(point) for name, point in section.landmarks.items()}
    chin, nose, base = spots["menton"], spots["nose"], spots["subnasale"]
    profile = np.asarray(section.profile)
    under_jaw: list[ArrayLike] = [
        (2, -28),
        (8, -62),
        (30, -86),
        _shifted(chin, -22, -2),
        _shifted(chin, -4, -3),
        _shifted(chin, -30, -60),
        (-10, -200),
        (-80, -200),
        (-40, -60),
    ]
    ala = _shifted(base, -15, 9)
    return [
        _shade(under_jaw, SHADE, 0.50, 5.0),
        Shape(_stroke(profile, 7.0), SHADE, 0.35, 3.5, inside="face"),
        _shade(_ellipse((58, -22), (26, 20), -20), GLOW, 0.40, 10.0),
        _shade(_ellipse((52, -38), (22, 16), -20), BLUSH, 0.22, 9.0),
        _shade(_ellipse((20, 40), (26, 30), 0), SHADE, 0.16, 10.0),
        _shade(_ellipse(_shifted(nose, -12, 26), (5, 17), 24), SHADE, 0.22, 4.0),
        _shade(_ellipse((nose + ala) / 2 + (1, 2), (6, 4), 20), GLOW, 0.35, 3.0),
        _shade(_stroke(_arc(ala, 7.5, 60, 250), 1.6), SHADE, 0.50, 1.2),
        _shade(_ellipse(_shifted(base, -2, 5.5), (3.2, 1.3), 18), MOUTH, 0.75, 0.5),
        _shade(
            _stroke(
                _smooth_line(
                    [_shifted(ala, -6, 3), _shifted(ala, -13, -9), _shifted(ala, -17, -22)]
                ),
                2.0,
            ),
            SHADE,
            0.28,
            1.6,
        ),
    ]


def _eye(section: HeadSection) -> list[Shape]:
    x, y = _shifted(_nasion(section), -15, -8)
    upper = _smooth_line([(x - 17, y - 2), (x - 8, y + 4.5), (x - 1, y + 2.5), (x + 0.5, y - 1)])
    lower = _smooth_line([(x + 0.5, y - 1), (x - 2, y - 4), (x - 9, y - 4.5), (x - 17, y - 2)])
    white = np.vstack([upper, lower[1:-1]])
    brow = _smooth_line([(x - 26, y + 15), (x - 12, y + 20), (x + 4, y + 15)])
    iris = shapely.Polygon(_ellipse((x - 3.2, y - 0.3), (3.2, 5.0), 0))
    seen = np.asarray(iris.intersection(shapely.Polygon(white)).exterior.coords)[:-1]
    pupil = _ellipse((x - 2.3, y - 0.3), (1.2, 2.2), 0)
    return [
        _shade(_ellipse((x - 8, y + 3), (17, 11), 8), SHADE, 0.30, 4.0),
        Shape(white, EYE_WHITE, 0.95),
        Shape(seen, IRIS),
        Shape(pupil, (0.05, 0.04, 0.04)),
        _shade(_stroke(upper, 1.7), HAIR, 0.85, 0.3),
        _shade(_stroke(lower, 0.7), SHADE, 0.6, 0.3),
        _shade(_stroke(_shifted(upper, -1, 3.6), 0.8), SHADE, 0.5, 0.5),
        _shade(_stroke(_shifted(upper[-14:-2], 1.4, 0.6), 1.0), HAIR, 0.6, 0.4),
        _shade(_stroke(brow, 4.2), HAIR, 0.75, 1.1),
    ]


def _mouth(section: HeadSection) -> list[Shape]:
    spots = {name: np.asarray(point) for name, point in section.landmarks.items()}
    profile = np.asarray(section.profile)
    upper, lower = spots["stomion_upper"], spots["stomion_lower"]
    corner = (upper + lower) / 2 + (-19, -2)
    top = spots["upper_lip"][1] + 4.5
    bottom = spots["lower_lip"][1] - 4.5
    near = profile[:, 0] > corner[0]
    red_above = profile[near & (profile[:, 1] <= top) & (profile[:, 1] >= upper[1])]
    red_below = profile[near & (profile[:, 1] <= lower[1]) & (profile[:, 1] >= bottom)]
    gap = np.vstack([_shifted(upper, 2, 0), _shifted(lower, 2, 0), corner])
    teeth = [
        Shape(tooth.sampled(0.3), TOOTH, 0.9, 0.3, inside="mouth")
        for tooth in (section.upper_tooth, section.lower_tooth)
    ]
    return [
        Shape(gap, MOUTH, 0.95, name="mouth", inside="face"),
        *teeth,
        Shape(np.vstack([red_above, upper, corner]), LIP, 0.85, 0.4, inside="face"),
        Shape(np.vstack([lower, red_below, corner]), LIP, 0.85, 0.4, inside="face"),
        _shade(_ellipse(_shifted(corner, -1, -1), (4, 3), 0), SHADE, 0.4, 2.0),
    ]


def _ear() -> list[Shape]:
    depth = FACE_DEPTH_MM
    rim = _smooth(
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
    helix = _smooth_line([(-6, 9), (-8, 20), (-16, 26), (-25, 22), (-29, 10), (-26, -5)])
    fold = _smooth_line([(-11, 18), (-18, 17), (-22, 8), (-20, -5), (-13, -14)])
    bowl = _smooth([(-4, 8), (-12, 11), (-17, 3), (-14, -9), (-6, -12), (-3, -4)])
    return [
        Shape(_shifted(rim, -2.5, -2.0), MOUTH, 0.35, 2.5, depth),
        Shape(rim, EAR, 1.0, 0.3, depth, name="ear"),
        Shape(_stroke(rim, 4), SHADE, 0.30, 1.5, depth, inside="ear"),
        Shape(_stroke(helix, 3.2), SHADE, 0.55, 1.1, depth, inside="ear"),
        Shape(_stroke(_shifted(helix, -2.6, 0.8), 2.2), GLOW, 0.45, 0.8, depth, inside="ear"),
        Shape(_stroke(fold, 2.6), GLOW, 0.35, 1.0, depth, inside="ear"),
        Shape(bowl, MOUTH, 0.50, 2.0, depth, inside="ear"),
        Shape(_ellipse((-9, -24), (4, 5), 20), BLUSH, 0.35, 2.0, depth, inside="ear"),
    ]


def _hair(section: HeadSection) -> list[Shape]:
    x0, y0 = np.asarray(section.profile)[0]
    cap = np.vstack(
        [
            _smooth_line(
                [(x0 - 14, y0 + 60), (x0 - 20, y0 + 30), (44, 60), (30, 48), (18, 30), (10, 8)]
            ),
            _smooth_line([(5, 6), (2, 20), (-10, 36), (-26, 40), (-40, 26), (-42, 0), (-44, -30)]),
            _smooth_line(
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
            Shape(_stroke(line, 0.8), STRAND, 0.55, 0.3, FACE_DEPTH_MM / 2, inside="hair")
        )
    return [Shape(cap, HAIR, 0.97, 0.8, FACE_DEPTH_MM / 2, name="hair"), *strands]


def _nasion(section: HeadSection) -> Array:
    """Return the deepest point of the profile between forehead and nose."""
    profile = np.asarray(section.profile)
    tip = int(np.argmax(profile[:, 0]))
    above = profile[:tip]
    bridge = above[above[:, 1] < profile[tip, 1] + 60]
    return np.asarray(bridge[int(np.argmin(bridge[:, 0]))])


def _shade(
    corners: ArrayLike | Sequence[ArrayLike], colour: Colour, opacity: float, softness_mm: float
) -> Shape:
    return Shape(np.array(corners, float), colour, opacity, softness_mm, inside="face")


def _pair(point: ArrayLike) -> tuple[float, float]:
    x, y = np.asarray(point, float)
    return float(x), float(y)


def _ellipse(centre: ArrayLike, radii: tuple[float, float], turn_deg: float) -> Array:
    angle = 2 * np.pi * np.arange(48) / 48
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    own: Array = np.column_stack([radii[0] * np.cos(angle), radii[1] * np.sin(angle)])
    return np.asarray(own @ np.array([[c, s], [-s, c]]) + np.asarray(centre))


def _arc(centre: ArrayLike, radius: float, from_deg: float, to_deg: float) -> Array:
    angle = np.radians(np.linspace(from_deg, to_deg, 24))
    return np.column_stack([np.cos(angle), np.sin(angle)]) * radius + np.asarray(centre)


def _smooth(corners: Sequence[tuple[float, float]]) -> Array:
    """Return a smooth closed curve through some points."""
    points = np.array([*corners, corners[0]], float)
    return _spline(points, "periodic")[:-1]


def _smooth_line(points: Sequence[ArrayLike]) -> Array:
    """Return a smooth open curve through some points."""
    return _spline(np.array(points, float), "natural")


def _spline(points: Array, ends: str) -> Array:
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    curve = CubicSpline(length, points, bc_type=ends)
    return np.asarray(curve(np.linspace(0, length[-1], 12 * len(points))))


def _stroke(line: Array, width_mm: float) -> Array:
    """Return the outline of a line of some width with round ends."""
    outline = shapely.LineString(line).buffer(width_mm / 2, quad_segs=6)
    return np.asarray(outline.exterior.coords)[:-1]


def _capsule(start: ArrayLike, end: ArrayLike, width_mm: float) -> Array:
    return _stroke(np.array([start, end], float), width_mm)


def package_bodies(neck: NeckSection, carton: str, motion: RigidMotion) -> tuple[Body, Body]:
    """Return package and holding hand; both move with the neck.

    Parameters
    ----------
    neck
        The section whose outer contour is drawn; its marks become the package's markers.
    carton
        A name in `CARTONS`.
    motion
        Of the neck in the world.
    """
    sides, band = CARTONS[carton]
    outline = np.asarray(neck.silhouette, float)
    axis = (neck.upper_mark[1] + neck.lower_mark[1]) / 2
    rim, end = outline[:, 0].min(), outline[:, 0].max()
    half = outline[:, 1].max() - axis
    top = outline[outline[:, 1] > axis + half - 1e-6, 0].min()
    radius = float(neck.upper_wall.sampled(0.2)[:, 1].max() - axis)
    shapes = [
        Shape(outline, PLASTIC, name="package"),
        _within(_band(rim, top, axis - 0.93 * radius, 6.0), PLASTIC_SHADE, 0.80, 3.0),
        _within(_band(rim, top, axis + 1.02 * radius, 3.0), PLASTIC_SHADE, 0.60, 2.0),
        _within(_band(top - 12, top + 2, axis - half, 12.0), PLASTIC_SHADE, 0.60, 4.0),
        *(_within(_stroke(line, 0.9), PLASTIC_SHADE, 0.75, 0.3) for line in _thread_lines(neck)),
        _within(_band(rim - 1, rim + 1.0, axis, 60), PLASTIC_SHADE, 0.35, 0.3),
        Shape(_band(top, end + 1, axis, half + 1), sides, name="carton", inside="package"),
        *(
            Shape(corners, colour, opacity, softness, inside="carton")
            for corners, colour, opacity, softness in (
                (_band(top + 30, top + 56, axis, 60), band, 0.9, 0.0),
                (_ellipse((top + 43, axis + 2), (10, 10), 0), sides, 0.9, 0.0),
                (_band(top + 4, top + 5.2, axis, 60), band, 0.8, 0.0),
                (_band(rim, end + 9, axis - half, 11), BLACK, 0.40, 5.0),
                (_band(rim, end + 9, axis + 0.5 * half, 7), GLOW, 0.20, 4.0),
            )
        ),
    ]
    markers = (
        Marker.dot("package_lower", _pair(neck.lower_mark), radius_mm=MARK_RADIUS_MM),
        Marker.dot("package_upper", _pair(neck.upper_mark), radius_mm=MARK_RADIUS_MM),
    )
    hand = Body("hand", motion, tuple(_hand(axis)))
    return Body("package", motion, tuple(shapes), markers), hand


def _within(corners: Array, colour: Colour, opacity: float, softness_mm: float) -> Shape:
    return Shape(corners, colour, opacity, softness_mm, inside="package")


def _thread_lines(neck: NeckSection) -> list[Array]:
    """Return lines over the visible side of the neck from lower crests to upper crests."""
    upper = _crests(np.asarray(neck.upper_wall.sampled(0.1)), 1.0)
    lower = _crests(np.asarray(neck.lower_wall.sampled(0.1)), -1.0)
    return [np.array([a, b]) for a, b in zip(lower, upper, strict=False)]


def _crests(contour: Array, side: float) -> list[Array]:
    """Return the local outermost points of a closed contour (n, 2), from the rim inwards."""
    height = side * contour[:, 1]
    outer = height > (height.max() + height.min()) / 2
    peak = outer & (height > np.roll(height, 1)) & (height >= np.roll(height, -1))
    return sorted(contour[peak], key=lambda point: float(point[0]))


def _hand(axis: float) -> list[Shape]:
    """Return the back of a right hand round the carton, thumb towards the person."""
    depth = HAND_DEPTH_MM
    arm = _smooth(
        [
            (62, axis - 34),
            (98, axis - 14),
            (122, axis - 26),
            (176, axis - 150),
            (200, axis - 230),
            (118, axis - 230),
            (90, axis - 130),
        ]
    )
    back = _smooth(
        [
            (44, axis + 20),
            (41, axis - 4),
            (50, axis - 30),
            (80, axis - 48),
            (108, axis - 40),
            (117, axis - 6),
            (111, axis + 20),
            (78, axis + 24),
        ]
    )
    thumb = _smooth_line([(70, axis - 34), (54, axis - 35), (40, axis - 30), (29, axis - 27)])
    nail = _ellipse((27.5, axis - 25.5), (4.8, 3.2), -20)
    shapes = [
        *_rounded("arm", arm, 9.0),
        *_rounded("thumb", _stroke(thumb, 17), 4.0),
        Shape(nail, NAIL, 0.8, 0.4, depth, inside="thumb"),
        *_rounded("back", back, 8.0),
    ]
    for number, (x, length) in enumerate(((47.0, 33), (65.0, 35), (83.0, 34), (100.0, 31))):
        width = 17.0 - 0.8 * number
        knuckle = np.array((x + 2.0, axis + 2.0))
        finger = _smooth_line([knuckle, (x + 1, axis + 17), (x - 1.5, axis + length)])
        name = f"finger{number}"
        joint = np.array((x + 0.5, axis + 19.0))
        shapes += [
            Shape(_stroke(_shifted(finger, 2.0, -0.5), width), MOUTH, 0.45, 1.5, depth),
            *_rounded(name, _stroke(finger, width), 4.0),
            *(
                _crease(_shifted(joint, 0, offset), width, depth, name)
                for offset in (-2.2, 0.0, 2.2)
            ),
            Shape(
                _ellipse(_shifted(knuckle, 0, 3), (5, 5), 0), GLOW, 0.35, 2.5, depth, inside=name
            ),
            Shape(_ellipse(_shifted(knuckle, 0, -5), (9, 5), 0), SKIN, 0.85, 2.5, depth),
        ]
    return shapes


def _crease(middle: Array, width: float, depth: float, name: str) -> Shape:
    line = np.array([middle - (width / 4, 0), _shifted(middle, width / 4, 0.4)])
    return Shape(_stroke(line, 0.7), SHADE, 0.45, 0.4, depth, inside=name)


def _rounded(name: str, outline: Array, border_mm: float) -> list[Shape]:
    """Return a skin-coloured shape of the hand, darker towards its border."""
    depth = HAND_DEPTH_MM
    return [
        Shape(outline, SKIN, depth_mm=depth, name=name),
        Shape(
            _stroke(np.vstack([outline, outline[:1]]), border_mm),
            SHADE,
            0.42,
            border_mm / 2.2,
            depth,
            inside=name,
        ),
    ]


def _shifted(points: ArrayLike, x: float, y: float) -> Array:
    return np.asarray(points, float) + np.array([x, y])


def _band(from_x: float, to_x: float, y: float, half_height: float) -> Array:
    """Return a rectangle between two x, centred at y."""
    low, high = y - half_height, y + half_height
    return np.array([(from_x, low), (to_x, low), (to_x, high), (from_x, high)])
