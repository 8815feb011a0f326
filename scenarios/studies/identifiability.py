"""How well a curve constrains the parameters that were fitted to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from scenarios.studies.curve_gradient import Evaluation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Identifiability:
    """How well a curve constrains parameters.

    Attributes
    ----------
    sensitivity_mm
        (p,) RMS change of the curve for a change of the parameter by one percent, mm.
    relative_error
        (p,) standard error of the logarithms: 0.1 is about 10 %.
    interval
        (p, 2) confidence interval of the parameters.
    correlation
        (p, p) of the estimates.
    softest_direction
        (p,) the combination of logarithms that the curve constrains least.
    condition
        Ratio of the largest to the smallest singular value of the Jacobian by logarithms.
    """

    sensitivity_mm: Array
    relative_error: Array
    interval: Array
    correlation: Array
    softest_direction: Array
    condition: float


def identifiability(evaluation: Evaluation, apex_mm: Array, confidence: float) -> Identifiability:
    """Return what the linearised fit says of its parameters (Seber and Wild 1989, section 2.1.2).

    Parameters
    ----------
    evaluation
        Curve and gradient at the optimum.
    apex_mm
        (k,) the target; the residuals estimate its error.
    confidence
        Of the intervals.
    """
    gradient = evaluation.gradient
    points, count = gradient.shape
    freedom = max(points - count, 1)
    variance = float(np.sum((evaluation.apex_mm - apex_mm) ** 2)) / freedom
    _, singular, directions = np.linalg.svd(gradient, full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).eps * singular[0])
    shape = directions.T / singular**2 @ directions
    spread = np.sqrt(np.diag(shape))
    error = np.sqrt(variance) * spread
    half = float(stdtrit(freedom, 0.5 * (1 + confidence))) * error
    with np.errstate(over="ignore"):
        interval = np.exp(evaluation.logarithms[:, None] + half[:, None] * np.array([-1.0, 1.0]))
    return Identifiability(
        0.01 * np.sqrt(np.mean(gradient**2, axis=0)),
        error,
        interval,
        shape / np.outer(spread, spread),
        directions[-1],
        float(singular[0] / singular[-1]),
    )
