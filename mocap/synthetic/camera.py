"""Camera, lens and sensor of rendered videos: from a scene to grey levels.

World: mm, x right, y up, z towards the camera (`depth_mm`). Picture: px, x right, y down, integers
at pixel centres. Lens and camera matrix follow OpenCV's conventions, as in marker files.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.foundation.errors import DrinksimError
from mocap.video.lens import Distortion

Array = NDArray[np.float64]
LinearImage = NDArray[np.float32]
Image = NDArray[np.uint8]
Colour = tuple[float, float, float]


class SyntheticError(DrinksimError):
    """A scene or camera that cannot be rendered."""


@dataclass(frozen=True, kw_only=True)
class Lens(Distortion):
    """Distortion and sharpness of a lens.

    Parameters
    ----------
    blur_px
        Standard deviation of the point spread function, px.
    vignetting
        Fraction of the light that is lost in the corners of the picture.
    """

    blur_px: float = 0.0
    vignetting: float = 0.0


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with a lens, looking at the world plane.

    Parameters
    ----------
    width, height
        Size of the picture, px.
    focal_px
        Focal lengths fx, fy, px; different when pixels are not square.
    distance_mm
        From the camera to the point it aims at.
    aim_mm
        Point (x, y) of the plane z = 0 on the optical axis, mm.
    fps
        Frames per second.
    exposure_s
        Exposure time of a frame, s.
    principal_px
        Point where the optical axis meets the picture, px; None: the picture's centre.
    turn_deg
        Rotation of the camera about the point it aims at, degrees, as an axis-angle vector in the
        camera's own axes (x right, y down, z forward); zero looks along the normal of the plane.
    lens
        Its distortion and blur.
    """

    width: int
    height: int
    focal_px: tuple[float, float]
    distance_mm: float
    aim_mm: tuple[float, float]
    fps: float = 25.0
    exposure_s: float = 0.0
    principal_px: tuple[float, float] | None = None
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lens: Lens = field(default_factory=Lens)

    def __post_init__(self) -> None:
        positive = {
            "width": self.width,
            "height": self.height,
            "focal_px[0]": self.focal_px[0],
            "focal_px[1]": self.focal_px[1],
            "distance_mm": self.distance_mm,
            "fps": self.fps,
        }
        for name, value in positive.items():
            if not value > 0:
                raise SyntheticError(f"camera {name} is {value}: give a number above zero")
        if not 0 <= self.exposure_s <= 1 / self.fps:
            raise SyntheticError(
                f"camera exposure_s is {self.exposure_s}, but a frame lasts {1 / self.fps:.4g} s: "
                "give a time between zero and that"
            )

    @property
    def matrix(self) -> Array:
        """Camera matrix (3, 3) in OpenCV's form."""
        cx, cy = self.principal_px or ((self.width - 1) / 2, (self.height - 1) / 2)
        return np.array([[self.focal_px[0], 0, cx], [0, self.focal_px[1], cy], [0, 0, 1.0]])

    @property
    def rotation(self) -> Array:
        """Matrix (3, 3) from world axes (x right, y up, z to the camera) to camera axes."""
        return axis_angle_matrix(np.radians(self.turn_deg)) @ np.diag([1.0, -1.0, -1.0])

    def project(self, points_mm: ArrayLike, depth_mm: ArrayLike = 0.0) -> Array:
        """Return px (..., 2) of world points (..., 2) at depth z (towards the camera).

        Raises
        ------
        SyntheticError
            If a point lies behind the camera.
        """
        points = np.asarray(points_mm, float) - np.asarray(self.aim_mm)
        depth = np.broadcast_to(np.asarray(depth_mm, float), points.shape[:-1])
        seen = np.concatenate([points, depth[..., None]], axis=-1) @ self.rotation.T
        distance = seen[..., 2] + self.distance_mm
        if np.any(distance <= 0):
            raise SyntheticError(
                f"a point lies {-distance.min():.1f} mm behind the camera: lessen its depth_mm"
            )
        normalised = self.lens.distorted(seen[..., :2] / distance[..., None])
        matrix = self.matrix
        return normalised * np.diag(matrix)[:2] + matrix[:2, 2]

    def pixels_per_mm(self, depth_mm: float = 0.0) -> float:
        """Return the scale in the picture's centre at a depth, px per mm (horizontally)."""
        return self.focal_px[0] / (self.distance_mm - depth_mm)


@dataclass(frozen=True)
class Sensor:
    """Conversion of light to grey levels.

    Parameters
    ----------
    full_well_e
        Electrons in a pixel that is just white; the shot noise of N electrons is √N. Infinite: no
        shot noise.
    read_noise_e
        Standard deviation of the read noise, electrons.
    gamma
        Exponent of the display: grey level = 255 × light^(1/gamma).
    seed
        Seed of the noise; each frame has its own stream, so that frames do not depend on their
        order.
    """

    full_well_e: float = np.inf
    read_noise_e: float = 0.0
    gamma: float = 2.2
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.full_well_e > 0 and self.read_noise_e >= 0 and self.gamma > 0):
            raise SyntheticError(
                f"sensor full_well_e {self.full_well_e}, read_noise_e {self.read_noise_e}, gamma "
                f"{self.gamma}: full well and gamma must be above zero, read noise not below"
            )
        if np.isinf(self.full_well_e) and self.read_noise_e > 0:
            raise SyntheticError(
                f"sensor read_noise_e is {self.read_noise_e} electrons, but full_well_e is "
                "infinite: give the full well, which converts electrons to light"
            )

    def read_out(self, light: LinearImage, frame: int) -> Image:
        """Return grey levels 0...255 for linear light (rows, columns, 3), 1 being white."""
        if np.isfinite(self.full_well_e):
            generator = np.random.default_rng([self.seed, frame])
            variance = np.maximum(light, 0) / np.float32(self.full_well_e)
            variance += np.float32((self.read_noise_e / self.full_well_e) ** 2)
            noise = generator.standard_normal(light.shape, dtype=np.float32)
            light = light + noise * np.sqrt(variance)
        levels = 255 * np.clip(light, 0, 1) ** np.float32(1 / self.gamma)
        return np.asarray(np.rint(levels), np.uint8)

    def linear(self, colour: Colour) -> NDArray[np.float32]:
        """Return the linear light (3,) of a colour given by displayed values 0...1."""
        return np.asarray(colour, np.float32) ** np.float32(self.gamma)


def axis_angle_matrix(vector: Array) -> Array:
    """Return the rotation matrix (3, 3) of an axis-angle vector, rad (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
