"""A package and the hand that holds it, as rendered in the recordings.

The outline is the neck section's own, in the world plane z = 0; the hand is nearer the camera.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from geometry2d.neck import NeckSection
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion
from mocap.synthetic.camera import Colour
from mocap.synthetic.scene import BLACK, Marker, SceneBody, ScenePolygon
from scenarios.recordings.portrait import GLOW, MOUTH, SHADE, SKIN
from scenarios.recordings.strokes import band, ellipse, pair, shifted, smooth, smooth_line, stroke

Array = NDArray[np.float64]

HAND_DEPTH_MM = 35.0
MARK_RADIUS_MM = 1.6
GRIP_MM = 29.0  # from where the carton begins to the hand

NAIL: Colour = (0.90, 0.72, 0.66)
PLASTIC: Colour = (0.93, 0.93, 0.92)
PLASTIC_SHADE: Colour = (0.62, 0.64, 0.67)
CARTONS: Mapping[str, tuple[Colour, Colour]] = {
    "blue": ((0.20, 0.42, 0.66), (0.90, 0.92, 0.93)),
    "green": ((0.30, 0.53, 0.33), (0.93, 0.91, 0.82)),
}


def package_bodies(neck: NeckSection, carton: str, motion: RigidMotion) -> tuple[SceneBody, ...]:
    """Return the package, which moves with the neck, and the arm and the hand that hold it.

    Parameters
    ----------
    neck
        The section whose outer contour is shown; its marks become the package's markers.
    carton
        A name in `CARTONS`.
    motion
        Of the neck in the world.
    """
    sides, stripe = CARTONS[carton]
    outline = np.asarray(neck.silhouette, float)
    axis = (neck.upper_mark[1] + neck.lower_mark[1]) / 2
    rim, end = outline[:, 0].min(), outline[:, 0].max()
    half = outline[:, 1].max() - axis
    top = outline[outline[:, 1] > axis + half - 1e-6, 0].min()
    radius = float(neck.upper_wall.sampled(0.2)[:, 1].max() - axis)
    shapes = [
        ScenePolygon(outline, PLASTIC, name="package"),
        _within(
            band(rim, top, axis - 0.95 * radius, 0.3 * radius), PLASTIC_SHADE, 0.80, 0.16 * radius
        ),
        _within(band(rim, top, axis + 1.02 * radius, 3.0), PLASTIC_SHADE, 0.60, 2.0),
        _within(band(top - 12, top + 2, axis - half, 12.0), PLASTIC_SHADE, 0.60, 4.0),
        *(_within(stroke(line, 0.9), PLASTIC_SHADE, 0.75, 0.3) for line in _thread_lines(neck)),
        _within(band(rim - 1, rim + 1.0, axis, 60), PLASTIC_SHADE, 0.35, 0.3),
        ScenePolygon(band(top, end + 1, axis, half + 1), sides, name="carton", inside="package"),
        *(
            ScenePolygon(corners, colour, opacity, softness, inside="carton")
            for corners, colour, opacity, softness in (
                (band(top + 30, top + 56, axis, 60), stripe, 0.9, 0.0),
                (ellipse((top + 43, axis + 2), (10, 10), 0), sides, 0.9, 0.0),
                (band(top + 4, top + 5.2, axis, 60), stripe, 0.8, 0.0),
                (band(rim, end + 9, axis - half, 11), BLACK, 0.40, 5.0),
                (band(rim, end + 9, axis + 0.5 * half, 7), GLOW, 0.20, 4.0),
            )
        ),
    ]
    markers = (
        Marker.dot("package_lower", pair(neck.lower_mark), radius_mm=MARK_RADIUS_MM),
        Marker.dot("package_upper", pair(neck.upper_mark), radius_mm=MARK_RADIUS_MM),
    )
    grip = (float(top + GRIP_MM), float(axis))
    return (
        SceneBody("package", motion, tuple(shapes), markers),
        _arm((grip[0] + 38.0, grip[1] - 36.0), motion),
        SceneBody("hand", motion, tuple(_hand(grip))),
    )


def _within(corners: Array, colour: Colour, opacity: float, softness_mm: float) -> ScenePolygon:
    return ScenePolygon(corners, colour, opacity, softness_mm, inside="package")


def _thread_lines(neck: NeckSection) -> list[Array]:
    """Return lines over the visible side of the neck from lower crests to upper crests."""
    upper = _crests(neck.upper_wall, neck.upper_stretches)
    lower = _crests(neck.lower_wall, neck.lower_stretches)
    return [np.stack(ends) for ends in zip(lower, upper, strict=True)]


def _crests(wall: Outline, stretches: Mapping[str, tuple[float, float]]) -> list[Array]:
    middles = {name: sum(ends) / 2 for name, ends in stretches.items() if "crest" in name}
    points, _ = wall.point_at(np.array([middles[name] for name in sorted(middles)]))
    return list(points)


def _arm(wrist: tuple[float, float], motion: RigidMotion) -> SceneBody:
    """Return the forearm: it follows the wrist, but turns less than the package."""
    outline = smooth(
        [
            (-25, 5),
            (0, 14),
            (25, 7),
            (31, -50),
            (36, -130),
            (30, -230),
            (-34, -230),
            (-36, -120),
            (-28, -40),
        ]
    )
    turn = np.radians(8.0) + 0.4 * (motion.angle_rad + np.radians(40.0))
    follows = RigidMotion.of_reference_point(
        motion.time_s, turn, motion.apply([wrist])[:, 0], (0.0, 0.0)
    )
    return SceneBody("arm", follows, tuple(_rounded("arm", outline, 11.0)))


def _hand(wrist: tuple[float, float]) -> list[ScenePolygon]:
    """Return the back of a right hand, thumb towards the person.

    ``wrist`` is where the index finger's side of the hand crosses the axis of the carton.
    """
    depth = HAND_DEPTH_MM

    def at(*points: tuple[float, float]) -> list[Array]:
        return list(shifted(points, *wrist))

    back = smooth(
        at((4, 20), (1, -4), (10, -30), (40, -48), (68, -40), (77, -6), (71, 20), (38, 24))
    )
    thumb = smooth_line(at((30, -34), (14, -35), (0, -30), (-11, -27)))
    nail = ellipse(shifted((-12.5, -25.5), *wrist), (4.8, 3.2), -20)
    shapes = [
        *_rounded("thumb", stroke(thumb, 17), 4.0),
        ScenePolygon(nail, NAIL, 0.8, 0.4, depth, inside="thumb"),
        *_rounded("back", back, 8.0),
    ]
    for number, (x, length) in enumerate(((7.0, 31.0), (25.0, 33.0), (43.0, 32.0), (60.0, 29.0))):
        width = 17.0 - 0.8 * number
        knuckle, joint, middle, tip = at((x + 2, 2), (x + 0.5, 19), (x + 1, 17), (x - 1.5, length))
        finger = smooth_line([knuckle, middle, tip])
        name = f"finger {number + 1}"
        shapes += [
            ScenePolygon(stroke(shifted(finger, 2.0, -0.5), width), MOUTH, 0.45, 1.5, depth),
            *_rounded(name, stroke(finger, width), 4.0),
            *(_crease(shifted(joint, 0, dy), width, depth, name) for dy in (-2.2, 0.0, 2.2)),
            ScenePolygon(
                ellipse(shifted(knuckle, 0, 3), (5, 5), 0), GLOW, 0.35, 2.5, depth, inside=name
            ),
            ScenePolygon(ellipse(shifted(knuckle, 0, -5), (9, 5), 0), SKIN, 0.85, 2.5, depth),
        ]
    return shapes


def _crease(middle: Array, width: float, depth: float, name: str) -> ScenePolygon:
    line = np.array([middle - (width / 4, 0), shifted(middle, width / 4, 0.4)])
    return ScenePolygon(stroke(line, 0.7), SHADE, 0.45, 0.4, depth, inside=name)


def _rounded(name: str, outline: Array, border_mm: float) -> list[ScenePolygon]:
    """Return a skin-coloured shape of the hand, darker towards its border."""
    depth = HAND_DEPTH_MM
    return [
        ScenePolygon(outline, SKIN, depth_mm=depth, name=name),
        ScenePolygon(
            stroke(np.vstack([outline, outline[:1]]), border_mm),
            SHADE,
            0.42,
            border_mm / 2.2,
            depth,
            inside=name,
        ),
    ]
