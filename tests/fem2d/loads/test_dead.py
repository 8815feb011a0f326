"""Dead loads: their work, their resultant, and equilibrium under them."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.amplitude import Amplitude, LoadError
from fem2d.loads.dead import DeadLoad
from fem2d.loads.load import Load
from fem2d.loads.tie import ElasticTie
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.linear import SuperLu
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.model import Model
from geometry2d.mesh import block_mesh
from geometry2d.rigid import RigidMotion
from tests.support.section_bodies import SOFT

HELD = Amplitude((0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 1.0, 0.0))
THICKNESS_MM = 1.5


def block() -> Body:
    return Body(
        block_mesh(6.0, 3.0, 12, 6),
        SOFT,
        plane=Plane.STRESS,
        element="Q8",
        thickness_mm=THICKNESS_MM,
    )


def dead(body: Body, **changed: object) -> DeadLoad:
    surface = body.surface("top")
    values = {"from_mm": 1.0, "to_mm": 5.0, "fade_mm": 1.0, "traction_mpa": (3e-4, -2e-4)}
    return DeadLoad(surface, **values | {"amplitude": HELD} | changed, name="load")


def test_the_force_is_less_the_derivative_of_the_energy_wherever_the_body_is():
    body = block()
    push = dead(body)
    rng = np.random.default_rng(3)
    here, direction = rng.normal(0, 0.3, (2, *body.nodes.shape))
    step = 1e-4
    now = Load(time_s=1.4)
    change = push.energy(here + step * direction, now) - push.energy(here - step * direction, now)
    work = float(np.sum(push.force(here, now) * direction.ravel()))
    assert abs(work) > 1e-5
    assert -change / (2 * step) == pytest.approx(work, rel=1e-8)


def test_the_resultant_is_traction_times_the_stretch_less_half_its_fades():
    body = block()
    push = dead(body)
    force = push.force(body.nodes, Load(time_s=1.5))
    area = THICKNESS_MM * (4.0 - 1.0)
    assert force.reshape(-1, 2).sum(axis=0) == pytest.approx(
        area * np.array([3e-4, -2e-4]), rel=2e-3
    )
    for time in (0.0, 9.0):
        assert np.abs(push.force(body.nodes, Load(time_s=time))).max() == 0.0


def test_the_amplitude_is_smooth_and_flat_at_its_instants():
    times = np.linspace(0.0, 3.0, 3001)
    factor = np.array([HELD.at(float(t)) for t in times])
    assert factor.min() == 0.0
    assert factor.max() == 1.0
    speed = np.gradient(factor, times)
    assert speed.max() == pytest.approx(1.875, rel=1e-4)
    assert abs(speed[[1, 1000, 2000, -2]]).max() < 1e-4


def test_a_loaded_block_comes_to_rest_and_goes_back_when_the_load_has_gone():
    body = block()
    bottom = body.surface("bottom")
    tie = ElasticTie(bottom, 1.0, name="bottom")
    push = dead(body)
    system = Model(body, ties=(tie,), inertia=Inertia(1e-9, 0.0, 0.005), loads=(push,))
    still = RigidMotion(np.array([0.0, 3.5]), np.zeros(2), np.zeros((2, 2)))
    commits = []
    result = march(
        system,
        still,
        system.at_rest(Load.at(still.at(0.0), 0.0), next_step_s=0.04),
        solver=SuperLu(),
        on_commit=commits.append,
    )
    assert result.status is MarchStatus.FINISHED
    commit = min(commits, key=lambda commit: abs(commit.state.time_s - 1.9))
    held, energies = commit.state, commit.energies
    reaction = (system.tie_stiffness @ held.displacement.ravel()).reshape(-1, 2).sum(axis=0)
    applied = system.load_force(held.displacement, Load(time_s=1.9)).reshape(-1, 2).sum(axis=0)
    assert reaction == pytest.approx(applied, rel=1e-4)
    assert np.abs(held.displacement).max() > 0.05
    assert np.abs(commits[-1].state.displacement).max() < 1e-4
    assert energies.load == pytest.approx(push.energy(held.displacement, held.load))
    assert energies.load < -energies.strain


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"fade_mm": 2.5}, "does not fit twice"),
        ({"from_mm": 20.0, "to_mm": 30.0}, "no point of the surface"),
    ],
)
def test_a_load_that_makes_no_sense_is_refused(changed, what):
    with pytest.raises(LoadError, match=what):
        dead(block(), **changed)


def test_an_amplitude_that_makes_no_sense_is_refused():
    with pytest.raises(LoadError, match="one factor for each instant"):
        Amplitude((0.0, 1.0), (0.0,))
    with pytest.raises(LoadError, match="must increase"):
        Amplitude((0.0, 0.0), (0.0, 1.0))
