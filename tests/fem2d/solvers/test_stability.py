"""Recognising unstable equilibria: what counts as one, and how times and places are kept."""

import numpy as np
import pytest
import scipy.sparse as sp
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load
from fem2d.loads.tie import ElasticTie
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.linear import fastest_solver, negative_pivots
from fem2d.solvers.march import march
from fem2d.solvers.model import Model
from fem2d.solvers.stability import Instability, instability_of, passages_with
from fem2d.solvers.step_control import StepSettings
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion


def dragged(friction):
    """A block on bone, pressed by a circle and dragged until everything slides."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 20, 21), np.linspace(0, 8, 9))
    mesh = mesh.with_boundaries(
        {"top": lambda p: np.isclose(p[1], 8), "bottom": lambda p: np.isclose(p[1], 0)}
    )
    body = Body(mesh, NeoHookean(0.01, poisson=0.4), plane=Plane.STRAIN, element="Q4")
    top, bottom = (body.surface(side) for side in ("top", "bottom"))
    pair = RigidContact(
        top,
        Outline.circle([10, 14], 6),
        normal=NormalLaw(),
        friction=FrictionLaw(friction),
        name="circle",
    )
    system = Model(body, contacts=(pair,), ties=(ElasticTie(bottom, 1.0, name="bottom"),))
    times = np.linspace(0, 2, 41)
    shift = np.column_stack([np.interp(times, [1, 2], [0, 3]), np.interp(times, [0, 1], [0, -1])])
    motion = RigidMotion(times, 0 * times, shift)
    commits = []
    march(
        system, motion, system.at_rest(Load.at(motion.at(0.0), 0.0), next_step_s=0.05),
        solver=fastest_solver(),
        steps=StepSettings(longest_s=0.1, accuracy_mm=np.inf, watch_stability=True),
        on_commit=commits.append,
    )  # fmt: skip
    return system, commits


def exact_tangent(model, commit):
    """The derivative of the forces without inertia, sliding friction and all."""
    here = commit.state.displacement
    body = model.body.response(here).stiffness
    return model._stiffness(body, commit.contacts, here, commit.state.load)


@pytest.fixture(scope="module")
def sliding():
    return dragged(1.0)


def test_friction_that_slides_is_no_instability_of_the_tissue(sliding):
    """The symmetric part of the exact tangent is indefinite there, the tissue perfectly stable."""
    system, commits = sliding
    last = commits[-1]
    points = last.contacts[0].points
    assert np.all(points.slipping[points.pressure > 0])
    exact = exact_tangent(system, last)
    assert negative_pivots((0.5 * (exact + exact.T)).tocsr()) > 0
    assert all(commit.instability is None for commit in commits)


def test_without_sliding_the_tangent_of_stability_is_the_tangent():
    system, commits = dragged(0.0)
    last = commits[-1]
    exact = exact_tangent(system, last)
    held = system.static_tangent(last.state, last.contacts)
    assert abs(exact - held).max() < 1e-12 * abs(exact).max()


def test_pivots_are_counted_right_when_pattern_and_values_change():
    rng = np.random.default_rng(5)
    for size, negative in ((30, 0), (30, 3), (41, 1), (30, 7)):
        basis, _ = np.linalg.qr(rng.normal(size=(size, size)))
        values = rng.uniform(0.5, 2.0, size)
        values[:negative] *= -1
        assert negative_pivots(sp.csr_matrix((basis * values) @ basis.T)) == negative


def test_an_instability_says_how_many_ways_and_where():
    diagonal = np.ones(12)
    diagonal[[6, 7, 9]] = -0.51, -2.03, -1.07
    positions = np.column_stack([np.arange(6.0), np.zeros(6)])
    found = instability_of(sp.csr_matrix(np.diag(diagonal)), positions)
    assert found == Instability(3, (3.0, 0.0), 3, pytest.approx(1.0))
    assert instability_of(sp.csr_matrix(np.eye(12)), positions) is None


def passages_of(times, seen):
    passages = ()
    for before, time, instability in zip(times, times[1:], seen, strict=False):
        passages = passages_with(passages, before, time, instability)
    return passages


def test_consecutive_unstable_instants_make_one_passage():
    weak, strong = Instability(1, (0.0, 0.0), 1, 2.0), Instability(2, (5.0, 0.0), 4, 2.0)
    times = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    found = passages_of(times, [weak, strong, None, None, weak, weak])
    assert [(p.start_s, p.end_s, p.worst) for p in found] == [
        (0.1, 0.2, strong),
        (0.5, 0.6, weak),
    ]


def test_a_stable_instant_between_unstable_ones_does_not_end_a_passage():
    weak, strong = Instability(1, (0.0, 0.0), 1, 2.0), Instability(2, (5.0, 0.0), 4, 2.0)
    times = np.linspace(0, 0.8, 9)
    (one,) = passages_of(times, [None, weak, None, strong, None, weak, None, None])
    assert (one.start_s, one.end_s, one.worst) == (times[2], times[6], strong)


def test_what_was_stable_for_longer_than_the_last_increment_ends_a_passage():
    weak = Instability(1, (0.0, 0.0), 1, 2.0)
    after_long = passages_of([0.0, 0.1, 0.4, 0.5], [weak, None, weak])
    assert [(p.start_s, p.end_s) for p in after_long] == [(0.1, 0.1), (0.5, 0.5)]
    after_short = passages_of([0.0, 0.1, 0.15, 0.25], [weak, None, weak])
    assert [(p.start_s, p.end_s) for p in after_short] == [(0.1, 0.25)]
