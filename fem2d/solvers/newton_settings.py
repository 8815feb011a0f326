"""When Newton's method has converged, when it gives up, and how it shortens its steps."""

from __future__ import annotations

from dataclasses import dataclass

from geometry2d.foundation.settings import setting


@dataclass(frozen=True)
class NewtonSettings:
    """Tolerances and limits of Newton's method, and numbers of its line search.

    Parameters
    ----------
    tolerance
        Largest unbalanced nodal force, relative to the largest nodal force that acts.
    force_floor_n
        Force to which the tolerance refers if no larger nodal force acts, N.
    iterations
        Largest number of iterations.
    patience
        Iterations in which the unbalanced forces must halve; else the solve has stalled.
    step_residual
        Residual of the linear system of a step, relative to its largest force: far below the
        nonlinear residual, and mostly reached in single precision without refinement.
    predictor_residual
        The same for the predictor. No later step corrects it: points that it brings into contact
        stick from there on.
    good_step, fair_step
        A step is taken whole if it leaves at most this share of the unbalanced forces:
        ``good_step`` if it leads downhill, ``fair_step`` if it leads uphill.
    damping
        Share of a step that is taken once the forces no longer decrease.
    search_trials
        Largest number of evaluations along one step: each costs a third of a new step.
    search_work
        The line search ends where the work of the residual is at most this share of its start.
    search_retreat
        Share of the distance to the nearest inadmissible trial that is tried next.
    search_margin
        Distance of the next trial from the ends of the bracket, over its length.
    """

    tolerance: float = setting(
        default=1e-6,
        above=0.0,
        maximum=0.1,
        description="largest unbalanced nodal force over the largest nodal force that acts",
    )
    force_floor_n: float = setting(
        default=1e-6,
        unit="N",
        above=0.0,
        description="nodal force below which nothing is considered to act",
    )
    iterations: int = setting(
        default=25, minimum=1, maximum=1000, description="largest number of iterations in a step"
    )
    patience: int = setting(
        default=8,
        minimum=1,
        maximum=1000,
        description="iterations within which the unbalanced forces must halve",
    )
    step_residual: float = setting(
        default=1e-5,
        above=0.0,
        maximum=0.1,
        description="forces that the linear system of a step may leave, over the largest",
    )
    predictor_residual: float = setting(
        default=1e-9,
        above=0.0,
        maximum=0.1,
        description="forces that the linear system of the predictor may leave, over the largest",
    )
    good_step: float = setting(
        default=0.5,
        above=0.0,
        maximum=1.0,
        description="a step that leaves no larger share of the unbalanced forces is taken whole",
    )
    fair_step: float = setting(
        default=0.9,
        above=0.0,
        maximum=1.0,
        description="the same for a step along which the forces do positive work",
    )
    damping: float = setting(
        default=0.5,
        above=0.0,
        maximum=1.0,
        description="share of a step that is taken once the forces no longer decrease",
    )
    search_trials: int = setting(
        default=7, minimum=1, maximum=100, description="largest number of trials along a step"
    )
    search_work: float = setting(
        default=0.7,
        above=0.0,
        maximum=1.0,
        description="work of the residual at which a line search ends, over that at its start",
    )
    search_retreat: float = setting(
        default=0.3,
        above=0.0,
        maximum=1.0,
        description="share of the distance to an inadmissible trial that is tried next",
    )
    search_margin: float = setting(
        default=0.1,
        above=0.0,
        maximum=0.5,
        description="distance of the next trial from the ends of the bracket, over its length",
    )
