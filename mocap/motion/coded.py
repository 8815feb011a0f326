"""Bodies that carry coded stickers: from corners to poses in the plane, depth and tilt.

Position and turn in the plane, depth and tilt out of it are measured together, and their errors are
correlated: a sticker that appears larger is nearer, and what it shows off the camera's axis is then
less far from it. Depth and tilt are noisy and slow, so that they are smoothed first; the position
and turn of each frame are then those expected given the smooth depth and tilt (conditional normal
distribution).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from mocap.motion.errors import MotionError
from mocap.motion.poses import Poses
from mocap.motion.projection import PictureFormat, axis_px, undistorted
from mocap.motion.rotations import rotation_of, swing_twist
from mocap.motion.scale import BodyScale
from mocap.motion.smooth import smoothed
from mocap.motion.spatial import (
    BodyFit,
    BodySystem,
    Observed,
    SpatialPoses,
    only_frames,
    spatial_poses,
    usable_frames,
)
from mocap.motion.turning import Flattening
from mocap.stickers.detect import CORNERS
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

# Poses are interpolated over dropouts up to this long, s, with a standard error this much larger.
LONGEST_BRIDGE_S = 1.0
BRIDGE_SIGMA = 100.0
# Error of a sticker's corners that all frames share, px: its print, its paper, its edges' tone.
COMMON_ERROR_PX = 0.04
# The corner on the other side of a sticker, for each of its corners.
OTHER_SIDE = (1, 0, 3, 2)
# Focal length of usual lenses over the longer side of the picture: median and spread of the log,
# the range of it that is tried, and the most frames for which it is. It is taken from the clip only
# if the ends of the range are worse by this much (chi-square): bodies must turn to tell it.
USUAL_FOCAL = 1.3
FOCAL_SPREAD = 0.5
TRIED_FOCALS = np.linspace(-1.2, 1.2, 9)
CLEARLY_BETTER = 20.0
MOST_FRAMES = 60
# Rounds of least squares and smoothing, and the swing up to which a mark tells nothing, rad.
SMOOTHING_ROUNDS = 6
LEAST_FRAMES = 8
# The shared error of a swing is at most this many errors of a single frame.
LEAST_TOLD = 10.0
WIDEST_SWING = 0.5
# Order of the coordinates whose covariance is formed: in the plane, then out of it.
IN_PLANE, OUT_OF_PLANE = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class OutOfPlanePose:
    """Depth and tilt of a body in each frame, smoothed.

    Attributes
    ----------
    depth_mm, depth_sigma_mm
        (n,) distance from the camera since the first frame, and its standard error.
    tilt_rad, tilt_sigma_rad
        (n, 2) rotation out of the plane since the first frame about the world's x (to the right)
        and y (up), an axis-angle vector, and its standard error.
    """

    depth_mm: Array
    depth_sigma_mm: Array
    tilt_rad: Array
    tilt_sigma_rad: Array


@dataclass(frozen=True)
class CodedBody:
    """Measured poses of a body with stickers.

    Attributes
    ----------
    spatial
        Its poses in space.
    scale
        Its scale in the picture.
    focal_known
        Whether the marker file gives the focal length.
    """

    spatial: SpatialPoses
    scale: BodyScale
    focal_known: bool


def coded_bodies(
    tracks: Tracks, markers: MarkerFile, picture: PictureFormat
) -> dict[str, CodedBody]:
    """Return the poses in space of all bodies that carry a coded sticker.

    Raises
    ------
    MotionError
        If the first marker of such a body, or all its stickers, are never seen.
    """
    marks = {
        body: _observed(body, tracks, markers, picture)
        for body in markers.bodies
        if markers.has_sticker(body)
    }
    if not marks:
        return {}
    given = markers.lens.fy
    longest = max(picture.width * picture.pixel_aspect, picture.height)
    focal = given
    if focal is None:
        focal = focal_length(list(marks.values()), tracks.time_s, USUAL_FOCAL * longest)
    printed = markers.printed
    bodies = {}
    for body, observed in marks.items():
        poses = spatial_poses(observed, focal)
        scale = focal / poses.place_mm[:, 2]
        bodies[body] = CodedBody(
            poses,
            BodyScale(
                px_per_mm=_bridged(scale),
                relative_sigma=printed.bar_sigma_mm / printed.bar_mm,
                source=body,
                change=float(np.ptp(scale[np.isfinite(scale)]) / np.nanmean(scale)),
                foreshortened=(),
                enlarged=(),
                flattening=Flattening(np.nan, np.nan),
            ),
            given is not None,
        )
    return bodies


def focal_length(bodies: list[list[Observed]], time_s: Array, usual_px: float) -> float:
    """Return the focal length of greatest likelihood over all bodies, px.

    Parameters
    ----------
    bodies
        The marks of each body.
    time_s
        (n,) times of the frames, s.
    usual_px
        Focal length of usual lenses, px.
    """
    step = -(-time_s.size // MOST_FRAMES)
    some = np.arange(time_s.size) % step == 0
    chosen = [only_frames(marks, some) for marks in bodies]
    chosen = [marks for marks in chosen if usable_frames(marks).sum() >= LEAST_FRAMES]

    def fits(log_share: float) -> list[SpatialPoses]:
        return [spatial_poses(marks, usual_px * float(np.exp(log_share))) for marks in chosen]

    tried = [fits(float(log_share)) for log_share in TRIED_FOCALS]
    best = [min(poses, key=lambda pose: pose.fit.cost) for poses in zip(*tried, strict=True)]
    noises = np.array([_noise(pose) for pose in best])

    def cost(log_share: float, poses: list[SpatialPoses]) -> float:
        fitted = np.array([pose.fit.cost for pose in poses])
        return float((log_share / FOCAL_SPREAD) ** 2 + np.sum(fitted / noises))

    costs = np.array([cost(*pair) for pair in zip(TRIED_FOCALS, tried, strict=True)])
    k = int(np.argmin(costs))
    # What does not make it much worse either way does not tell it: the usual one is kept.
    if min(costs[0], costs[-1]) - costs[k] < CLEARLY_BETTER:
        return usual_px
    near = TRIED_FOCALS[[max(k - 1, 0), min(k + 1, costs.size - 1)]]
    found = minimize_scalar(
        lambda log_share: cost(log_share, fits(log_share)),
        bounds=tuple(near),
        method="bounded",
        options={"xatol": 0.01},
    )
    return usual_px * float(np.exp(found.x))


def _noise(poses: SpatialPoses) -> float:
    """Return the variance of a body's residuals over the stated one, for independent frames."""
    system = BodySystem(only_frames(poses.marks, poses.known), poses.focal_px)
    return poses.misfit**2 * system.persistence(poses.fit)


def _observed(
    body: str, tracks: Tracks, markers: MarkerFile, picture: PictureFormat
) -> list[Observed]:
    """Return what the film shows of the marks of a body; marks that are never seen are left out."""
    centre = undistorted(axis_px(markers.lens, picture), markers.lens, picture)
    marks = []
    for name in markers.bodies[body]:
        k = tracks.names.index(name)
        if name in markers.coded:
            mark = _sticker(name, tracks, markers, picture, centre)
        else:
            flat = undistorted(tracks.position_px[:, k], markers.lens, picture) - centre
            known = tracks.known(name)
            spread = np.where(known, tracks.sigma_px[:, k], 1.0) ** 2
            mark = Observed(
                name,
                np.zeros((1, 3)),
                np.where(known[:, None], flat, np.nan),
                spread[:, None, None] * np.eye(2),
            )
        if mark.seen.any():
            marks.append(mark)
    first = markers.bodies[body][0]
    if not marks or marks[0].name != first:
        raise MotionError(f"{first}: is never seen; it is the origin of {body}")
    if usable_frames(marks).sum() < 2:
        raise MotionError(f"{body}: no sticker of it is seen in two frames")
    return marks


def _sticker(
    name: str, tracks: Tracks, markers: MarkerFile, picture: PictureFormat, centre: Array
) -> Observed:
    assert tracks.stickers is not None
    at = tracks.stickers.names.index(name)
    corners = tracks.stickers.corners_px[:, at].copy()
    corners[tracks.status[:, tracks.names.index(name)] != "seen"] = np.nan
    flat = undistorted(corners, markers.lens, picture) - centre
    side = tracks.stickers.side_mm[at] * markers.printed.stretch
    points = np.column_stack([CORNERS, np.zeros(4)]) * side / float(np.ptp(CORNERS[:, 0]))
    stretch = np.tile([picture.pixel_aspect, 1.0], 4)
    covariance = tracks.stickers.covariance_px2[:, at] * np.outer(stretch, stretch)
    if picture.mirrored:
        # The mirror image of a square is the square with its left and right corners exchanged.
        flat = flat[:, OTHER_SIDE]
        order = (2 * np.array(OTHER_SIDE)[:, None] + [0, 1]).ravel()
        signs = np.tile(picture.sides, 4)
        covariance = covariance[:, order][:, :, order] * np.outer(signs, signs)
    # Paper and encoder distort a sticker; they hardly displace it as a whole.
    together = np.kron(np.full((4, 4), 0.25), np.eye(2))
    covariance = covariance + COMMON_ERROR_PX**2 * (np.eye(8) - together)
    return Observed(name, points, flat.reshape(len(flat), 8), covariance)


def _largest_side_px(marks: list[Observed]) -> float:
    """Return the side of the largest sticker in the picture, px, as its median over the frames."""
    sides = []
    for mark in marks:
        if mark.coded and mark.seen.any():
            corners = mark.seen_px[mark.seen].reshape(-1, 4, 2)
            edges = np.hypot(*np.moveaxis(corners - np.roll(corners, 1, axis=1), -1, 0))
            sides.append(float(np.median(edges)))
    return max(sides)


def _bridged(values: Array) -> Array:
    """Return values (n, …) with gaps filled by straight lines, and their ends held."""
    rows = np.arange(len(values))
    flat = values.reshape(len(values), -1).copy()
    for column in flat.T:
        known = np.isfinite(column)
        column[~known] = np.interp(rows[~known], rows[known], column[known])
    return flat.reshape(values.shape)


def pose_known(poses: SpatialPoses, time_s: Array) -> NDArray[np.bool_]:
    """Return (n,) in which frames a pose is measured, or in a dropout short enough to bridge."""
    known = np.isfinite(poses.place_mm[:, 0])
    at = np.flatnonzero(known)
    for a, b in itertools.pairwise(at):
        if b - a > 1 and time_s[b] - time_s[a] <= LONGEST_BRIDGE_S:
            known[a:b] = True
    return known


def plane_poses(
    body: str, names: tuple[str, ...], coded: CodedBody, time_s: Array, rows: slice
) -> tuple[Poses, OutOfPlanePose]:
    """Return the poses of a body in the plane and out of it, in an interval of frames.

    Parameters
    ----------
    body, names
        The body and its markers.
    coded
        Its poses in space.
    time_s
        (n,) times of the interval, s.
    rows
        The interval.
    """
    spatial = coded.spatial
    smooth = _Smoother(spatial, time_s, rows).solved()
    axis = smooth.upright @ spatial.axis
    flip = np.array([1.0, -1.0, -1.0])
    values = smooth.in_plane
    poses = Poses(
        body=body,
        markers=names,
        position_mm=values[:, :2] * flip[:2],
        angle_rad=values[0, 2] - values[:, 2],
        covariance=smooth.covariance * np.outer(flip, flip),
        shared_covariance=smooth.shared * np.outer(flip, flip),
        residual_mm=spatial.residual_mm[rows],
        expected_residual_mm=spatial.expected_residual_mm,
        turns=True,
        noise_known=True,
        persistence=smooth.persistence,
        axis_rad=float(np.arctan2(-axis[1], axis[0])) - float(values[0, 2]),
    )
    return poses, _out_of_plane(smooth, coded.focal_known)


@dataclass(frozen=True)
class _SmoothPoses:
    """Coordinates since ``upright`` (3, 3): x, y, twist; depth and swing smooth.

    ``covariance`` is that of a frame's own noise, ``shared`` that due to depth and swing.
    """

    upright: Array
    in_plane: Array
    covariance: Array
    shared: Array
    out_of_plane: Array
    sigma: Array
    persistence: float


@dataclass(frozen=True)
class _Equations:
    """Normal equations in the plane (a), out of it (b) and of the arrangement (s)."""

    aa: Array
    ab: Array
    bb: Array
    a: Array
    b: Array
    a_s: Array
    ss: Array
    s: Array


class _Smoother:
    """Least squares of a body's marks with depth and swing that are smooth in time.

    Depth and swing are linearised at the smooth curve, not at each frame's own noisy value: a flat
    mark that faces the camera hardly tells a small swing, and its own estimate is then wrong by
    much more than its linear error.
    """

    def __init__(self, spatial: SpatialPoses, time_s: Array, rows: slice) -> None:
        self.time_s = time_s
        self.known = spatial.known[rows]
        inside = np.zeros(spatial.known.size, bool)
        inside[rows] = True
        base = BodySystem(only_frames(spatial.marks, spatial.known), spatial.focal_px).gauge
        chosen = only_frames(spatial.marks, spatial.known & inside)
        self.system = BodySystem(chosen, spatial.focal_px, base)
        kept = inside[spatial.known]
        self.fit = BodyFit(
            spatial.fit.arrangement, spatial.fit.turn[kept], spatial.fit.place[kept], np.inf
        )
        self.noise = spatial.misfit**2
        self.persistence = self.system.persistence(self.fit)
        own_px = np.sqrt(self.noise) * self.system.expected_distance_px() / np.sqrt(2)
        self.common = 2 * COMMON_ERROR_PX / own_px
        self.side_px = _largest_side_px(chosen)
        places = spatial.fit.arrangement.places
        apart = float(np.hypot(*np.ptp(places[:, :2], axis=0)))
        scale = spatial.focal_px / float(np.median(self.fit.place[:, 2]))
        self.extent_px = max(self.side_px, apart * scale)
        self.upright = self.fit.turn[0]

    def solved(self) -> _SmoothPoses:
        """Return the smooth poses of all frames of the interval."""
        values = self._values(self.fit)
        swing = values[:, OUT_OF_PLANE]
        usual = np.median(np.abs(np.diff(swing, axis=0)), axis=0) + 1e-9
        smooth, sigma = self._smooth(swing, np.tile(usual, (len(swing), 1)))
        self._place(values[:, IN_PLANE], smooth)
        for _ in range(SMOOTHING_ROUNDS):
            equations = self._equations()
            self._arrange(equations)
            equations = self._equations()
            before = self._values(self.fit)
            inverse = np.linalg.inv(equations.aa)
            carried = np.einsum("nji,njk->nik", equations.ab, inverse)
            left = equations.bb - np.einsum("nij,njk->nik", carried, equations.ab)
            right = equations.b - np.einsum("nij,nj->ni", carried, equations.a)
            spread = np.linalg.inv(left + np.diag([0.0, 1.0, 1.0]) / WIDEST_SWING**2)
            aimed = before[:, OUT_OF_PLANE] + np.einsum("nij,nj->ni", spread, right)
            error = np.sqrt(self.noise * np.einsum("nii->ni", spread))
            smooth, sigma = self._smooth(aimed, np.sqrt(self.persistence) * error)
            moved = smooth[self.known] - before[:, OUT_OF_PLANE]
            plane = equations.a - np.einsum("nij,nj->ni", equations.ab, moved)
            plane = before[:, IN_PLANE] + np.einsum("nij,nj->ni", inverse, plane)
            self._place(plane, smooth)
        whole = np.full((self.known.size, 3), np.nan)
        whole[self.known] = self._common_error(error)
        return self._result(plane, smooth, np.hypot(sigma, _bridged(whole)))

    def _values(self, fit: BodyFit) -> Array:
        """Return x, y, twist, depth, swing about x and y (n, 6) since ``upright``."""
        swing, twist = swing_twist(fit.turn @ self.upright.T)
        first = np.einsum("nij,j->ni", fit.turn, fit.arrangement.places[0]) + fit.place
        return np.column_stack([first[:, :2], np.unwrap(twist), first[:, 2], swing])

    def _place(self, plane: Array, smooth: Array) -> None:
        """Put the frames where coordinates in and out of the plane say."""
        known = smooth[self.known]
        zero = np.zeros(len(plane))
        twist = rotation_of(np.column_stack([zero, zero, plane[:, 2]]))
        turn = rotation_of(np.column_stack([known[:, 1:], zero])) @ twist @ self.upright
        first = np.column_stack([plane[:, :2], known[:, 0]])
        place = first - np.einsum("nij,j->ni", turn, self.fit.arrangement.places[0])
        self.fit = BodyFit(self.fit.arrangement, turn, place, np.inf)

    def _smooth(self, values: Array, error: Array) -> tuple[Array, Array]:
        """Return depth and swing smoothed in all frames, and their standard errors."""
        n = self.known.size
        columns = []
        for k in range(3):
            whole, spread = np.full(n, np.nan), np.full(n, BRIDGE_SIGMA * np.median(error[:, k]))
            whole[self.known], spread[self.known] = values[:, k], error[:, k]
            columns.append(smoothed(self.time_s, _bridged(whole), spread, noise_known=True))
        return (
            np.column_stack([column.values for column in columns]),
            np.column_stack([column.sigma for column in columns]),
        )

    def _equations(self) -> _Equations:
        frames, mixed, shape, by_frame, by_shape = self.system.equations(self.fit)
        back = np.linalg.inv(self._jacobian())
        whole = np.einsum("nji,njk,nkl->nil", back, frames, back)
        pull = np.einsum("nji,nj->ni", back, by_frame)
        to_shape = np.einsum("nji,njk->nik", back, mixed)
        a, b = IN_PLANE, OUT_OF_PLANE
        return _Equations(
            aa=whole[:, a, a],
            ab=whole[:, a, b],
            bb=whole[:, b, b],
            a=pull[:, a],
            b=pull[:, b],
            a_s=to_shape[:, a],
            ss=shape,
            s=by_shape,
        )

    def _jacobian(self) -> Array:
        """Return the derivatives (n, 6, 6) of the coordinates by small rotations and shifts."""
        start = self._values(self.fit)
        jacobian = np.zeros((len(start), 6, 6))
        for k in range(3):
            small = np.zeros(3)
            small[k] = 1e-5
            turned = BodyFit(
                self.fit.arrangement, rotation_of(small) @ self.fit.turn, self.fit.place, np.inf
            )
            change = self._values(turned) - start
            change[:, 2] = (change[:, 2] + np.pi) % (2 * np.pi) - np.pi
            jacobian[:, :, k] = change / 1e-5
        jacobian[:, 0, 3] = jacobian[:, 1, 4] = jacobian[:, 3, 5] = 1.0
        return jacobian

    def _arrange(self, equations: _Equations) -> None:
        """Move the marks on the body, with the poses in the plane, at given depth and swing."""
        if not len(equations.s):
            return
        values = self._values(self.fit)
        inverse = np.linalg.inv(equations.aa)
        carried = np.einsum("nji,njk->nik", equations.a_s, inverse)
        left = equations.ss - np.einsum("nij,njk->ik", carried, equations.a_s)
        right = equations.s - np.einsum("nij,nj->i", carried, equations.a)
        step = np.linalg.lstsq(left, right)[0]
        plane = equations.a - np.einsum("nij,j->ni", equations.a_s, step)
        plane = values[:, IN_PLANE] + np.einsum("nij,nj->ni", inverse, plane)
        arrangement = self.system.rearranged(self.fit.arrangement, step)
        self.fit = BodyFit(arrangement, self.fit.turn, self.fit.place, np.inf)
        whole = np.full((self.known.size, 3), np.nan)
        whole[self.known] = values[:, OUT_OF_PLANE]
        self._place(plane, _bridged(whole))

    def _of_arrangement(self, equations: _Equations) -> Array:
        """Return the covariance (n, 3, 3) in the plane due to where the marks sit on the body."""
        inverse = np.linalg.inv(equations.aa)
        if not len(equations.s):
            return np.zeros_like(inverse)
        carried = np.einsum("nij,njk->nik", inverse, equations.a_s)
        left = equations.ss - np.einsum("nji,njk->ik", equations.a_s, carried)
        spread = np.linalg.pinv(left, hermitian=True)
        return np.asarray(np.einsum("nij,jk,nlk->nil", carried, spread, carried))

    def _common_error(self, error: Array) -> Array:
        """Return the error (n, 3) of depth and swing that all frames share.

        All edges of a sticker can be wrong the same way: its size then is, and its depth. If they
        are wrong in one direction, the sticker seems to be swung by φ with 1 − cos φ of that share,
        unless several marks tell the swing much better in each frame (``error``).
        """
        share = COMMON_ERROR_PX / self.side_px
        first = self._values(self.fit)[:, 3]
        swing, _ = swing_twist(self.fit.turn)
        angle = np.maximum(np.hypot(*swing.T), np.sqrt(2 * share))
        flattened = np.minimum((share / np.sin(angle))[:, None], LEAST_TOLD * error[:, 1:])
        return np.column_stack([first * share, flattened])

    def _angle_error(self, sigma: Array) -> Array:
        """Return the standard error (n,) of the angle in the plane due to wrong swings, rad.

        The marks' own error counts over their extent. A line on a body that is thought to be swung
        by φ about the wrong axis turns by up to φ²/4; angles count from the first frame, so that
        its swing is wrong in all of them.
        """
        swing, _ = swing_twist(self.fit.turn @ self.upright.T)
        own = np.hypot(*sigma[:, 1:].T) / np.sqrt(2)
        wrong = np.hypot(own, own[0])
        error = 0.5 * wrong * (np.hypot(*swing.T) + 0.5 * wrong)
        error = np.hypot(error, 2 * COMMON_ERROR_PX / self.extent_px)
        error[0] = 0.0
        return np.asarray(error)

    def _result(self, plane: Array, smooth: Array, sigma: Array) -> _SmoothPoses:
        equations = self._equations()
        inverse = np.linalg.inv(equations.aa)
        gain = np.einsum("nij,njk->nik", inverse, equations.ab)
        spread = self.noise * inverse
        values = np.full((self.known.size, 3), np.nan)
        values[self.known] = plane
        usual = BRIDGE_SIGMA**2 * np.median(np.einsum("nii->ni", spread), axis=0)
        covariance = np.tile(np.diag(usual), (self.known.size, 1, 1))
        covariance[self.known] = spread
        shared = np.full((self.known.size, 3, 3), np.nan)
        shared[self.known] = np.einsum("nij,nj,nkj->nik", gain, sigma[self.known] ** 2, gain)
        shared[:, 2] = shared[:, :, 2] = 0.0
        shared[self.known, 2, 2] = self._angle_error(sigma[self.known]) ** 2
        common = self.common**2 * spread + self.noise * self._of_arrangement(equations)
        # Angles count from the first frame, where their error is zero.
        common[0, 2] = common[0, :, 2] = 0.0
        shared[self.known] += common
        return _SmoothPoses(
            self.upright,
            _bridged(values),
            covariance,
            _bridged(shared),
            smooth,
            sigma,
            self.persistence,
        )


def _out_of_plane(smooth: _SmoothPoses, focal_known: bool) -> OutOfPlanePose:
    """Return depth and tilt in the world's axes; an unknown focal length stretches both."""
    values, sigma = smooth.out_of_plane, smooth.sigma
    depth, tilt = values[:, 0] - values[0, 0], (values[:, 1:] - values[0, 1:]) * [1.0, -1.0]
    doubt = 0.0 if focal_known else FOCAL_SPREAD
    return OutOfPlanePose(
        depth_mm=depth,
        depth_sigma_mm=np.hypot(np.hypot(sigma[:, 0], sigma[0, 0]), doubt * depth),
        tilt_rad=tilt,
        tilt_sigma_rad=np.hypot(sigma[:, 1:], sigma[0, 1:]),
    )
