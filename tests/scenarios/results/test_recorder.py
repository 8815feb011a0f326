"""Checkpoints of the solver, and what a recorder keeps of a run."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from fem2d.body.overstress import Overstress
from fem2d.contact.rigid import RigidContactState
from fem2d.contact.self_contact_points import SelfContactState
from fem2d.loads.load import Load
from fem2d.solvers.stability import Instability, Passage
from fem2d.solvers.state import State
from geometry2d.rigid import RigidPlacement
from scenarios.results.increment import SolutionError
from scenarios.results.recorder import checkpoint, restored
from scenarios.results.summary import Extremes, passages_as_array, passages_from_array

RNG = np.random.default_rng(5)


def state(*, viscous: bool = False) -> State:
    """A state with two rigid contacts and one self-contact, no two numbers of it the same."""
    rigid = tuple(
        RigidContactState(RNG.normal(size=(3, 2, 2)), RNG.normal(size=(3, 2))) for _ in range(2)
    )
    lips = SelfContactState(**{f.name: RNG.normal(size=4) for f in fields(SelfContactState)})
    u, v, a = RNG.normal(size=(3, 5, 2))
    load = Load.at(RigidPlacement(0.1, (2.0, 3.0)), 1.25)
    overstress = Overstress(RNG.normal(size=(2, 3, 4)), RNG.normal(size=(2, 2, 3, 4)))
    return State(load, u, v, a, (*rigid, lips), 0.04, overstress if viscous else None)


@pytest.mark.parametrize("viscous", [False, True])
def test_a_state_comes_back_from_its_checkpoint_bit_for_bit(viscous: bool) -> None:
    kept, other = state(viscous=viscous), state(viscous=viscous)
    back = restored(checkpoint(kept), kept.time_s, like=other)
    assert (back.time_s, back.placement, back.next_step_s) == (1.25, kept.placement, 0.04)
    arrays, again = checkpoint(kept), checkpoint(back)
    assert len(arrays) == 5 + 2 * 2 + len(fields(SelfContactState)) + 2 * viscous
    assert arrays.keys() == again.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)


def test_a_checkpoint_of_another_version_is_refused() -> None:
    kept = state()
    arrays = checkpoint(kept)
    lost = next(name for name in arrays if name.startswith("contact_1"))
    del arrays[lost]
    with pytest.raises(SolutionError, match=f"lacks '{lost}': another version wrote it"):
        restored(arrays, 1.25, like=kept)


def test_extremes_only_grow_and_survive_a_checkpoint() -> None:
    first = Extremes(largest_penetration_neck_mm=0.2, largest_strain_energy_nmm=1.0)
    second = Extremes(largest_penetration_neck_mm=0.1, largest_strain_energy_nmm=3.0)
    both = first.widened(second)
    assert both == replace(first, largest_strain_energy_nmm=3.0)
    assert both == second.widened(first)
    assert Extremes.from_array(both.as_array()) == both


def test_extremes_of_another_version_are_refused() -> None:
    with pytest.raises(SolutionError, match="holds 3 extremes, not"):
        Extremes.from_array(np.zeros(3))


def test_passages_survive_a_checkpoint() -> None:
    passages = (
        Passage(1.0, 1.2, Instability(2, (3.0, -4.0), 17, 5.5)),
        Passage(2.0, 2.0, Instability(1, (0.1, 0.2), 3, 1.0)),
    )
    assert passages_from_array(passages_as_array(passages)) == passages
    assert passages_from_array(passages_as_array(())) == ()
