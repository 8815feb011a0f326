"""Tracks of bodies in space as a camera sees them, made up without drawing a picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import sqrtm
from scipy.spatial.transform import Rotation

from geometry2d.rigid import rotated
from mocap.motion.projection import PictureFormat
from mocap.tracking.tracks import Tracks

Array = NDArray[np.float64]

DOT_MM = 2.5


@dataclass(frozen=True)
class SolidSip:
    """Head and package in front of a camera; mm, degrees, px.

    ``nearer`` are depths of marks before the package's; ``yaw`` turns both bodies about upright
    axes for a while, the head's through the ear; ``zoom`` enlarges the picture for a while.
    """

    distance: float = 1500.0
    focal: float = 3200.0
    fps: float = 30.0
    seconds: float = 3.2
    noise: float = 0.03
    ear_nearer: float = 0.0
    nose_nearer: float = 0.0
    nod: float = 18.0
    sway: float = 1.0
    head_yaw: float = 0.0
    package_yaw: float = 0.0
    zoom: float = 0.0
    seed: int = 0

    picture = PictureFormat(1280, 720)
    nose = (104.0, -8.0)
    apart = 20.0

    @property
    def time(self) -> Array:
        return np.arange(round(self.fps * self.seconds)) / self.fps

    def while_drinking(self) -> Array:
        """A rise from 0 to 1 and back."""
        return np.asarray(_smooth(self.time, 1.0, 2.0) - _smooth(self.time, 2.6, 3.1))

    def poses(self) -> dict[str, tuple[Array, Array]]:
        """In-plane angle (n,) rad and place (n, 2) mm of both bodies' first marks."""
        t, there = self.time, self.while_drinking()
        head = np.radians(self.nod * there + 0.4 * self.sway * np.sin(5.1 * t))
        place = [-105, 38] + self.sway * np.column_stack([2 * np.sin(0.9 * t), 1.5 * np.sin(2 * t)])
        package = np.column_stack([85 - 64 * there, -88 + 86 * there])
        return {"head": (head, place), "package": (np.radians(58 * there), package)}

    def truth(self) -> tuple[Array, Array]:
        """Relative position (n, 2) mm and angle (n,) rad since the first frame."""
        head, package = self.poses().values()
        turned = head[0] - head[0][0]
        angle = package[0] - package[0][0] - turned
        return rotated(package[1] - head[1], -turned), angle

    def tracks(self) -> Tracks:
        marks = {
            "ear": ("head", (0.0, 0.0), self.ear_nearer),
            "nose": ("head", self.nose, self.nose_nearer),
            "package_lower": ("package", (0.0, 0.0), 0.0),
            "package_upper": ("package", (0.0, self.apart), 0.0),
        }
        seen = [self._seen(*mark) for mark in marks.values()]
        rng = np.random.default_rng(self.seed)
        pixels = np.stack([place for place, _ in seen], axis=1)
        pixels = pixels + self.noise * rng.standard_normal(pixels.shape)
        shape = pixels.shape[:2]
        ellipse = np.stack([edge for _, edge in seen], axis=1)
        return Tracks(
            frame=np.arange(shape[0]),
            time_s=self.time,
            names=tuple(marks),
            position_px=pixels,
            sigma_px=np.full(shape, self.noise),
            status=np.full(shape, "seen", dtype="<U9"),
            ellipse=ellipse * (1 + 0.002 * rng.standard_normal(ellipse.shape)),
        )

    def _seen(self, body: str, at: tuple[float, float], nearer: float) -> tuple[Array, Array]:
        """Pixels (n, 2) of a mark and the matrix entries (n, 3) of its dot's edge."""
        angle, place = self.poses()[body]
        yaw = np.radians(self.head_yaw if body == "head" else self.package_yaw)
        turn = Rotation.from_rotvec(np.outer(yaw * self.while_drinking(), [0, 1, 0]))
        turn = turn * Rotation.from_rotvec(np.outer(angle, [0, 0, 1]))
        first = np.column_stack([place, np.full(len(place), self.distance)])
        focal = self.focal * (1 + self.zoom * self.while_drinking())[:, None]
        middle = np.array([0.5 * (self.picture.width - 1), 0.5 * (self.picture.height - 1)])

        def pixels(x: float, y: float) -> Array:
            point = first + turn.apply([x, y, -nearer])
            return np.asarray(middle + focal * point[:, :2] / point[:, 2:] * [1, -1])

        centre = pixels(*at)
        sides = [pixels(at[0] + DOT_MM, at[1]) - centre, pixels(at[0], at[1] + DOT_MM) - centre]
        edges = np.stack(sides, axis=2)
        matrix = np.array([np.linalg.inv(np.real(sqrtm(edge @ edge.T))) for edge in edges])
        return centre, np.stack([matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1]], axis=1)


def _smooth(time: Array, start: float, end: float) -> Array:
    s = np.clip((time - start) / (end - start), 0, 1)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))
