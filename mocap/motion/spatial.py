"""Bodies in space from the corners of their stickers, and from dots beside them.

A body carries stickers, whose four corners are known in mm, and dots. Its pose in each frame, and
where its other marks sit on it, are those of least squares of all corners and dots in the picture
(bundle adjustment, Triggs et al. 2000), weighted with the covariance of each sticker's corners:

    x = f X/Z,  y = f Y/Z,   (X, Y, Z) = R_t S + T_t,

camera axes: x right, y down, z forward. The normal equations of the frames are eliminated first
(Schur complement). A flat mark looks the same when it is turned by +φ or −φ out of the plane: each
frame tries both, with what its other marks say about depth.

The focal length f scales depths; positions in the plane follow from the size of the stickers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion.rotations import rotation_of, swing_twist, vector_of

Array: TypeAlias = NDArray[np.float64]

# Spread of where a dot lies in depth beside its body's first sticker, mm, and of all other places.
DOT_DEPTH_MM = 40.0
PLACE_MM = 300.0
TILT_SPREAD = 1.5
# Steps of a frame's pose from the other side, and the chi-square by which it has to be better.
SETTLING = 8
CLEARLY_BETTER = 9.0
# Weight of the newest frame in the side to which a body is tilted.
SIDE_MEMORY = 0.3
ITERATIONS = 40
# Frames over which the encoder's errors are correlated at most.
LONGEST_COPY = 8
# The iteration ends when its cost falls by less than this share.
COST_TOLERANCE = 1e-7


@dataclass(frozen=True)
class Observed:
    """What the film shows of one mark of a body.

    Attributes
    ----------
    name
        The marker.
    points_mm
        (k, 3) its points in its own axes (right, down, into the body), mm: four corners, or one.
    seen_px
        (n, 2k) where they appear, x0, y0, x1, …, px from the camera's axis; nan where not seen.
    covariance_px2
        (n, 2k, 2k) covariance of these.
    """

    name: str
    points_mm: Array
    seen_px: Array
    covariance_px2: Array

    @property
    def coded(self) -> bool:
        """Whether the mark is a sticker."""
        return len(self.points_mm) == 4

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(n,) whether the mark is seen."""
        return np.asarray(np.isfinite(self.seen_px[:, 0]))


@dataclass(frozen=True)
class Arrangement:
    """Where the marks sit on the body: rotation (m, 3, 3) and place (m, 3), mm, of each."""

    turns: Array
    places: Array


@dataclass(frozen=True)
class BodyFit:
    """Arrangement of the marks, pose of each frame and cost.

    ``turn`` (n, 3, 3) and ``place`` (n, 3), mm, take the axes of the sticker that is seen most
    often to the camera's; ``cost`` is the sum of squares over variances.
    """

    arrangement: Arrangement
    turn: Array
    place: Array
    cost: float


@dataclass(frozen=True)
class SpatialPoses:
    """Pose of a body in space in each frame.

    Attributes
    ----------
    turn
        (n, 3, 3) from the axes of its first sticker to the camera's; nan where it is not known.
    place_mm
        (n, 3) position of its first marker, mm from the camera; nan where it is not known.
    covariance
        (n, 6, 6) covariance of a small rotation about the camera's axes and of the place.
    focal_px
        Focal length, px.
    misfit
        Root mean square of the residuals over their standard errors, at least 1.
    axis
        (3,) direction from the first mark to the last one in the axes of ``turn``; that of a lone
        sticker points to its upper edge.
    residual_mm
        (n,) root mean square distance of the marks from where the pose puts them, mm.
    expected_residual_mm
        The same as the standard errors let expect.
    marks, fit
        What was fitted, and the fit of the frames that tell the pose.
    """

    turn: Array
    place_mm: Array
    covariance: Array
    focal_px: float
    misfit: float
    axis: Array
    residual_mm: Array
    expected_residual_mm: float
    marks: tuple[Observed, ...]
    fit: BodyFit

    @property
    def known(self) -> NDArray[np.bool_]:
        """(n,) in which frames the pose is measured."""
        return np.asarray(np.isfinite(self.place_mm[:, 0]))


def usable_frames(marks: list[Observed]) -> NDArray[np.bool_]:
    """Return (n,) in which frames the marks tell the pose: a sticker, or three dots, are seen."""
    stickers = sum(mark.seen.astype(int) for mark in marks if mark.coded)
    dots = sum(mark.seen.astype(int) for mark in marks if not mark.coded)
    return np.asarray((np.asarray(stickers) > 0) | (np.asarray(dots) > 2))


def spatial_poses(marks: list[Observed], focal_px: float) -> SpatialPoses:
    """Return the pose of a body in all frames that tell it; the first mark is its origin."""
    known = usable_frames(marks)
    fit = _fitted(marks, focal_px)
    system = BodySystem(only_frames(marks, known), focal_px)
    covariance = system.covariance(fit)
    misfit = system.misfit(fit)
    covariance *= misfit**2
    n = known.size
    turn, place = np.full((n, 3, 3), np.nan), np.full((n, 3), np.nan)
    whole = np.full((n, 6, 6), np.nan)
    turn[known] = fit.turn
    arm = np.einsum("nij,j->ni", fit.turn, fit.arrangement.places[0])
    place[known] = fit.place + arm
    # The place of the first mark moves with a rotation about the body's own origin.
    lever = np.zeros((len(arm), 6, 6)) + np.eye(6)
    lever[:, 3:, :3] = -_cross(arm)
    whole[known] = np.einsum("nij,njk,nlk->nil", lever, covariance, lever)
    residual = np.full(n, np.nan)
    scale = fit.place[:, 2] / focal_px
    residual[known] = system.distance_px(fit) * scale
    return SpatialPoses(
        turn=turn,
        place_mm=place,
        covariance=whole,
        focal_px=focal_px,
        misfit=misfit,
        axis=_axis(fit.arrangement),
        residual_mm=residual,
        expected_residual_mm=system.expected_distance_px() * float(np.median(scale)),
        marks=tuple(marks),
        fit=fit,
    )


def _axis(arrangement: Arrangement) -> Array:
    """Return the direction (3,) from the first mark to the last, or up a lone sticker."""
    if len(arrangement.places) == 1:
        return np.asarray(arrangement.turns[0] @ [0.0, -1.0, 0.0])
    along = arrangement.places[-1] - arrangement.places[0]
    return np.asarray(along / np.linalg.norm(along))


def only_frames(marks: Sequence[Observed], rows: NDArray[np.bool_]) -> list[Observed]:
    """Return the marks in some of the frames."""
    return [Observed(m.name, m.points_mm, m.seen_px[rows], m.covariance_px2[rows]) for m in marks]


def _fitted(marks: list[Observed], focal_px: float) -> BodyFit:
    system = BodySystem(only_frames(marks, usable_frames(marks)), focal_px)
    start = system.start()
    fits = [system.refined(system.tilted(start, sign)) for sign in (1.0, -1.0)]
    best = min(fits, key=lambda fit: fit.cost)
    return system.refined(system.mended(system.refined(system.mended(best))))


class BodySystem:
    """Residuals of a body's marks, their derivatives, and the steps of least squares.

    Parameters
    ----------
    marks
        The marks, in frames that tell the pose.
    focal_px
        Focal length, px.
    gauge
        The sticker whose axes are the body's; None: the one seen most often.
    """

    def __init__(
        self, marks: Sequence[Observed], focal_px: float, gauge: int | None = None
    ) -> None:
        self.marks = marks
        self.focal_px = focal_px
        stickers = [k for k, mark in enumerate(marks) if mark.coded]
        self.gauge = max(stickers, key=lambda k: marks[k].seen.sum()) if gauge is None else gauge
        self.weights = []
        for mark in marks:
            weight = np.zeros_like(mark.covariance_px2)
            weight[mark.seen] = np.linalg.inv(mark.covariance_px2[mark.seen])
            self.weights.append(weight)
        self.count = int(sum(mark.seen.sum() * mark.seen_px.shape[1] for mark in marks))

    def misfit(self, fit: BodyFit) -> float:
        """Return the residuals' root mean square over their standard errors, at least 1."""
        freedom = self.count - 6 * len(fit.turn) - 6 * (len(self.marks) - 1)
        return max(float(np.sqrt(fit.cost / max(freedom, 1))), 1.0)

    def start(self) -> BodyFit:
        """Return poses without tilt, from each sticker's size and direction in the picture."""
        n, m = len(self.marks[0].seen_px), len(self.marks)
        angle, place = np.full((n, m), np.nan), np.full((n, m, 3), np.nan)
        for k, mark in enumerate(self.marks):
            if mark.coded:
                angle[mark.seen, k], place[mark.seen, k] = self._upright(mark)
        depth = np.nanmedian(place[..., 2], axis=1)
        for k, mark in enumerate(self.marks):
            if not mark.coded:
                seen = mark.seen
                place[seen, k, :2] = mark.seen_px[seen] * depth[seen, None] / self.focal_px
                place[seen, k, 2] = depth[seen]
        offsets, spots = np.zeros(m), np.zeros((m, 3))
        base = self.gauge
        for k in range(m):
            both = np.isfinite(place[:, k, 0]) & np.isfinite(place[:, base, 0])
            if k == base or not both.any():
                continue
            apart = place[both, k] - place[both, base]
            back = np.einsum("nji,nj->ni", _about_z(angle[both, base]), apart)
            spots[k] = np.median(back, axis=0)
            if self.marks[k].coded:
                turned = np.exp(1j * (angle[both, k] - angle[both, base]))
                offsets[k] = float(np.angle(turned.sum()))
        own = angle - offsets
        turn, origin = np.empty((n, 3, 3)), np.empty((n, 3))
        first = np.argmax(np.isfinite(angle), axis=1)
        first[np.isfinite(angle[:, base])] = base
        rows = np.arange(n)
        turn[:] = _about_z(np.nan_to_num(own[rows, first]))
        origin[:] = place[rows, first] - np.einsum("nij,nj->ni", turn, spots[first])
        return BodyFit(Arrangement(_about_z(offsets), spots), turn, origin, np.inf)

    def _upright(self, mark: Observed) -> tuple[Array, Array]:
        """Return direction and place of a sticker in the frames that show it, without tilt."""
        middle, turn, _, stretch = self._affine(mark)
        depth = self.focal_px / stretch[:, 0]
        place = np.column_stack([middle * depth[:, None] / self.focal_px, depth])
        return np.arctan2(turn[:, 1, 0], turn[:, 0, 0]), place

    def _affine(self, mark: Observed) -> tuple[Array, Array, Array, Array]:
        """Return middle, rotation, main axes and stretches of a sticker where it is seen."""
        corners = mark.seen_px[mark.seen].reshape(-1, 4, 2)
        middle = corners.mean(axis=1)
        flat = mark.points_mm[:, :2]
        affine = np.einsum("nki,kj->nij", corners - middle[:, None], flat)
        left, stretch, right = np.linalg.svd(affine / (flat[:, 0] @ flat[:, 0]))
        return middle, np.asarray(left @ right), left, stretch

    def residuals(self, k: int, fit: BodyFit) -> tuple[Array, Array, Array]:
        """Return the residuals (n, 2p) of a mark, its points about the origin and in space."""
        mark = self.marks[k]
        on_body = mark.points_mm @ fit.arrangement.turns[k].T + fit.arrangement.places[k]
        arm = np.einsum("nij,pj->npi", fit.turn, on_body)
        space = arm + fit.place[:, None]
        seen = self.focal_px * space[..., :2] / space[..., 2:]
        left = np.nan_to_num(mark.seen_px - seen.reshape(len(seen), -1))
        return np.where(mark.seen[:, None], left, 0.0), arm, space

    def costs(self, fit: BodyFit) -> Array:
        """Return (n,) the weighted sum of squares in each frame."""
        total = np.zeros(len(fit.turn))
        for k, weight in enumerate(self.weights):
            left, _, space = self.residuals(k, fit)
            total += np.einsum("ni,nij,nj->n", left, weight, left)
            total += np.where((space[..., 2] <= 1.0).any(axis=1), 1e12, 0.0)
        return total

    def distance_px(self, fit: BodyFit) -> Array:
        """Return (n,) the root mean square distance of seen points from their place, px."""
        squares, count = np.zeros(len(fit.turn)), np.zeros(len(fit.turn))
        for k, mark in enumerate(self.marks):
            left, _, _ = self.residuals(k, fit)
            squares += np.sum(left**2, axis=1)
            count += mark.seen * len(mark.points_mm)
        return np.asarray(np.sqrt(squares / count))

    def persistence(self, fit: BodyFit) -> float:
        """Return how many frames share an error, from the correlation of the residuals in time.

        An encoder copies blocks with their error from frame to frame.
        """
        residuals = []
        for k, mark in enumerate(self.marks):
            left, _, _ = self.residuals(k, fit)
            residuals.append(np.where(mark.seen[:, None], left, np.nan))
        left = np.concatenate(residuals, axis=1)
        variance = float(np.nanmean(left**2))
        shared = 1.0
        for lag in range(1, min(LONGEST_COPY, len(left) - 1) + 1):
            share = float(np.nanmean(left[lag:] * left[:-lag])) / max(variance, 1e-30)
            if not share > 0:
                break
            shared += 2 * share
        return shared

    def expected_distance_px(self) -> float:
        """Return the root mean square distance that the standard errors let expect, px."""
        variances = [
            2 * np.einsum("nii->ni", mark.covariance_px2[mark.seen]).mean() for mark in self.marks
        ]
        return float(np.sqrt(np.mean(variances)))

    def prior(self, arrangement: Arrangement) -> float:
        """Return what the arrangement costs beside the residuals."""
        return float(sum(v @ (p * v) for v, p in self._prior_terms(arrangement)))

    def _prior_terms(self, arrangement: Arrangement) -> list[tuple[Array, Array]]:
        """Return value (6,) and weight (6,) of the prior of each mark's turn and place."""
        terms = []
        for k, mark in enumerate(self.marks):
            if k == self.gauge:
                continue
            depth = PLACE_MM if mark.coded else DOT_DEPTH_MM
            spread = np.array([*[TILT_SPREAD] * 3, PLACE_MM, PLACE_MM, depth])
            value = np.append(vector_of(arrangement.turns[k]), arrangement.places[k])
            terms.append((value, 1 / spread**2))
        return terms

    def equations(self, fit: BodyFit) -> tuple[Array, Array, Array, Array, Array]:
        """Return the blocks of the normal equations, then their right-hand sides.

        Blocks: frames (n, 6, 6), frames by arrangement (n, 6, p), arrangement (p, p).
        """
        n, others = len(fit.turn), [k for k in range(len(self.marks)) if k != self.gauge]
        p = 6 * len(others)
        frames, mixed = np.zeros((n, 6, 6)), np.zeros((n, 6, p))
        shape, by_frame, by_shape = np.zeros((p, p)), np.zeros((n, 6)), np.zeros(p)
        for k, weight in enumerate(self.weights):
            left, arm, space = self.residuals(k, fit)
            flat = self._projection(space)
            lever = np.concatenate([-_cross(arm), np.broadcast_to(np.eye(3), (*arm.shape, 3))], -1)
            of_frame = np.einsum("nprc,npcq->nprq", flat, lever).reshape(n, -1, 6)
            weighted = np.einsum("nij,njk->nik", weight, of_frame)
            frames += np.einsum("nij,nik->njk", of_frame, weighted)
            by_frame += np.einsum("nij,ni->nj", weighted, left)
            if k == self.gauge:
                continue
            rotated = self.marks[k].points_mm @ fit.arrangement.turns[k].T
            local = np.concatenate([-_cross(rotated), np.tile(np.eye(3), (len(rotated), 1, 1))], -1)
            of_shape = np.einsum("nprc,ncd,pdq->nprq", flat, fit.turn, local).reshape(n, -1, 6)
            at = slice(6 * others.index(k), 6 * others.index(k) + 6)
            mixed[:, :, at] += np.einsum("nij,nik->njk", weighted, of_shape)
            pulled = np.einsum("nij,njk->nik", weight, of_shape)
            shape[at, at] += np.einsum("nij,nik->jk", of_shape, pulled)
            by_shape[at] += np.einsum("nij,ni->j", pulled, left)
        for number, (value, inverse) in enumerate(self._prior_terms(fit.arrangement)):
            at = slice(6 * number, 6 * number + 6)
            shape[at, at] += np.diag(inverse)
            by_shape[at] -= inverse * value
        return frames, mixed, shape, by_frame, by_shape

    def _projection(self, space: Array) -> Array:
        """Return the derivatives (n, p, 2, 3) of picture points by points in space."""
        x, y, z = np.moveaxis(space, -1, 0)
        flat = np.zeros((*z.shape, 2, 3))
        flat[..., 0, 0] = flat[..., 1, 1] = self.focal_px / z
        flat[..., 0, 2], flat[..., 1, 2] = -self.focal_px * x / z**2, -self.focal_px * y / z**2
        return flat

    def refined(self, fit: BodyFit) -> BodyFit:
        """Return the least squares fit from a start, by damped Gauss-Newton steps."""
        cost = float(self.costs(fit).sum()) + self.prior(fit.arrangement)
        damping = 1e-3
        for _ in range(ITERATIONS):
            trial = self._stepped(fit, damping)
            trial_cost = float(self.costs(trial).sum()) + self.prior(trial.arrangement)
            if trial_cost <= cost:
                done = cost - trial_cost < COST_TOLERANCE * cost
                fit, cost, damping = trial, trial_cost, max(0.1 * damping, 1e-9)
                if done:
                    break
            else:
                damping *= 10.0
                if damping > 1e6:
                    break
        return BodyFit(fit.arrangement, fit.turn, fit.place, cost)

    def _stepped(self, fit: BodyFit, damping: float) -> BodyFit:
        frames, mixed, shape, by_frame, by_shape = self.equations(fit)
        frames = frames + damping * frames * np.eye(6) + 1e-12 * np.eye(6)
        inverse = np.linalg.inv(frames)
        step = np.zeros(len(by_shape))
        if step.size:
            shape = shape + damping * np.diag(np.diag(shape))
            carried = np.einsum("nji,njk->nik", mixed, inverse)
            complement = shape - np.einsum("nij,njk->ik", carried, mixed)
            right = by_shape - np.einsum("nij,nj->i", carried, by_frame)
            step = np.linalg.lstsq(complement, right)[0]
        moves = np.einsum("nij,nj->ni", inverse, by_frame - mixed @ step)
        return BodyFit(self.rearranged(fit.arrangement, step), *_moved(fit, moves), np.inf)

    def rearranged(self, old: Arrangement, step: Array) -> Arrangement:
        """Return an arrangement after small moves (p,) of all marks but the gauge."""
        turns, places = old.turns.copy(), old.places.copy()
        others = [k for k in range(len(self.marks)) if k != self.gauge]
        for number, k in enumerate(others):
            part = step[6 * number : 6 * number + 6]
            turns[k] = rotation_of(part[:3]) @ turns[k]
            places[k] = places[k] + part[3:]
        return Arrangement(turns, places)

    def tilted(self, fit: BodyFit, sign: float) -> BodyFit:
        """Return a fit without tilt with the tilts that its largest stickers show, of one sign.

        A sticker shows how far it is tilted and about which axis, but not to which side. The side
        is that of the frame before, as far as there is one.
        """
        tilts = np.zeros((len(fit.turn), 2))
        count = np.zeros(len(fit.turn))
        for mark in self.marks:
            if mark.coded:
                tilts[mark.seen] += self._flattening(mark)
                count += mark.seen
        axis = 0.5 * np.arctan2(tilts[:, 1], tilts[:, 0])
        share = np.hypot(*tilts.T) / np.maximum(count, 1)
        size = np.arccos(1 - np.clip(share, 0.0, 0.6))
        swings = size[:, None] * np.column_stack([np.cos(axis), np.sin(axis)])
        usual = np.zeros(2)
        for k, swing in enumerate(swings):
            if usual @ swing < 0:
                swings[k] = -swing
            usual = (1 - SIDE_MEMORY) * usual + SIDE_MEMORY * swings[k]
        flat = np.column_stack([sign * swings, np.zeros(len(swings))])
        return BodyFit(fit.arrangement, rotation_of(flat) @ fit.turn, fit.place, np.inf)

    def mended(self, fit: BodyFit) -> BodyFit:
        """Return the fit with the tilt to the other side in the frames that this suits clearly."""
        swing, twist = swing_twist(fit.turn)
        zero = np.zeros_like(twist)
        upright = rotation_of(np.column_stack([zero, zero, twist]))
        other = rotation_of(np.column_stack([-swing, zero])) @ upright
        trial = BodyFit(fit.arrangement, other, fit.place, np.inf)
        for _ in range(SETTLING):
            frames, _, _, by_frame, _ = self.equations(trial)
            frames = frames + 1e-4 * frames * np.eye(6) + 1e-12 * np.eye(6)
            solved = np.linalg.solve(frames, by_frame[..., None])[..., 0]
            moves: Array = np.asarray(solved, float)
            trial = BodyFit(fit.arrangement, *_moved(trial, moves), np.inf)
        costs = np.nan_to_num(self.costs(trial), nan=np.inf)
        better = costs < self.costs(fit) - CLEARLY_BETTER
        turn = np.where(better[:, None, None], trial.turn, fit.turn)
        place = np.where(better[:, None], trial.place, fit.place)
        return BodyFit(fit.arrangement, turn, place, np.inf)

    def _flattening(self, mark: Observed) -> Array:
        """Return by how much a sticker is flattened, as (n, 2) vector at twice its axis' angle."""
        _, _, left, stretch = self._affine(mark)
        # The first column of ``left`` is the direction of the longer axis: that of the tilt.
        double = 2 * np.arctan2(left[:, 1, 0], left[:, 0, 0])
        flat = 1 - stretch[:, 1] / stretch[:, 0]
        return np.asarray(flat[:, None] * np.column_stack([np.cos(double), np.sin(double)]))

    def covariance(self, fit: BodyFit) -> Array:
        """Return the covariance (n, 6, 6) of the poses, that of the arrangement included."""
        frames, mixed, shape, _, _ = self.equations(fit)
        inverse = np.linalg.inv(frames + 1e-12 * np.eye(6))
        if not len(shape):
            return np.asarray(inverse)
        carried = np.einsum("nij,njk->nik", inverse, mixed)
        complement = shape - np.einsum("nji,njk->ik", mixed, carried)
        spread = np.linalg.pinv(complement, hermitian=True)
        return np.asarray(inverse + np.einsum("nij,jk,nlk->nil", carried, spread, carried))


def _moved(fit: BodyFit, moves: Array) -> tuple[Array, Array]:
    """Return turns and places after small moves (n, 6)."""
    capped: Array = np.asarray(np.clip(moves[:, :3], -0.5, 0.5))
    return rotation_of(capped) @ fit.turn, fit.place + moves[:, 3:]


def _about_z(angle: Array) -> Array:
    """Return the rotations (n, 3, 3) about z by angles (n,)."""
    flat = np.zeros((*np.shape(angle), 3))
    flat[..., 2] = angle
    return rotation_of(flat)


def _cross(vectors: Array) -> Array:
    """Return the matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
