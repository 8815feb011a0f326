"""The problems on which prototypes stopped, on coarse meshes; benchmarks/ has the fine ones."""

import numpy as np
import pytest

from fem2d.solvers.march import MarchStatus
from tests.support.prototype_problems import (
    Case,
    force_on_tissue,
    model,
    penetration_mm,
    run,
)


def test_pressed_and_dragged_block():
    result, commits = run(Case("A", 0.6))
    assert result.status is MarchStatus.FINISHED
    # The first touch, a tenth of a millimetre deep in one step, may be taken in two.
    assert result.increments <= 92
    assert result.cutbacks <= 1
    # The penalty's law, of the pressure at this mesh.
    assert penetration_mm(commits) < 0.02
    # Pressed down, the block pushes up; dragged along +x, it is pulled there.
    down, dragged = force_on_tissue(commits[44]), force_on_tissue(commits[-1])
    assert down[1] < -0.1
    assert dragged[0] > 0.2 * abs(dragged[1])


@pytest.fixture(scope="module")
def snapped():
    """Both ways of pulling the lip, rejected trials counted too."""
    cases = [Case("B", 0.6, backwards=backwards) for backwards in (False, True)]
    return [(case, *run(case)) for case in cases]


@pytest.mark.slow
def test_lip_that_snaps_back(snapped):
    for case, result, commits in snapped:
        assert result.status is MarchStatus.FINISHED
        system, _ = model(case)
        top = np.argmax(system.body.nodes[:, 1])
        way = np.array([abs(c.state.displacement[top, 0]) for c in commits])
        # It was carried along, let go within a fifth of a second, and came to rest where it began.
        assert way.max() > 1.0
        time = np.array([c.state.time_s for c in commits])
        assert np.linalg.norm(commits[-1].state.displacement, axis=1).max() < 0.05
        assert np.all(force_on_tissue(commits[-1]) == 0)
        left = time[np.flatnonzero(way > 0.5)[-1]]
        assert way[np.searchsorted(time, left + 0.2)] < 0.25


@pytest.mark.slow
def test_newton_iterations_an_increment_are_no_more_than_febios(snapped):
    """FEBio needs 7.6 on its test of two blocks with friction 0.99."""
    iterations = sum(result.iterations for _, result, _ in snapped)
    assert iterations <= 7.6 * sum(result.increments for _, result, _ in snapped)
