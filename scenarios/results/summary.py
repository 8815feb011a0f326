"""A run in numbers: peaks of the history, extremes of the computation, unstable passages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, fields
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.rigid import rigid_responses
from fem2d.contact.self_contact import self_responses
from fem2d.solvers.commit import Commit
from fem2d.solvers.stability import Instability, Passage
from scenarios.results.increment import Measured, SolutionError
from scenarios.results.quantities import HISTORY, LIPS

Array = NDArray[np.float64]

SUMMARY_FILE = "summary.json"
COMPARED = ("_kpa", "_contact_mm", "_lip_force_n", "_crest_contrast")
"""How the names of columns end whose peaks tell runs apart, beside those of the dermis."""


@dataclass(frozen=True)
class Extremes:
    """The largest values over a run that tell how far its numbers can be trusted.

    Penetrations are in mm, energies in N mm; the unbalanced force is relative to the largest force.
    The two windows of a lip are the same pressure, measured in two ways: the mesh leaves open what
    they differ by.
    """

    largest_penetration_neck_mm: float = 0.0
    largest_penetration_teeth_mm: float = 0.0
    largest_penetration_between_nodes_mm: float = 0.0
    largest_penetration_lips_mm: float = 0.0
    largest_unbalanced_force_share: float = 0.0
    largest_strain_energy_nmm: float = 0.0
    largest_kinetic_energy_nmm: float = 0.0
    highest_window_upper_lip_kpa: float = 0.0
    highest_window_lower_lip_kpa: float = 0.0
    highest_recovered_window_upper_lip_kpa: float = 0.0
    highest_recovered_window_lower_lip_kpa: float = 0.0

    @classmethod
    def of(cls, commit: Commit, *, force_floor_n: float) -> Extremes:
        """Return the values of one committed increment.

        Where no nodal force is larger than ``force_floor_n``, no unbalanced force counts.
        """
        depth = {"neck": 0.0, "teeth": 0.0, "between_nodes": 0.0, "lips": 0.0}
        for response in rigid_responses(commit.contacts):
            what = "neck" if response.contact.moving else "teeth"
            depth[what] = max(depth[what], -float(np.min(response.points.gap)))
            between = response.contact.deepest(response)
            depth["between_nodes"] = max(depth["between_nodes"], between)
        for lips in self_responses(commit.contacts):
            overlap = -float(np.min(lips.points.gap[lips.touching], initial=0.0))
            depth["lips"] = max(depth["lips"], overlap)
        forces_matter = commit.newton.force_scale > force_floor_n
        return cls(
            **{f"largest_penetration_{what}_mm": value for what, value in depth.items()},
            largest_unbalanced_force_share=commit.newton.imbalance if forces_matter else 0.0,
            largest_strain_energy_nmm=commit.energies.strain,
            largest_kinetic_energy_nmm=commit.energies.kinetic,
        )

    @classmethod
    def of_windows(cls, measured: Measured) -> Extremes:
        """Return the pressures over a window of one increment."""
        windows = {
            f"highest_window_{lip}_lip_kpa": measured.history[f"{lip}_lip_window_kpa"]
            for lip in LIPS
        }
        recovered = {
            f"highest_recovered_window_{lip}_lip_kpa": measured.recovered_window_kpa[lip]
            for lip in LIPS
        }
        return cls(**windows, **recovered)

    @classmethod
    def from_array(cls, values: Array) -> Extremes:
        """Return the extremes that :meth:`as_array` gave.

        Raises
        ------
        SolutionError
            If there are more or fewer.
        """
        names = [field.name for field in fields(cls)]
        if len(values) != len(names):
            raise SolutionError(
                f"the checkpoint holds {len(values)} extremes, not {len(names)}: another version "
                "wrote it; run without --resume to start over"
            )
        return cls(**dict(zip(names, values.tolist(), strict=True)))

    def as_array(self) -> Array:
        """Return the values in the order of the fields."""
        return np.array(astuple(self))

    def widened(self, other: Extremes) -> Extremes:
        """Return the larger of each value."""
        return Extremes.from_array(np.maximum(self.as_array(), other.as_array()))

    def about(self) -> dict[str, float]:
        """Return the values by name."""
        return asdict(self)


def passages_as_array(passages: Sequence[Passage]) -> Array:
    """Return unstable passages as rows (p, 7): start, end, modes, x, y, node, participation."""
    rows = [
        (p.start_s, p.end_s, p.worst.modes, *p.worst.place_mm, p.worst.node, p.worst.participation)
        for p in passages
    ]
    return np.array(rows, float).reshape(-1, 7)


def passages_from_array(rows: Array) -> tuple[Passage, ...]:
    """Return the passages that :func:`passages_as_array` gave."""
    return tuple(
        Passage(start, end, Instability(int(modes), (x, y), int(node), participation))
        for start, end, modes, x, y, node, participation in rows.tolist()
    )


def run_summary(
    rows: Sequence[Mapping[str, float]],
    *,
    finished: bool,
    message: str,
    wall_s: float,
    about: Mapping[str, Any],
) -> dict[str, Any]:
    """Return what summary.json holds.

    Parameters
    ----------
    rows
        Of the history, at least one.
    finished
        Whether the whole motion was replayed.
    message
        How it ended.
    wall_s
        How long it took, s.
    about
        Further numbers.
    """
    return {
        "finished": finished,
        "sentence": message,
        "increments": len(rows),
        **peaks(rows),
        **impulses(rows),
        **seal_margins(rows),
        "newton_iterations": int(sum(row["newton_iterations"] for row in rows)),
        "cutbacks": int(sum(row["cutbacks"] for row in rows)),
        "wall_s": round(wall_s, 2),
        "version": version("drinksim"),
        **about,
    }


def peaks(rows: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the extreme values over a run of the columns that are compared between runs."""
    smallest = {"dermis_min_log_strain"}
    compared = [
        quantity.name
        for quantity in HISTORY
        if quantity.name.startswith("dermis") or quantity.name.endswith(COMPARED)
    ]
    return {
        name: min(row[name] for row in rows) if name in smallest else max(row[name] for row in rows)
        for name in compared
    }


def impulses(rows: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the time integral of each lip's force over a run, N s, linear between increments."""
    time_s = [row["time_s"] for row in rows]
    return {
        f"{lip}_lip_impulse_ns": float(
            np.trapezoid([row[f"{lip}_lip_force_n"] for row in rows], time_s)
        )
        for lip in LIPS
    }


def seal_margins(rows: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the smallest seal of each lip while liquid is at the rim, kPa; empty if none is."""
    drinking = [row for row in rows if row["liquid_kpa"] > 0]
    if not drinking:
        return {}
    return {
        f"{lip}_lip_seal_margin_kpa": min(row[f"{lip}_lip_seal_kpa"] for row in drinking)
        for lip in LIPS
    }
