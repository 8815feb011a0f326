"""Marks of one body at different depths, and what a turn out of the plane does to them.

A mark at depth Z appears at u = f X/Z from the camera's axis. Two marks of a body whose depths have
the ratio e^δ, first nearer, keep their distance in space, not in the picture: what stays as the
body moves and turns in the plane is

    d(δ) = |e^(δ/2) u₂ − e^(−δ/2) u₁|.

The ear is nearer to the camera than the nose. As the head nods, the plain distance changes with the
direction of the line against u₁ + u₂, which tells δ. It is taken if it leaves nothing but noise.
An error of δ displaces the first mark by −X₁/2, and turns the line by v × (X₁ + X₂)/2|v|².

A turn by φ out of the plane shortens the distance by cos φ, and puts one mark D sin φ nearer than
the other. The distance does not tell which: it is an error of δ, of D sin φ/Z, beside one of the
angle of φ²/4 (a line on a body that is turned about the wrong axis).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion.projection import PictureFormat
from mocap.motion.scale import BodyScale, inflation
from mocap.motion.turning import LEAST_TILT, Cause, MarkedPair, flattening
from mocap.tracking.markers import Depths, MarkerFile
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

USUAL_FOCAL = 1.3
"""Focal length over the picture's longer side where it is not known: a phone's."""

UNKNOWN_DEPTH_MM = 40.0
"""Standard error of how much nearer a mark of the head is than another one, or than the package,
if nothing tells it: the ear is up to 80 mm nearer than the middle of the face."""

MOST_TILTED = 0.5
"""The same as a share of the marks' distance, for marks that are close together."""

CAMERA_ERROR = 0.05
"""Relative standard error of a stated distance of the camera."""

CLEAR_RATIO = 5.0
"""A ratio of depths is taken from the film if it is so many standard errors."""

WELL_TOLD = 0.002
"""Standard error of the ratio's logarithm below which a film is said to tell it."""

LEFT_OVER_NOISE = 1.6
"""What a ratio of depths leaves of a distance may exceed its noise by this factor."""

MOST_BEHIND = 0.03
"""A head that seems to be farther away than the package by more than this share of the distance has
a wrong scale."""

LEAST_FRAMES = 20


@dataclass(frozen=True)
class DepthRatio:
    """Logarithm δ of the depth of a body's second mark over that of its first.

    Attributes
    ----------
    log_ratio, sigma
        δ, and its standard error.
    source
        "stated", "film", or "assumed" (zero).
    """

    log_ratio: float = 0.0
    sigma: float = 0.0
    source: str = "assumed"


@dataclass(frozen=True)
class Perspective:
    """What is known of the depths of the bodies that carry no stickers.

    Attributes
    ----------
    ratios
        Depths of the reference body's first two marks, by body. Those of a neck are too close
        together to matter.
    larger
        How many times larger than the package the head appears by its stated depths; one if they
        are not stated, or the head has a scale of its own.
    larger_sigma_mm
        Standard error of the depth of a body that has no scale of its own, mm.
    focal_px
        Focal length, given or that of a usual camera.
    behind
        Share of the camera's distance by which the head is farther away than the package by its
        own scale, zero where that is possible. In a side view ear and nose are nearer.
    """

    ratios: Mapping[str, DepthRatio]
    larger: float = 1.0
    larger_sigma_mm: float = 0.0
    focal_px: float = np.inf
    behind: float = 0.0

    @classmethod
    def of(
        cls,
        tracks: Tracks,
        markers: MarkerFile,
        flat: Array,
        centre: Array,
        picture: PictureFormat,
    ) -> Perspective:
        """Return what marker file and film tell of the bodies' depths.

        Parameters
        ----------
        tracks, markers, picture
            Tracks, marker file, and format of the picture.
        flat, centre
            (n, m, 2) positions of the marks and (2,) of the camera's axis, corrected, px.
        """
        if markers.plane is not None:
            return cls({})
        ratios = {}
        body = markers.reference
        pair = markers.bodies[body][:2]
        if len(pair) == 2 and not markers.has_sticker(body):
            zoom = _zoom(tracks, markers, flat)
            ratios[body] = _ratio(tracks, markers.depth, flat - centre, pair, zoom)
        lens = markers.lens
        focal = lens.fy or lens.fx or USUAL_FOCAL * max(picture.width, picture.height)
        return cls(ratios, *_larger(markers), focal)

    def checked(self, markers: MarkerFile, scales: Mapping[str, BodyScale]) -> Perspective:
        """Return the same with what the scales of the bodies say about their depths."""
        head, package = scales[markers.reference], scales[markers.moving]
        own = head.source == markers.reference and package.source == markers.moving
        if not own or markers.plane is not None or markers.has_sticker(markers.reference):
            return self
        behind = 1 - float(np.mean(head.px_per_mm / package.px_per_mm))
        return replace(self, behind=behind if behind > MOST_BEHIND else 0.0)

    def level(self, flat: Array, tracks: Tracks, markers: MarkerFile, centre: Array) -> Array:
        """Return corrected positions (n, m, 2), px, with the marks of a body at one depth.

        That is the geometric mean of its first two marks' depths.
        """
        moved = flat
        for body, ratio in self.ratios.items():
            pair = markers.bodies[body][:2]
            if ratio.source == "assumed":
                continue
            half = float(np.exp(0.5 * ratio.log_ratio))
            farther = {pair[0]: 1 / half, pair[1]: half}
            if ratio.source == "stated" and markers.depth is not None:
                farther = markers.depth.farther(pair)
            moved = flat.copy()
            for name in farther:
                k = tracks.names.index(name)
                moved[:, k] = centre + (flat[:, k] - centre) * farther[name]
        return moved

    def shared_covariance(
        self, body: str, pair_mm: Array, scale: BodyScale, rows: slice, *, is_moving: bool
    ) -> Array:
        """Return the covariance (n, 3, 3) of a pose, mm and rad, due to what is not known of depth.

        Parameters
        ----------
        body
            The body.
        pair_mm
            (n, 2, 2) places of its first two marks from the camera's axis, mm.
        scale
            Its scale over the whole clip.
        rows
            The n frames.
        is_moving
            Whether it is the moving body and not the reference.
        """
        first, second = pair_mm[:, 0], pair_mm[:, 1]
        line = second - first
        length = np.hypot(*line.T)
        mean = 0.5 * (first + second)
        across = line[:, 0] * mean[:, 1] - line[:, 1] * mean[:, 0]
        turned = np.divide(across, length**2, out=np.zeros_like(across), where=length > 0)
        away = self.focal_px / scale.px_per_mm[rows]
        tilt = np.zeros(len(first))
        if scale.tilt_rad.size:
            along = np.abs(np.sum(line * mean, axis=1)) / np.maximum(length, 1e-9)
            tilt = most_tilted(scale.tilt_rad[rows], along / away)
        covariance = np.zeros((len(first), 3, 3))
        ratio = self.ratios.get(body, DepthRatio())
        unknown = np.minimum(UNKNOWN_DEPTH_MM, MOST_TILTED * length) / away
        sigma = np.minimum(ratio.sigma, unknown)
        if ratio.source == "assumed" and ratio.sigma < WELL_TOLD:
            sigma = np.zeros_like(sigma)
        turn = turned * sigma
        covariance += _outer(-0.5 * first * sigma[:, None], turn - turn[0])
        # The body may turn about any axis: its first mark and its angle err independently.
        sigma = length * np.sin(tilt) / away
        turn = turned * sigma
        covariance += _outer(-0.5 * first * sigma[:, None], np.zeros(len(first)))
        covariance += _outer(np.zeros_like(first), turn - turn[0])
        wrong_scale = np.zeros_like(away)
        if scale.source != body:
            wrong_scale = self.larger_sigma_mm / away
        elif not is_moving:
            wrong_scale = np.full_like(away, self.behind)
        if scale.tilt_may_be_depth:
            wrong_scale = np.hypot(wrong_scale, 1 - np.cos(tilt))
        covariance += _outer(first * wrong_scale[:, None], np.zeros(len(first)))
        covariance[1:, 2, 2] += 0.0625 * (tilt[1:] ** 2 + tilt[0] ** 2) ** 2
        return covariance


def _outer(place: Array, angle: Array) -> Array:
    """Return the covariance (n, 3, 3) of an error of place (n, 2) and angle (n,) in one."""
    error = np.column_stack([place, angle])
    return np.asarray(error[:, :, None] * error[:, None, :])


def most_tilted(apparent_rad: Array, along: Array) -> Array:
    """Return the largest turn (n,), rad, that is behind an apparent one (n,).

    A turn away from the camera's axis also shortens the line by the share ``along`` sin φ, and one
    towards it lengthens it; ``along`` (n,) is the marks' mean place along their line over their
    distance from the camera.
    """
    shorter = 1 - np.cos(apparent_rad)
    return np.asarray(apparent_rad + along * shorter / (shorter + LEAST_TILT))


def _zoom(tracks: Tracks, markers: MarkerFile, flat: Array) -> Array:
    """Return how much larger (n,) than usual the moving body appears, if its dots do not turn."""
    body = markers.moving
    if body in markers.scale_mm and not markers.has_sticker(body):
        pair = MarkedPair.of(tracks, flat, markers, body)
        if pair.cause is Cause.DEPTH and pair.changes():
            return 1 + pair.change
    return np.ones(tracks.frame.size)


def _ratio(
    tracks: Tracks, depth: Depths | None, from_axis: Array, pair: tuple[str, ...], zoom: Array
) -> DepthRatio:
    """Return δ of two marks as it is stated, or as the film tells it.

    The body may appear to grow as the other one does, by ``zoom`` (n,), or not at all.
    """
    if depth is not None and depth.known(pair):
        return stated_ratio(depth, pair)
    columns = [tracks.names.index(name) for name in pair]
    use = tracks.known(pair[0]) & tracks.known(pair[1])
    noise = np.hypot(*tracks.sigma_px[:, columns].T)
    alike = from_axis[:, columns] / zoom[:, None, None]
    told = min(
        (filmed_ratio(tracks.time_s, at, noise, use) for at in (from_axis[:, columns], alike)),
        key=lambda ratio: ratio.sigma,
    )
    if told.source == "film" and tracks.ellipse is not None:
        dots = flattening(
            tracks.time_s[use], tracks.position_px[use][:, columns], tracks.ellipse[use][:, columns]
        )
        if dots.cause is Cause.TURNING:
            return DepthRatio(0.0, np.inf)
    return told


def stated_ratio(depth: Depths, pair: tuple[str, ...]) -> DepthRatio:
    """Return δ of two marks whose depths the marker file states."""
    first, second = (depth.camera_mm - depth.nearer_mm[name] for name in pair)
    sigma = np.hypot(np.sqrt(2) * depth.sigma_mm, (first - second) * CAMERA_ERROR)
    return DepthRatio(float(np.log(second / first)), float(sigma / depth.camera_mm), "stated")


def filmed_ratio(
    time_s: Array, pair_px: Array, noise_px: Array, use: NDArray[np.bool_]
) -> DepthRatio:
    """Return δ of two marks of a rigid body as the film tells it.

    Parameters
    ----------
    time_s, pair_px
        (n,) times, s, and (n, 2, 2) positions from the camera's axis, px.
    noise_px
        (n,) standard error of their distance, px.
    use
        (n,) frames in which both are seen.
    """
    if np.count_nonzero(use) < LEAST_FRAMES:
        return DepthRatio(0.0, np.inf)
    first, second = pair_px[use, 0], pair_px[use, 1]
    plain = np.hypot(*(second - first).T)
    ratio = 0.0
    for _ in range(8):
        far, near = np.exp(ratio / 2) * second, np.exp(-ratio / 2) * first
        distance = np.hypot(*(far - near).T)
        slope = 0.5 * np.sum((far - near) * (far + near), axis=1) / distance
        slope, left = slope - slope.mean(), distance - distance.mean()
        told = max(float(slope @ slope), 1e-12)
        ratio = float(np.clip(ratio - (slope @ left) / told, -0.5, 0.5))
    misfit = float(np.sqrt(np.mean(left**2)))
    sigma = inflation(left) * misfit / float(np.sqrt(told))
    curve = np.polynomial.Chebyshev.fit(time_s[use], plain, 3)
    of_time = float(np.sqrt(np.mean((plain - curve(time_s[use])) ** 2)))
    noise = float(np.median(noise_px[use]))
    if abs(ratio) > CLEAR_RATIO * sigma and misfit < min(LEFT_OVER_NOISE * noise, of_time):
        return DepthRatio(ratio, sigma, "film")
    return DepthRatio(0.0, sigma)


def _larger(markers: MarkerFile) -> tuple[float, float]:
    """Return how many times larger the head appears, and its depth's standard error, mm."""
    if markers.reference in markers.scale_mm or markers.has_sticker(markers.reference):
        return 1.0, UNKNOWN_DEPTH_MM
    pair = markers.bodies[markers.reference][:2]
    depth = markers.depth
    if depth is None or not depth.known(pair) or markers.moving not in markers.scale_mm:
        return 1.0, UNKNOWN_DEPTH_MM
    shares = [1 - depth.nearer_mm[name] / depth.camera_mm for name in pair]
    sigma = np.hypot(depth.sigma_mm, CAMERA_ERROR * np.mean([depth.nearer_mm[n] for n in pair]))
    return float(np.exp(-np.mean(np.log(shares)))), float(sigma)
