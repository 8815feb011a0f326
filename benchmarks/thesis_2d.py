"""What the thesis says in numbers about its section of the head, measured on runs of ours.

    python -m benchmarks.thesis_2d RUN...

``RUN`` are run directories of `drinksim replay`; a run in plane strain is compared with the one of
the same scenario in plane stress. docs/verification/sips.md holds the answers beside the thesis'.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.settings.scenario import Scenario, load_scenario
from scenarios.views.scene import SkinLine

Array = NDArray[np.float64]

NEAR_CONTACT_MM = 4.0
"""An extreme nearer than this to a point under pressure counts as at the contact."""


def relative(solution: Solution, index: int) -> float:
    """Return the relative time of an increment."""
    return float(solution.history["relative_time"][index])


def undisturbed(solution: Solution, scenario: Scenario) -> NDArray[np.bool_]:
    """Return in which increments (k,) neither a muscle pulls nor a lip has just been let go."""
    time = solution.time_s
    calm = np.ones(time.size, bool)
    if scenario.muscle is not None:
        instants = np.reshape(scenario.muscle.instants_s, (-1, 4))
        for tense, _, _, relaxed in instants:
            calm &= (time < tense) | (time > relaxed)
    touched = np.any([solution[f"{lip}_lip_window_kpa"].values > 0 for lip in LIPS], axis=0)
    last = int(np.flatnonzero(touched)[-1])
    return calm & (np.arange(time.size) <= last)


def place_of(solution: Solution, index: int, field: str, sign: int) -> str:
    """Return where in the dermis the extreme of an element field is, in words."""
    frame, model = solution.snapshot(index), solution.model
    dermis = np.array([name.endswith("dermis") for name in model.region_names])[model.region]
    values = np.where(dermis, sign * frame.element[field], -np.inf)
    element = int(np.argmax(values))
    deformed = model.nodes + frame.displacement
    centre = deformed[model.triangles[element, :3]].mean(axis=0)
    lip = model.region_names[model.region[element]].split("_")[0]
    points = np.concatenate(
        [
            SkinLine(model, model.skin[name], history.arc_mm).points(deformed)[
                frame.pressure_mpa[name] > 0
            ]
            for name, history in solution.contact.items()
        ]
    )
    away = np.linalg.norm(points - centre, axis=1).min() if len(points) else np.inf
    at = "at the contact" if away < NEAR_CONTACT_MM else "away from any contact"
    return f"{lip} lip, {at}"


def extreme(solution: Solution, name: str, field: str, sign: int, calm: NDArray[np.bool_]) -> str:
    """Return an extreme of a history while ``calm``, when and where."""
    values = np.where(calm, sign * solution[name].values, -np.inf)
    index = int(np.argmax(values))
    return (
        f"{sign * values[index]:.3g} at {relative(solution, index):.2f} "
        f"({place_of(solution, index, field, sign)})"
    )


def pressure(solution: Solution, lip: str) -> str:
    """Return the highest pressure, when, and the middle of the time above half of it."""
    values = solution[f"{lip}_lip_pressure_kpa"].values
    window = solution[f"{lip}_lip_window_kpa"].values
    index = int(np.argmax(values))
    above = solution.history["relative_time"][values > 0.5 * values[index]]
    return (
        f"{values[index]:.0f} kPa (0.5 mm: {window.max():.0f}) at {relative(solution, index):.2f}; "
        f"above half of it from {above[0]:.2f} to {above[-1]:.2f}"
    )


def regions(solution: Solution) -> dict[str, Array]:
    """Return by lip the stretch of skin (2,), mm, whose nodes ever bore load."""
    stretches = {}
    for lip, history in solution.contact.items():
        ever = np.any(history.fields["gap_mm"] < 0, axis=0)
        stretches[lip] = history.arc_mm[ever][[0, -1]]
    return stretches


def main() -> None:
    """Print the answers for each run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", type=Path)
    in_stress: dict[str, Solution] = {}
    for folder in parser.parse_args().runs:
        solution = Solution.load(folder)
        scenario = load_scenario(str(folder / "scenario.toml"))
        calm = undisturbed(solution, scenario)
        whole = np.ones_like(calm)
        numerics = scenario.numerics
        print(f"\n{scenario.name}, plane {numerics.plane}, {numerics.resolution}:")
        print(f"  {solution.message}")
        print(f"  wall time {solution.summary['wall_s']:.0f} s")
        for title, name, field, sign in (
            ("smallest log strain", "dermis_min_log_strain", "log_strain_min", -1),
            ("largest log strain", "dermis_max_log_strain", "log_strain_max", 1),
            ("von Mises, kPa", "dermis_max_mises_kpa", "von_mises_mpa", 1),
        ):
            print(f"  {title}: {extreme(solution, name, field, sign, calm)}")
            if not np.all(calm):
                print(
                    f"    with muscle and snap-back: {extreme(solution, name, field, sign, whole)}"
                )
        for lip in LIPS:
            print(f"  {lip} lip: {pressure(solution, lip)}")
        for lip, (first, last) in regions(solution).items():
            print(f"  {lip} lip touched from {first:.2f} to {last:.2f} mm along its skin")
        if scenario.numerics.plane == "stress":
            in_stress[scenario.name] = solution
        elif scenario.name in in_stress:
            here, there = regions(in_stress[scenario.name]), regions(solution)
            for lip in here:
                low = max(here[lip][0], there[lip][0])
                high = min(here[lip][1], there[lip][1])
                union = max(here[lip][1], there[lip][1]) - min(here[lip][0], there[lip][0])
                print(
                    f"  {lip} lip: {100 * (high - low) / union:.0f} % of the skin touched is common"
                )


if __name__ == "__main__":
    main()
