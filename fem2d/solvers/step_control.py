"""Length of the steps of a march, and criteria by which a trial is accepted."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fem2d.contact.contact import ContactResponse
from fem2d.contact.rigid import rigid_responses
from fem2d.loads.load import Loading
from fem2d.solvers.model import ModelBalance
from fem2d.solvers.newton import NewtonResult
from fem2d.solvers.state import State
from geometry2d.foundation.settings import setting
from geometry2d.rigid import RigidPlacement

TINY_MM = 1e-12
"""Travels and errors below this limit no step; it guards divisions."""


@dataclass(frozen=True)
class StepSettings:
    """Length of steps, and criteria by which a trial is accepted.

    Parameters
    ----------
    longest_s, shortest_s
        Bounds of a step, s; the march ends if it needs a shorter one.
    travel_mm
        Largest motion of the rigid body in one step past a nearby point of the tissue, mm.
    gap_share
        Share of a wide gap that it may cross in one step, if that is more.
    accuracy_mm
        Predictor error, the largest distance between predicted and final position of a node, at
        which the step length aims, mm. Friction depends on the path, and this error measures its
        curvature.
    snap_s, snap_errors
        A step longer than ``snap_s`` with a predictor error above ``snap_errors`` times
        ``accuracy_mm`` is rejected. A snap, as of a lip off an edge, is resolved that way.
    easy_iterations, hard_iterations
        A step with at most (at least) so many iterations is followed by a longer (shorter) one.
    shorter, longer
        Length of the step after a hard and after an easy one, over that one's.
    least_growth
        Least length of a step, over that of the accepted one before it.
    cutback
        Length of a step after a rejected one, over that one's.
    penetration_growth_mm
        A trial in which the deepest penetration of a rigid body grows by more than this is
        rejected although its forces balance, mm: a lip that snaps can end astride a thin wall,
        whose two sides then hold it. Pressure alone adds far less in one step.
    leap_share
        A step is rejected in which a body in a hand moves farther than its allowed travel over this
        share.
    watch_stability
        Whether committed states are tested for static stability.
    stability_every_s
        Time between such tests, s; with 0 every committed state is tested. Which ones are depends
        on their times alone, so that a resumed march tests the same.
    """

    longest_s: float = setting(default=0.08, unit="s", above=0.0, description="longest step")
    shortest_s: float = setting(
        default=1e-7,
        unit="s",
        above=0.0,
        description="shortest step; the run stops if a shorter one is needed",
    )
    travel_mm: float = setting(
        default=0.3,
        unit="mm",
        above=0.0,
        description="largest motion of the rigid body past nearby tissue in one step",
    )
    gap_share: float = setting(
        default=0.7,
        above=0.0,
        maximum=1.0,
        description="share of a wide gap that the rigid body may cross in one step",
    )
    accuracy_mm: float = setting(
        default=0.008,
        unit="mm",
        above=0.0,
        description="error of the predictor that the length of steps aims at",
    )
    snap_s: float = setting(
        default=0.004,
        unit="s",
        above=0.0,
        description="a longer step with a predictor error of snap_errors times accuracy_mm is "
        "rejected",
    )
    snap_errors: float = setting(
        default=10.0,
        above=0.0,
        description="predictor error, over accuracy_mm, from which a step counts as a snap",
    )
    easy_iterations: int = setting(
        default=7, minimum=1, description="a step with at most so many is followed by a longer one"
    )
    hard_iterations: int = setting(
        default=14,
        minimum=1,
        description="a step with at least so many is followed by a shorter one",
    )
    shorter: float = setting(
        default=0.8,
        above=0.0,
        maximum=1.0,
        description="length of the step after a hard one, over that one's",
    )
    longer: float = setting(
        default=1.5,
        minimum=1.0,
        description="length of the step after an easy one, over that one's",
    )
    least_growth: float = setting(
        default=0.6,
        above=0.0,
        maximum=1.0,
        description="least length of a step over that of an accepted one before it",
    )
    cutback: float = setting(
        default=0.5,
        above=0.0,
        maximum=0.99,
        description="length of a step after a rejected one, over that one's",
    )
    penetration_growth_mm: float = setting(
        default=0.1,
        unit="mm",
        above=0.0,
        description="a step in which the deepest penetration grows by more is rejected",
    )
    leap_share: float = setting(
        default=0.5,
        above=0.0,
        maximum=1.0,
        description="a step is rejected if the allowed travel of a body in a hand is a smaller "
        "share of its motion",
    )
    watch_stability: bool = setting(
        default=False, description="whether the stability of committed states is tested"
    )
    stability_every_s: float = setting(
        default=0.0,
        unit="s",
        minimum=0.0,
        description="time between tests of stability; 0: after every step",
    )

    def tests_stability(self, before_s: float, time_s: float) -> bool:
        """Return whether the state committed at a time is tested, s, after one before it.

        >>> every = StepSettings(watch_stability=True, stability_every_s=0.5)
        >>> [every.tests_stability(*times) for times in ((0.9, 1.0), (1.0, 1.4), (1.4, 1.6))]
        [True, False, True]
        """
        every = self.stability_every_s
        due = every == 0.0 or math.floor(time_s / every) > math.floor(before_s / every)
        return self.watch_stability and due


def proposed_duration(
    steps: StepSettings,
    loading: Loading,
    state: State,
    contacts: tuple[ContactResponse, ...],
    at_most_s: float,
) -> float:
    """Return the duration of the next step, s, as the travel of moving bodies allows.

    Parameters
    ----------
    steps
        Settings of the steps.
    loading
        The load against time.
    state, contacts
        The committed state, and the response of each contact in it.
    at_most_s
        Bound of the step, s.
    """
    ahead = loading(state.time_s + steps.longest_s).placement
    share = _allowed_share(steps, contacts, state.placement, ahead)
    return min(at_most_s, steps.longest_s * share)


def is_sound(
    steps: StepSettings,
    trial: NewtonResult,
    balance: ModelBalance,
    contacts: tuple[ContactResponse, ...],
    *,
    carried: bool,
) -> bool:
    """Whether a trial is accepted.

    Newton's method has converged, penetration has not grown by more than pressure explains, and the
    predictor error is not that of a snap in a long step.

    Parameters
    ----------
    steps
        Settings of the steps.
    trial, balance
        Result of Newton's method, and the balance there.
    contacts
        Response of each contact in the committed state.
    carried
        Whether a hand carries the moving bodies; their motion is then not known in advance.
    """
    if not trial.converged or balance.duration_s is None:
        return False
    if _deepest(balance.contacts) - _deepest(contacts) > steps.penetration_growth_mm:
        return False
    here, there = balance.before.placement, balance.load.placement
    if carried and not may_travel(steps, contacts, here, there):
        return False
    snapped = trial.predictor_error_mm > steps.snap_errors * steps.accuracy_mm
    return not (snapped and balance.duration_s > steps.snap_s)


def growth(steps: StepSettings, trial: NewtonResult, rejected: int) -> float:
    """Return the length of the next step over that of a step accepted after some rejected ones."""
    if rejected > 0 or trial.iterations >= steps.hard_iterations:
        usual = steps.shorter
    else:
        usual = steps.longer if trial.iterations <= steps.easy_iterations else 1.0
    accurate = math.sqrt(steps.accuracy_mm / max(trial.predictor_error_mm, TINY_MM))
    return max(steps.least_growth, min(usual, accurate))


def may_travel(
    steps: StepSettings,
    contacts: tuple[ContactResponse, ...],
    here: RigidPlacement,
    there: RigidPlacement,
) -> bool:
    """Whether bodies in a hand may move in one step from one placement to another.

    ``contacts`` are the responses in the committed state.
    """
    return _allowed_share(steps, contacts, here, there) >= steps.leap_share


def _allowed_share(
    steps: StepSettings,
    contacts: tuple[ContactResponse, ...],
    here: RigidPlacement,
    there: RigidPlacement,
) -> float:
    """Return the share of their motion that moving bodies may travel in one step."""
    share = np.inf
    for touch in rigid_responses(contacts):
        if touch.contact.moving:
            nodal = touch.contact.surface.nodal
            point = nodal(touch.state.body_position)
            travel = np.linalg.norm(there.apply(point) - here.apply(point), axis=-1)
            allowed = np.maximum(steps.travel_mm, steps.gap_share * nodal(touch.points.gap))
            share = min(share, float(np.min(allowed / np.maximum(travel, TINY_MM))))
    return share


def _deepest(contacts: tuple[ContactResponse, ...]) -> float:
    """Return the deepest penetration of a rigid body, mm; 0 if there is none."""
    return max([0.0, *(-float(np.min(t.points.gap)) for t in rigid_responses(contacts))])
