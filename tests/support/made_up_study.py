"""A study of formulas: sips are computed by a function instead of by finite elements."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from scenarios.campaign.cases import Case
from scenarios.campaign.design import design_points
from scenarios.campaign.plan import Plan
from scenarios.campaign.settings import DesignSettings, StudySettings
from scenarios.campaign.sip import WHOLE, SipRow, SipTask
from scenarios.campaign.variation import VariedSetting

ISHIGAMI = (7.0, 0.1)
"""a and b of Ishigami's function."""


def plan_of_factors(
    factors: Sequence[Mapping[str, object]],
    *,
    design: DesignSettings | None = None,
    vary: Sequence[VariedSetting] = (),
) -> Plan:
    """Return a plan with a case for each combination of factors, which its scenario holds."""
    cases = tuple(
        Case(f"case-{number:05d}", each, json.dumps(each)) for number, each in enumerate(factors)
    )
    settings = StudySettings(
        base="made up", folder=Path(), vary=tuple(vary), design=design or DesignSettings()
    )
    return Plan(settings, (), (), (), cases)


def ishigami_plan(samples: int, seed: int) -> Plan:
    """Return the plan of a study of Ishigami's three factors."""
    design = DesignSettings(kind="sobol", samples=samples, seed=seed)
    vary = [VariedSetting(f"x{k}", low=-np.pi, high=np.pi) for k in (1, 2, 3)]
    factors = [
        {"sample": point.sample, "matrix": point.matrix, **point.values}
        for point in design_points(design, vary)
    ]
    return plan_of_factors(factors, design=design, vary=vary)


def ishigami(task: SipTask) -> SipRow:
    """Return Ishigami's function as a sip's pressure."""
    x = json.loads(task.scenario_toml)
    a, b = ISHIGAMI
    value = np.sin(x["x1"]) + a * np.sin(x["x2"]) ** 2 + b * x["x3"] ** 4 * np.sin(x["x1"])
    return SipRow(WHOLE, measures={"lips_window_kpa_peak": float(value)})


def ishigami_indices() -> tuple[list[float], list[float]]:
    """Return the exact first and total indices."""
    a, b = ISHIGAMI
    first = 0.5 * (1 + b * np.pi**4 / 5) ** 2
    second, both = a**2 / 8, b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    whole = first + second + both
    return [first / whole, second / whole, 0.0], [
        (first + both) / whole,
        second / whole,
        both / whole,
    ]


def remembered(task: SipTask) -> SipRow:
    """Return a row of numbers that follow from the factors, slowly, and keep it in its directory.

    Factors may ask for more: ``busy_s`` computes for so long, ``fails`` raises, ``kills`` ends the
    process the first time, ``hangs`` sleeps.
    """
    folder = Path(task.folder)
    known = SipRow.read(folder)
    if known is not None:
        return known
    factors = json.loads(task.scenario_toml)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "tries.txt").open("a") as stream:
        stream.write(f"{os.getpid()}\n")
    if factors.get("fails"):
        raise RuntimeError("the disk is gone")
    if factors.get("kills") and len((folder / "tries.txt").read_text().split()) <= factors["kills"]:
        os._exit(9)
    end = time.process_time() + float(factors.get("busy_s", 0.0))
    while time.process_time() < end:
        pass
    random = np.random.default_rng(int(factors["number"]))
    row = SipRow(WHOLE, measures={"lips_window_kpa_peak": float(random.normal(60.0, 5.0))})
    row.write(folder)
    return row
