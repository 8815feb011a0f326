"""Skin on its bulk, compressed: wrinkles where linear stability says; folds do not overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import skfem

from fem2d.analyses.wrinkling import Layer, wrinkling
from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.self_contact import self_responses
from fem2d.loads.load import Load
from fem2d.materials.library import configuration
from fem2d.solvers.commit import Commit
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import MarchResult, MarchStatus, march
from fem2d.solvers.stability import Instability, softest_mode
from fem2d.solvers.step_control import StepSettings
from geometry2d.rigid import RigidMotion
from tests.support.squeezed_block import squeezed

pytestmark = pytest.mark.slow

WIDTH, HEIGHT, DERMIS = 40.0, 12.0, 1.2
SHORTENING = 0.3


@dataclass(frozen=True)
class Path:
    """What was seen on the way: strain and state of the first instability, and the end."""

    strain: float
    instability: Instability
    waves: int
    result: MarchResult
    least_gap: float
    least_volume_ratio: float


def block() -> Body:
    y = np.concatenate(
        [np.linspace(0, HEIGHT - DERMIS, 10), np.linspace(HEIGHT - DERMIS, HEIGHT, 4)[1:]]
    )
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, WIDTH, 61), y)
    mesh = mesh.with_boundaries(
        {
            "top": lambda x: np.isclose(x[1], HEIGHT),
            "bottom": lambda x: np.isclose(x[1], 0),
            "left": lambda x: np.isclose(x[0], 0),
            "right": lambda x: np.isclose(x[0], WIDTH),
        }
    ).with_subdomains(
        {"dermis": lambda x: x[1] > HEIGHT - DERMIS, "bulk": lambda x: x[1] < HEIGHT - DERMIS}
    )
    return Body(mesh, configuration("L2-Ogden"), plane=Plane.STRESS)


@pytest.fixture(scope="module")
def path() -> Path:
    body = block()
    times = np.linspace(0, 30, 61)
    motion = RigidMotion(
        times, 0 * times, np.column_stack([-SHORTENING * WIDTH * times / 30, 0 * times])
    )
    system = squeezed(body, motion, WIDTH, roller_mpa_per_mm=5.0, friction=0.3)
    top = np.unique(body.edges("top"))
    top = top[np.argsort(body.nodes[top, 0])]
    seen: list[tuple[float, Instability, int]] = []
    gaps, ratios = [0.0], [1.0]

    def watch(commit: Commit) -> None:
        displacement = commit.state.displacement
        if commit.instability is not None and not seen:
            tangent = system.static_tangent(commit.state, commit.contacts)
            mode = softest_mode((0.5 * (tangent + tangent.T)).tocsr()).reshape(-1, 2)
            spectrum = np.abs(np.fft.rfft(np.concatenate([mode[top, 1], mode[top[::-1], 1]])))
            # Mirrored once, half waves of the block are whole waves of the spectrum.
            seen.append(
                (
                    -commit.state.placement.shift_mm[0] / WIDTH,
                    commit.instability,
                    int(np.argmax(spectrum[1:])) + 1,
                )
            )
        folds = [touch.points.gap for touch in self_responses(commit.contacts)]
        gaps.extend(float(gap.min()) for gap in folds if gap.size)
        ratios.append(float(np.linalg.det(body.fields(displacement).deformation_gradient).min()))

    result = march(
        system,
        motion,
        system.at_rest(Load.at(motion.at(0.0), 0.0), next_step_s=0.1),
        solver=fastest_solver(),
        steps=StepSettings(longest_s=1.0, travel_mm=0.2, accuracy_mm=np.inf, watch_stability=True),
        on_commit=watch,
    )
    return Path(*seen[0], result, min(gaps), min(ratios))


def test_onset_and_wavelength_are_those_of_linear_stability(path: Path):
    laws = configuration("L2-Ogden")
    expected = wrinkling(
        [Layer(laws["dermis"], DERMIS), Layer(laws["bulk"], HEIGHT - DERMIS)], plane=Plane.STRESS
    )
    assert path.strain == pytest.approx(expected.strain, rel=0.10)
    assert 2 * WIDTH / path.waves == pytest.approx(expected.wavelength_mm, rel=0.10)


def test_the_surface_is_named_as_the_place(path: Path):
    assert path.instability.modes >= 1
    assert path.instability.place_mm[1] > HEIGHT


def test_compression_is_followed_to_thirty_percent_without_overlap(path: Path):
    assert path.result.status is MarchStatus.FINISHED
    assert path.least_gap > -0.01
    assert path.least_volume_ratio > 0.3
