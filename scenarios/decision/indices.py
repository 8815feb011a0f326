"""How much of what is felt comes from which varied setting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from scenarios.campaign.sip import WHOLE
from scenarios.campaign.table import Row
from scenarios.decision.comparison import CONFIDENCE, paired, varied_columns

Array = NDArray[np.float64]

FEWEST_SAMPLES = 8
RESAMPLES = 1000
"""Of the bootstrap."""

LOW, HIGH = 0.1, 0.9
"""Quantiles of a setting between which an effect is stated."""


@dataclass(frozen=True)
class Effect:
    """How much a measure changes when a setting goes from one value to another.

    Attributes
    ----------
    setting
        Its name.
    from_value, to_value
        Between which values.
    change
        Of the measure.
    interval
        Where the change lies, with the confidence of all intervals.
    """

    setting: str
    from_value: float | str
    to_value: float | str
    change: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class SobolIndices:
    """Shares of the variance of a measure.

    Attributes
    ----------
    settings
        Names (k,).
    first, total
        (k,) share that a setting causes alone, and with all others together.
    first_interval, total_interval
        (k, 2) of them.
    samples
        How many samples are behind them.
    """

    settings: tuple[str, ...]
    first: Array
    total: Array
    first_interval: Array
    total_interval: Array
    samples: int


def effects(rows: Sequence[Row], measure: str) -> list[Effect]:
    """Return the effects of varied settings on a measure, the largest first.

    In a grid the ends of each setting are compared, all else being the same; among samples a linear
    fit says what a setting does between its `LOW` and `HIGH` quantiles.
    """
    names = varied_columns(rows)
    sampled = any("sample" in row for row in rows)
    found = _slopes(rows, names, measure) if sampled else _ends(rows, names, measure)
    return sorted(found, key=lambda effect: -abs(effect.change))


def _ends(rows: Sequence[Row], names: Sequence[str], measure: str) -> list[Effect]:
    found = []
    for name in names:
        levels = list(dict.fromkeys(row[name] for row in rows))
        if all(isinstance(level, int | float) for level in levels):
            levels.sort()
        if len(levels) < 2:
            continue
        low, high = levels[0], levels[-1]
        try:
            pair = paired(rows, name, high, low, measure)
        except ValueError:
            continue
        found.append(Effect(name, low, high, pair.mean, pair.interval))
    return found


def _slopes(rows: Sequence[Row], names: Sequence[str], measure: str) -> list[Effect]:
    """Return effects by least squares, one mean for each neck and person."""
    numeric = [n for n in names if all(isinstance(row[n], int | float) for row in rows)]
    whole = [row for row in rows if row["status"] == WHOLE]
    groups = sorted({(str(row.get("neck")), str(row.get("person"))) for row in whole})
    freedom = len(whole) - len(groups) - len(numeric)
    if freedom < 1 or not numeric:
        return []
    values = np.array([[float(row[name]) for name in numeric] for row in whole])
    mean, scale = values.mean(axis=0), values.std(axis=0)
    own = np.array(
        [[(str(r.get("neck")), str(r.get("person"))) == g for g in groups] for r in whole], float
    )
    table = np.hstack([(values - mean) / scale, own])
    measured = np.array([float(row[measure]) for row in whole])
    fit, *_ = np.linalg.lstsq(table, measured, rcond=None)
    variance = float(np.sum((measured - table @ fit) ** 2)) / freedom
    errors = np.sqrt(variance * np.diag(np.linalg.pinv(table.T @ table)))
    wide = float(t.ppf(0.5 * (1 + CONFIDENCE), freedom))
    found = []
    for k, name in enumerate(numeric):
        low, high = np.quantile(values[:, k], [LOW, HIGH])
        factor = (high - low) / scale[k]
        change, half = fit[k] * factor, wide * errors[k] * factor
        found.append(
            Effect(name, float(low), float(high), float(change), (change - half, change + half))
        )
    return found


def indices(rows: Sequence[Row], measure: str, *, seed: int = 0) -> SobolIndices | None:
    """Return Sobol' indices of a measure; None if the study was not designed for them.

    The measure is averaged over necks, people and draws. Samples with a sip that failed are left
    out. Intervals are bootstrapped.

    Parameters
    ----------
    rows
        Of a study's table, with the columns ``sample`` and ``matrix``.
    measure
        A column of numbers.
    seed
        Of the bootstrap.
    """
    names = varied_columns(rows)
    if not any(row.get("matrix") for row in rows):
        return None
    values: dict[tuple[str, int], list[float]] = {}
    for row in rows:
        good = row["status"] == WHOLE and row.get(measure) is not None
        number = float(row[measure]) if good else np.nan
        values.setdefault((str(row["matrix"]), int(row["sample"])), []).append(number)
    samples = sorted({sample for _, sample in values})
    wanted = ("A", "B", *names)
    table = np.array(
        [[np.mean(values.get((matrix, s), [np.nan])) for s in samples] for matrix in wanted]
    )
    table = table[:, np.isfinite(table).all(axis=0)]
    if table.shape[1] < FEWEST_SAMPLES or np.ptp(table) == 0:
        return None
    first, total = _estimated(table)
    random = np.random.default_rng(seed)
    again = np.array(
        [
            _estimated(table[:, random.integers(0, table.shape[1], table.shape[1])])
            for _ in range(RESAMPLES)
        ]
    )
    tail = 0.5 * (1 - CONFIDENCE)
    low, high = np.quantile(again, [tail, 1 - tail], axis=0)
    return SobolIndices(
        tuple(names),
        first,
        total,
        np.column_stack([low[0], high[0]]),
        np.column_stack([low[1], high[1]]),
        table.shape[1],
    )


def _estimated(table: Array) -> tuple[Array, Array]:
    """Return first and total indices (k,) from the outputs (2 + k, n) at A, B and mixtures.

    The estimators of Saltelli et al. 2010. SciPy's function of them needs a power of two, and sips
    fail.
    """
    centred = table - table[:2].mean()
    a, b, mixed = centred[0], centred[1], centred[2:]
    variance = float(np.var(centred[:2]))
    if variance == 0.0:
        return np.zeros(len(mixed)), np.zeros(len(mixed))
    first = np.mean(b * (mixed - a), axis=1) / variance
    total = 0.5 * np.mean((a - mixed) ** 2, axis=1) / variance
    return first, total
