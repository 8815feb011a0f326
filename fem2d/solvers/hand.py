"""A hand that yields: the neck's coordinates are unknowns, each with an equation of balance.

A rigid body that a hand carries is where the motion says, ``q_rec(t)``, plus an offset ``z`` that
is to be found. With the coordinates ``q = (x, y, L θ)``, ``L`` a length that makes an angle a way,

    q = q_rec(t) + T z,        S z + D ż = Q(u, q) − Q_ref(t),

where each ``Q`` is a weighted sum of the forces and the moment, ``w · (F_x, F_y, M/L)``, with which
some of the contacts push the body, ``M`` about the body's origin. Two hands are made of this:

* `Hand.yielding` yields about the recorded motion with a stiffness for each coordinate, preloaded
  by what it bore in a reference run: that run itself is reproduced, whatever the stiffness;
* `Hand.of_forces` lets each lip bear what it bore in a reference run, or what is stated: two
  coordinates are found for two forces, with a stiffness far below the tissue's that only says where
  the body is while nothing touches.

``ż`` is the mean over the step. The damping stands for the arm's own; without it a body that is to
meet the tissue would cross any gap in no time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem2d.contact.contact import ContactResponse
from fem2d.contact.rigid import RigidContactResponse, rigid_responses
from fem2d.loads.load import Load, Loading
from fem2d.solvers.bordered import Border
from fem2d.solvers.model import ModelBalance
from fem2d.solvers.state import State
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]

TURNING_LENGTH_MM = 10.0
"""L: a turn is counted as the way, mm, of a point so far away."""


STRETCH = 2.0
"""A step is made at most so many times longer than proposed to end at an instant of a reference."""

SAME_INSTANT_S = 1e-9


class HandError(DrinksimError):
    """A hand was described that cannot carry anything."""


@dataclass(frozen=True, eq=False)
class Borne:
    """What a hand bears in a reference run, or is to bear, against time.

    Parameters
    ----------
    time_s
        (k,) increasing instants, s.
    values
        (k, m) generalised forces on the body, N; linear between, constant beyond the ends.
    """

    time_s: Array
    values: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_s", np.asarray(self.time_s, float))
        object.__setattr__(self, "values", np.atleast_2d(np.asarray(self.values, float)))
        if self.values.shape[0] != self.time_s.size:
            raise HandError(
                f"{self.time_s.size} instants and {self.values.shape[0]} rows of forces: give one "
                "row for each instant"
            )
        if np.any(np.diff(self.time_s) <= 0) or not np.all(np.isfinite(self.values)):
            raise HandError("the instants of what a hand bears must increase, its forces be finite")

    def at(self, time_s: float) -> Array:
        """Return the generalised forces (m,), N, at a time, s."""
        return np.array([np.interp(time_s, self.time_s, column) for column in self.values.T])


@dataclass(frozen=True, eq=False)
class Hand:
    """How a rigid body is carried whose offset from its motion is to be found.

    Parameters
    ----------
    directions
        T (3, m): which coordinates (x, y, L θ) the unknowns move.
    stiffness, damping
        S and D (m, m), N/mm and N s/mm, of the section.
    weights
        (m, 3) of force and moment over L in each equation.
    contacts
        m tuples of names: the contacts whose forces count in each equation; empty means all.
    borne
        Q_ref.
    """

    directions: Array
    stiffness: Array
    damping: Array
    weights: Array
    contacts: tuple[tuple[str, ...], ...]
    borne: Borne

    def __post_init__(self) -> None:
        smallest = float(np.linalg.svd(self.stiffness, compute_uv=False).min())
        if not smallest > 0:
            raise HandError(
                "a hand without stiffness does not say where it holds the body: give every "
                "coordinate that yields a stiffness above 0"
            )

    @classmethod
    def yielding(
        cls,
        stiffness: ArrayLike,
        borne: Borne,
        *,
        damping: ArrayLike = (0.0, 0.0, 0.0),
    ) -> Hand:
        """Return a hand that yields in all coordinates.

        Parameters
        ----------
        stiffness, damping
            (3,) for x, y and the turn, of the section: N/mm, N/mm, N mm/rad; the same times s.
        borne
            Force and moment on the body in the reference run: (k, 3), N, N, N mm.
        """
        scale = np.array([1.0, 1.0, TURNING_LENGTH_MM])
        return cls(
            np.eye(3),
            np.diag(np.asarray(stiffness, float) / scale**2),
            np.diag(np.asarray(damping, float) / scale**2),
            np.eye(3),
            ((), (), ()),
            Borne(borne.time_s, borne.values / scale),
        )

    @classmethod
    def of_forces(
        cls,
        contacts: Sequence[Sequence[str]],
        directions: ArrayLike,
        borne: Borne,
        *,
        stiffness: float,
        damping: float,
    ) -> Hand:
        """Return a hand that lets groups of contacts bear what they are to bear.

        Parameters
        ----------
        contacts
            Two groups of names, each of the contacts of one lip.
        directions
            (2, 2) unit vector of each group's force on the body.
        borne
            (k, 2) forces along them, N.
        stiffness, damping
            Of the offset along each direction, N/mm and N s/mm, of the section; far below the
            tissue's.

        Raises
        ------
        HandError
            If the two directions are nearly one: no offset could then change one force alone.
        """
        along = np.asarray(directions, float)
        if abs(float(np.linalg.det(along))) < SAME_DIRECTION:
            raise HandError(
                "both lips push the neck in nearly the same direction, so their forces cannot be "
                "held one by one: use a hand that yields as a whole"
            )
        return cls(
            np.eye(3, 2),
            stiffness * along,
            damping * along,
            np.column_stack([along, np.zeros(2)]),
            tuple(tuple(group) for group in contacts),
            borne,
        )

    def carried(self, loading: Loading, state: State) -> Loading:
        """Return what acts when the body keeps the offset that it has in a state."""
        recorded = loading(state.time_s).placement
        turn = state.load.turn_rad - recorded.angle_rad
        shift = np.subtract(state.load.move, recorded.shift_mm)

        def at(time_s: float) -> Load:
            load = loading(time_s)
            x, y = np.add(load.move, shift).tolist()
            return replace(load, move=(x, y), turn_rad=load.turn_rad + turn)

        return at

    def unknowns(self, loading: Loading, state: State, duration_s: float) -> Carried:
        """Return the offsets as unknowns of a step of so many seconds from a state.

        ``loading`` tells where the motion puts the body.
        """
        before = self.offset(state.load, loading(state.time_s))
        return Carried(self, loading(state.time_s + duration_s), before, duration_s)

    def aligned(self, time_s: float, duration_s: float) -> float:
        """Return the length of a step that ends where it is known what is borne, if one is near.

        Between two instants of a reference run its forces are only interpolated, so steps do not
        pass an instant, and end at one that is no more than `STRETCH` times farther than proposed.
        """
        later = self.borne.time_s[self.borne.time_s > time_s + SAME_INSTANT_S]
        if later.size == 0:
            return duration_s
        ahead = float(later[0]) - time_s
        return ahead if STRETCH * duration_s >= ahead else duration_s

    def feels(self, contacts: Sequence[ContactResponse], time_s: float) -> bool:
        """Whether something touches wherever a force is to be borne at a time, s.

        Otherwise nothing but the hand's own springs tells, to first order, where the body goes.

        Parameters
        ----------
        contacts
            Responses in a committed state.
        time_s
            A later time.
        """
        touching = {t.contact.name for t in _pressed(contacts)}
        return all(
            force == 0.0 or bool(touching.intersection(names) if names else touching)
            for names, force in zip(self.contacts, self.borne.at(time_s), strict=True)
        )

    def offset(self, load: Load, recorded: Load) -> Array:
        """Return the offsets (m,) that lead from where the motion puts the body to where it is."""
        x, y = np.subtract(load.move, recorded.move).tolist()
        way = np.array([x, y, TURNING_LENGTH_MM * (load.turn_rad - recorded.turn_rad)])
        offset: Array = self.directions.T @ way  # the columns of T are coordinates
        return offset

    def energy(self, offset: Array) -> float:
        """Return the energy of the springs at an offset (m,), N mm; 0 where they have none.

        Springs whose forces have no potential, as those along two directions that are not at right
        angles, have no energy.
        """
        if not np.allclose(self.stiffness, self.stiffness.T):
            return 0.0
        return 0.5 * float(offset @ self.stiffness @ offset)

    def weights_of(self, touch: RigidContactResponse) -> Array:
        """Return the weights (m, 3) of one contact; zero where it does not count."""
        counts = [not names or touch.contact.name in names for names in self.contacts]
        weighted: Array = self.weights * np.array(counts, float)[:, None]
        return weighted


SAME_DIRECTION = 0.05
"""Sine of the angle between two directions below which they count as one."""


@dataclass(frozen=True, eq=False)
class Carried:
    """The offsets of a carried body as unknowns; see `FurtherUnknowns`.

    Attributes
    ----------
    hand
        Who carries it.
    recorded
        The load with the body where the motion puts it.
    before
        (m,) offsets at the committed instant.
    duration_s
        Length of the step, s.
    """

    hand: Hand
    recorded: Load
    before: Array
    duration_s: float

    def values(self, load: Load) -> Array:
        """Return the offsets (m,) in a load."""
        return self.hand.offset(load, self.recorded)

    def applied(self, load: Load, values: Array) -> Load:
        """Return the load with the body moved by offsets (m,) from where the motion puts it."""
        x, y, turn = (self.hand.directions @ values).tolist()
        at = self.recorded
        return replace(
            load,
            move=(at.move[0] + x, at.move[1] + y),
            turn_rad=at.turn_rad + turn / TURNING_LENGTH_MM,
        )

    def alone(self, load: Load) -> tuple[Array, Array]:
        """Return ``S z + D ż + Q_ref`` (m,), N, and its derivative by the offsets (m, m)."""
        hand, offset = self.hand, self.values(load)
        rate = (offset - self.before) / self.duration_s
        held = hand.stiffness @ offset + hand.damping @ rate + hand.borne.at(load.time_s)
        return held, hand.stiffness + hand.damping / self.duration_s

    def residual(self, trial: ModelBalance) -> Array:
        """Return ``−Q`` (m,), N."""
        hand, residual = self.hand, np.zeros(len(self.before))
        for touch in _pressed(trial.contacts):
            force = touch.force
            if touch.placement != trial.load.placement:
                force = force + touch.contact.force_of_motion(touch, trial.load.placement)
            residual -= hand.weights_of(touch) @ _push(touch, force, trial.load.placement)
        return residual

    def border(self, trial: ModelBalance, *, psd: bool) -> Border:
        """Return the derivatives of forces and equations; see `FurtherUnknowns`."""
        hand, count = self.hand, trial.displacement.size
        columns = np.zeros((count, len(self.before)))
        rows = np.zeros((len(self.before), count))
        corner = np.zeros((len(self.before), len(self.before)))
        for touch in _pressed(trial.contacts):
            weights = hand.weights_of(touch)
            by_motion = touch.contact.force_by_motion(touch, psd=psd)
            by_motion[2] /= TURNING_LENGTH_MM
            by_offset = np.tensordot(hand.directions.T, by_motion, axes=1)
            for column, force in zip(columns.T, by_offset, strict=True):
                np.subtract.at(column, touch.dofs, force)
            lever = _levers(touch, trial.load.placement, weights)
            by_node = touch.contact.tangent(touch, psd=psd)
            for row, arm, turning in zip(rows, lever, weights[:, 2], strict=True):
                np.add.at(row, touch.dofs, np.einsum("jp,jpq->jq", arm, by_node))
                np.add.at(row, touch.dofs, turning / TURNING_LENGTH_MM * _turned(touch.force))
            corner = corner + np.einsum("mjp,njp->mn", lever, by_offset)
            corner -= np.outer(
                weights[:, 2] / TURNING_LENGTH_MM,
                _turned(touch.force).reshape(-1, 2).sum(axis=0) @ hand.directions[:2],
            )
        return Border(columns, rows, corner)


def resultant(responses: Sequence[RigidContactResponse], about: RigidPlacement) -> Array:
    """Return force and moment (3,), N, N, N mm, with which contacts push the rigid body.

    The moment is about the origin of the body's frame at a placement.
    """
    total = np.zeros(3)
    for touch in responses:
        total += _push(touch, touch.force, about)
    return total * [1.0, 1.0, TURNING_LENGTH_MM]


def _pressed(contacts: Sequence[ContactResponse]) -> list[RigidContactResponse]:
    """Return the responses of contacts that push the moving bodies."""
    return [t for t in rigid_responses(contacts) if t.contact.moving and t.force.size]


def _push(touch: RigidContactResponse, force: Array, about: RigidPlacement) -> Array:
    """Return force and moment over L (3,), N, on the body from nodal forces (j, 2k) on tissue."""
    flat = force.reshape(-1, 2)
    arm = _arms(touch, about)
    moment = np.sum(arm[:, 0] * flat[:, 1] - arm[:, 1] * flat[:, 0])
    return -np.array([*flat.sum(axis=0), moment / TURNING_LENGTH_MM])


def _arms(touch: RigidContactResponse, about: RigidPlacement) -> Array:
    """Return the deformed nodes (j k, 2) that are pushed, seen from the body's origin, mm."""
    deformed = (touch.contact.surface.nodes + touch.displacement).ravel()
    arms: Array = deformed[touch.dofs].reshape(-1, 2) - about.shift_mm
    return arms


def _levers(touch: RigidContactResponse, about: RigidPlacement, weights: Array) -> Array:
    """Return (m, j, 2k) by how much minus each generalised force grows with each nodal force."""
    x, y = _arms(touch, about).T
    turning = weights[:, 2:3] / TURNING_LENGTH_MM
    levers = np.stack([weights[:, 0:1] - turning * y, weights[:, 1:2] + turning * x], axis=-1)
    return levers.reshape(len(weights), *touch.dofs.shape)


def _turned(force: Array) -> Array:
    """Return (f_y, −f_x) of nodal forces (j, 2k): how a moment grows as the node moves."""
    pairs = force.reshape(*force.shape[:-1], -1, 2)
    turned: Array = np.stack([pairs[..., 1], -pairs[..., 0]], axis=-1).reshape(force.shape)
    return turned
