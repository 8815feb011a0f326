"""Contact against an independent engine: incremental potential contact (Li et al. 2020), ipctk.

The other engine shares the bodies' elastic forces and nothing else: its contact is a barrier on the
distance between boundary polygons, its collision detection is continuous, its steps descend on a
total energy. Its friction is lagged: normal forces and tangents are those of an earlier iterate, so
each small step is solved up to `LAGS` times, each time with those of the last result (in the groove
they end in a cycle of two, some per cent apart). It sticks by a slip of at most `STICK_MM` a step.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from scipy.sparse.linalg import spsolve

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.self_contact import SelfContact
from geometry2d.outline import Outline
from tests.support.contact_models import (
    LIP_PRESS,
    followed,
    force_on_tissue,
    linear_elastic,
    lip_press,
    loaded,
    path,
    still,
    unknowns,
)
from tests.support.optional import needed_module

ipctk = needed_module("ipctk")

REACH_MM = 2e-3
"""Distance at which the barrier sets in."""

STICK_MM = 2e-4
"""Slip in a step below which the other engine's friction rises linearly with it."""

LAGS = 5
"""How often a step is solved unless friction stands still before."""


@dataclass
class BarrierEngine:
    """A body, an obstacle polygon (vertices (m, 2), closed) and who is driven."""

    body: Body
    obstacle: np.ndarray
    driven: np.ndarray
    stiffness: float
    friction: float = 0.0

    def __post_init__(self):
        edges = np.sort(self.body.mesh.facets[:, self.body.mesh.boundary_facets()].T, axis=1)
        self.skin = np.unique(edges)
        local = np.searchsorted(self.skin, edges)
        own, count = len(self.skin), len(self.obstacle)
        ring = own + np.column_stack([np.arange(count), (np.arange(count) + 1) % count])
        rest = np.vstack([self.body.mesh.p.T[self.skin], self.obstacle])
        self.mesh = ipctk.CollisionMesh(
            np.asfortranarray(rest),
            np.asfortranarray(np.vstack([local, ring]).astype(np.int32)),
        )
        self.mesh.can_collide = ipctk.make_static_obstacle_filter(own)
        self.potential = ipctk.BarrierPotential(REACH_MM, self.stiffness, True)
        self.dissipation = ipctk.FrictionPotential(STICK_MM)
        self.lagged = ipctk.TangentialCollisions()
        self.place = np.vstack([self.body.mesh.p.T, self.obstacle])
        self.before = self.place
        nodes = len(self.body.nodes)
        columns = np.concatenate([self.skin, nodes + np.arange(count)])
        pairs = (2 * columns[:, None] + np.arange(2)).ravel()
        self.spread = sp.csr_matrix(
            (np.ones(len(pairs)), (pairs, np.arange(len(pairs)))),
            shape=(2 * len(self.place), len(pairs)),
        )
        obstacle = 2 * nodes + np.arange(2 * count)
        self.fixed = np.concatenate([self.driven, obstacle])
        self.free = np.setdiff1d(np.arange(2 * len(self.place)), self.fixed)

    def boundary(self, place):
        nodes = len(self.body.nodes)
        return np.asfortranarray(np.vstack([place[self.skin], place[nodes:]]))

    def collisions(self, place):
        found = ipctk.NormalCollisions()
        found.use_area_weighting = True
        found.collision_set_type = ipctk.NormalCollisions.IMPROVED_MAX_APPROX
        found.build(self.mesh, self.boundary(place), REACH_MM)
        return found

    def slip(self, place):
        """Motion of the boundary since the last step, which ipctk calls velocity."""
        return np.asfortranarray(self.boundary(place) - self.boundary(self.before))

    def energy(self, place):
        nodes = len(self.body.nodes)
        elastic = self.body.energy_and_force(place[:nodes] - self.body.nodes).energy
        barrier = self.potential(self.collisions(place), self.mesh, self.boundary(place))
        return elastic + barrier + self.dissipation(self.lagged, self.mesh, self.slip(place))

    def contact_force(self):
        """Forces (n + m, 2), N, of barrier and friction on all vertices."""
        gradient = self.potential.gradient(
            self.collisions(self.place), self.mesh, self.boundary(self.place)
        )
        return -(self.spread @ gradient).reshape(-1, 2) + self.friction_force()

    def friction_force(self):
        gradient = self.dissipation.gradient(self.lagged, self.mesh, self.slip(self.place))
        return -(self.spread @ gradient).reshape(-1, 2)

    def step_to(self, target):
        """Drive the fixed unknowns to ``target`` and bring the rest into balance with friction."""
        self.before = self.place.copy()
        for _ in range(LAGS if self.friction > 0 else 1):
            self.descend(target)
            if self.friction == 0:
                return
            earlier = self.friction_force()
            self.lagged = ipctk.TangentialCollisions()
            self.lagged.build(
                self.mesh,
                self.boundary(self.place),
                self.collisions(self.place),
                self.potential,
                self.friction,
            )
            change = np.abs(self.friction_force() - earlier).max()
            if change <= 2e-2 * self.reaction:
                return

    def descend(self, target, tolerance=1e-6):
        nodes = len(self.body.nodes)
        for _ in range(200):
            there = self.body.response(self.place[:nodes] - self.body.nodes, psd=True)
            found, boundary = self.collisions(self.place), self.boundary(self.place)
            gradient = self.potential.gradient(found, self.mesh, boundary)
            curvature = self.potential.hessian(
                found, self.mesh, boundary, ipctk.PSDProjectionMethod.CLAMP
            )
            slip = self.slip(self.place)
            gradient = gradient + self.dissipation.gradient(self.lagged, self.mesh, slip)
            curvature = curvature + self.dissipation.hessian(
                self.lagged, self.mesh, slip, ipctk.PSDProjectionMethod.CLAMP
            )
            size = 2 * len(self.place)
            elastic = sp.block_diag(
                [self.body.pattern.matrix(there.stiffness), sp.csr_matrix((size - 2 * nodes,) * 2)]
            )
            matrix = (elastic + self.spread @ curvature @ self.spread.T).tocsc()
            residual = self.spread @ gradient
            residual[: 2 * nodes] += there.force
            self.reaction = np.abs(residual[self.fixed]).max()
            left = target - self.place.ravel()[self.fixed]
            arrived = np.abs(left).max() < 1e-13
            if arrived and np.abs(residual[self.free]).max() < tolerance * self.reaction:
                return
            step = np.zeros(size)
            step[self.fixed] = left
            step[self.free] = spsolve(
                matrix[self.free][:, self.free],
                -residual[self.free] - matrix[self.free][:, self.fixed] @ left,
            )
            step = step.reshape(-1, 2)
            share = ipctk.compute_collision_free_stepsize(
                self.mesh, boundary, self.boundary(self.place + step)
            )
            share = 1.0 if share == 1.0 else 0.9 * share
            here = self.energy(self.place) if arrived else np.inf
            while not self.energy(self.place + share * step) <= here + 1e-13 or not np.isfinite(
                self.energy(self.place + share * step)
            ):
                share *= 0.5
                assert share > 1e-8
            self.place = self.place + share * step
        raise AssertionError("the barrier method did not converge")


@pytest.mark.slow
def test_lip_pressed_by_a_circle():
    system = lip_press(friction=FrictionLaw(0.0), normal=NormalLaw(50.0, 1e-5), points=4)
    pressed = followed(system, LIP_PRESS, increments=10, end_s=0.5)[-1]
    body = system.body
    circle = Outline.circle([10, 16], 4).sampled(0.02)
    start = circle + np.array([0, 0.001])
    engine = BarrierEngine(body, start, system.held, 0.05)
    zero = body.nodes.ravel()[system.held]
    for depth in np.linspace(0, 1.5, 16)[1:]:
        engine.step_to(np.concatenate([zero, (circle - np.array([0, depth])).ravel()]))
    force = engine.contact_force()[: len(body.nodes)]
    ours, theirs = -force_on_tissue(pressed)[1], -force[:, 1].sum()
    # The barrier holds the lip 1 µm off the circle and the penalty lets it 1 µm in.
    assert ours == pytest.approx(theirs, rel=0.005)
    points = pressed.contacts[0]
    x = system.contacts[0].surface.positions(pressed.state.displacement)[..., 0]
    touching = x[points.points.pressure > 0]
    pushed = engine.place[: len(body.nodes)][np.abs(force[:, 1]) > 1e-9, 0]
    spacing = 0.4
    assert touching.min() == pytest.approx(pushed.min(), abs=spacing)
    assert touching.max() == pytest.approx(pushed.max(), abs=spacing)
    difference = engine.place[: len(body.nodes)] - body.nodes - pressed.state.displacement
    assert np.abs(difference).max() < 0.005


@pytest.mark.slow
def test_lip_pressed_and_dragged_by_a_circle_with_friction():
    """Half the drag is partial slip, then all slides."""
    coefficient, depth, across = 0.4, 1.0, 1.2
    system = lip_press(
        30, 20, friction=FrictionLaw(coefficient, 50.0), normal=NormalLaw(50.0, 1e-5), points=4
    )
    way = path([0, 1, 2], [[0, 0], [0, -depth], [across, -depth]])
    ours = followed(system, way, increments=60)
    body = system.body
    circle = Outline.circle([10, 16], 4).sampled(0.02)
    # Only the lower part can touch; the rest is closed by a few long edges.
    circle = np.vstack([circle[circle[:, 1] < 14.5], [[12.6, 18], [7.4, 18]]])
    circle = circle[np.argsort(np.arctan2(circle[:, 1] - 16, circle[:, 0] - 10))]
    engine = BarrierEngine(
        body, circle + np.array([0, 0.001]), system.held, 0.05, friction=coefficient
    )
    zero = body.nodes.ravel()[system.held]
    theirs = {}
    for time in np.linspace(0, 2, 81)[1:]:
        engine.step_to(np.concatenate([zero, (circle + way.at(time).shift_mm).ravel()]))
        theirs[round(time, 3)] = engine.contact_force()[: len(body.nodes)].sum(axis=0)
    for time in (1.0, 1.2, 1.5, 2.0):
        commit = min(ours, key=lambda c: abs(c.state.time_s - time))
        here = force_on_tissue(commit)
        there = theirs[round(time, 3)]
        assert here[1] == pytest.approx(there[1], rel=0.02)
        assert here[0] == pytest.approx(there[0], abs=0.02 * abs(there[1]))
    force = engine.contact_force()[: len(body.nodes)]
    x = system.contacts[0].surface.positions(ours[-1].state.displacement)[..., 0]
    touching = x[ours[-1].contacts[0].points.pressure > 0]
    pushed = engine.place[: len(body.nodes)][np.abs(force[:, 1]) > 1e-9, 0]
    spacing = 20 / 30
    assert touching.min() == pytest.approx(pushed.min(), abs=spacing)
    assert touching.max() == pytest.approx(pushed.max(), abs=spacing)


@pytest.mark.slow
@pytest.mark.parametrize("coefficient", [0.0, 0.5])
def test_groove_that_closes_on_itself(coefficient):
    x = np.concatenate([np.linspace(0, 1.85, 11), np.linspace(2.15, 4, 11)])
    mesh = skfem.MeshQuad.init_tensor(x, np.linspace(0, 2, 13))
    middle = mesh.p[:, mesh.t].mean(axis=1)
    slot = (np.abs(middle[0] - 2) < 0.15) & (middle[1] > 0.7)
    mesh = mesh.remove_elements(np.flatnonzero(slot))
    mesh = mesh.with_boundaries(
        {"left": lambda p: p[0] < 1e-9, "right": lambda p: p[0] > 4 - 1e-9,
         "bottom": lambda p: p[1] < 1e-9}
    )  # fmt: skip
    outer = np.concatenate(list(mesh.boundaries.values()))
    skin = np.setdiff1d(mesh.boundary_facets(), outer)
    mesh = mesh.with_boundaries({**mesh.boundaries, "skin": skin})
    body = Body(mesh, linear_elastic(1.0, 0.3), plane=Plane.STRAIN, element="Q4")
    surface = body.surface("skin", points_per_edge=3)
    fold = SelfContact(
        (surface,),
        normal=NormalLaw(50.0, 1e-5),
        friction=FrictionLaw(coefficient, 50.0),
        reach_mm=0.25,
        same_surface=True,
        name="groove",
    )
    sides = [unknowns(body, "left", 0), unknowns(body, "right", 0)]
    lifted = [unknowns(body, "left", 1), unknowns(body, "right", 1)]
    below = np.setdiff1d(unknowns(body, "bottom", 1), np.concatenate(lifted))
    held = np.concatenate([*sides, *lifted, below])
    # Closed first, then sheared, left side up and right side down.
    closing = np.concatenate([np.full(len(sides[0]), 0.35), np.full(len(sides[1]), -0.35)])
    shearing = np.concatenate([np.full(len(lifted[0]), 0.25), np.full(len(lifted[1]), -0.25)])

    def reach(time):
        return np.concatenate(
            [min(time, 1.0) * closing, max(time - 1.0, 0.0) * shearing, np.zeros(len(below))]
        )

    system = loaded(body, contacts=(fold,), held=held, path=reach)
    end = 1.0 if coefficient == 0 else 2.0
    closed = followed(system, still(end), increments=int(28 * end))[-1]
    engine = BarrierEngine(
        body, np.array([[90.0, 0], [91, 0], [90, 1]]), held, 1.0, friction=coefficient
    )
    far = engine.obstacle.ravel()
    for time in np.linspace(0, end, int(28 * end) + 1)[1:]:
        engine.step_to(np.concatenate([body.nodes.ravel()[held] + reach(time), far]))
    force = engine.contact_force()[: len(body.nodes)]
    left = body.nodes[:, 0] < 2
    ours = np.zeros(body.nodes.size)
    np.add.at(ours, closed.contacts[0].dofs, closed.contacts[0].force)
    ours = ours.reshape(-1, 2)
    assert ours[left, 0].sum() == pytest.approx(force[left, 0].sum(), rel=0.02)
    assert ours[left, 1].sum() == pytest.approx(
        force[left, 1].sum(), abs=0.02 * abs(force[left, 0].sum())
    )
    if coefficient > 0:
        assert abs(ours[left, 1].sum()) > 0.1 * abs(ours[left, 0].sum())
    touched = [body.nodes[left & (np.abs(f[:, 0]) > 1e-6), 1] for f in (ours, force)]
    assert touched[0].min() == pytest.approx(touched[1].min(), abs=0.17)
    assert touched[0].max() == pytest.approx(touched[1].max(), abs=0.17)
    difference = engine.place[: len(body.nodes)] - body.nodes - closed.state.displacement
    assert np.abs(difference).max() < 0.005
