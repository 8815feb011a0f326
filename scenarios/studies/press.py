"""The lip press: a threaded neck pressed into a block of lip until it carries a given force.

Thesis section 3.1.3 and Figure 3.6: the lip's bottom is fixed, the neck neither turns nor moves
sideways, and is lowered until 0.3 N act on it. Which parts of the thread then touch is compared
with where food colouring was found on a package. The sizes of the lip are lost with the figure;
the defaults are assumed openly.

The lip stands upright, its bottom at y = 0 and its middle at x = 0; the neck's axis is horizontal,
its opening towards −x, and its lower wall comes down on the lip.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from fem2d.body.body import Body
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load
from fem2d.materials.material import Material
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.static import StaticResult, StaticSettings, kept_at, static_path, static_step
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.progress import Progress, no_progress
from geometry2d.foundation.settings import setting
from geometry2d.mesh import polygon_mesh
from geometry2d.neck import NECKS, NeckSection, neck_section
from scenarios.settings.names import nearest

Array = NDArray[np.float64]

ASSUMED = "assumed: the thesis' size is lost with its figure"

DEEPEST = 0.8
"""Share of the lip's height beyond which the neck cannot be pressed."""

SEARCH = StaticSettings(first_contact=False)
"""Slip counts from the start of a step of the neck."""


class PressError(DrinksimError):
    """A press was described that cannot be done."""


@dataclass(frozen=True)
class PressOptions:
    """How hard is pressed, with what, and the block of lip."""

    force: float = setting(
        default=0.3, unit="N", minimum=1e-6, maximum=1e4,
        description="force on the section", source="thesis section 3.1.3",
    )  # fmt: skip
    neck: str = setting(default="A38", presets=NECKS, description="neck of the library")
    lip_width_mm: float = setting(
        default=18.0, unit="mm", minimum=2.0, maximum=200.0,
        description="width of the block", source=ASSUMED,
    )  # fmt: skip
    lip_height_mm: float = setting(
        default=12.0, unit="mm", minimum=2.0, maximum=200.0,
        description="height of the block", source=ASSUMED,
    )  # fmt: skip
    lip_radius_mm: float = setting(
        default=5.0, unit="mm", minimum=0.1, maximum=100.0,
        description="rounding of its upper corners", source=ASSUMED,
    )  # fmt: skip
    dermis_mm: float = setting(
        default=1.195, unit="mm", minimum=0.01, maximum=50.0,
        description="thickness of the dermis around it", source="thesis Table 3.4",
    )  # fmt: skip
    opening_mm: float = setting(
        default=4.0, unit="mm", minimum=-100.0, maximum=200.0,
        description="from the block's left side to the neck's opening", source=ASSUMED,
    )  # fmt: skip
    friction: float = setting(
        default=1.0, minimum=0.0, maximum=10.0,
        description="friction coefficient of lip and neck", source="thesis section 4.1.2",
    )  # fmt: skip
    plane: Literal["stress", "strain"] = setting(default="stress", description="of the section")
    thickness_mm: float = setting(
        default=1.0, unit="mm", minimum=1e-3, maximum=1e3,
        description="of the section", source="the scenarios'",
    )  # fmt: skip
    edge_mm: float = setting(
        default=0.3, unit="mm", minimum=0.05, maximum=5.0,
        description="length of an element's edge at the neck",
    )  # fmt: skip
    step_mm: float = setting(
        default=0.25, unit="mm", above=0.0, maximum=5.0,
        description="way of the neck between two equilibria",
    )  # fmt: skip
    force_tolerance: float = setting(
        default=1e-4, above=0.0, maximum=0.1, description="relative error of the force"
    )

    def __post_init__(self) -> None:
        if self.neck not in NECKS:
            raise PressError(f"neck {self.neck!r} is unknown: {nearest(self.neck, NECKS)}")
        if self.lip_radius_mm <= self.dermis_mm:
            raise PressError(
                f"a dermis of {self.dermis_mm:g} mm does not fit around corners rounded by "
                f"{self.lip_radius_mm:g} mm: make lip_radius_mm larger"
            )
        if 2 * self.lip_radius_mm >= self.lip_width_mm or self.lip_radius_mm >= self.lip_height_mm:
            raise PressError(
                f"corners rounded by {self.lip_radius_mm:g} mm do not fit on a lip of "
                f"{self.lip_width_mm:g} by {self.lip_height_mm:g} mm: make lip_radius_mm smaller"
            )


@dataclass(frozen=True)
class Press:
    """A lip under a neck.

    Parameters
    ----------
    layers
        Materials, the dermis first.
    options
        Force, neck and sizes.
    """

    layers: Mapping[str, Material]
    options: PressOptions

    @cached_property
    def neck(self) -> NeckSection:
        """The neck, in its own frame."""
        return neck_section(NECKS[self.options.neck])

    @cached_property
    def body(self) -> Body:
        """The block of lip."""
        o = self.options
        outer, inner = (_profile(o, inset) for inset in (0.0, o.dermis_mm))
        skin, inside = next(iter(self.layers)), list(self.layers)[-1]
        regions = {"dermis": np.concatenate([outer, inner[::-1]]), "bulk": inner}

        def size(points: Array) -> Array:
            depth = np.maximum(o.lip_height_mm - points[:, 1] - 0.5, 0.0)
            return np.asarray(o.edge_mm * (1 + 0.4 * depth))

        tiny = 1e-6
        mesh = polygon_mesh(
            regions,
            size,
            boundaries={
                "bottom": lambda middle: middle[:, 1] < tiny,
                "skin": lambda middle: middle[:, 1] > 0.3 * o.lip_height_mm,
            },
        )
        return Body(
            mesh,
            {"dermis": self.layers[skin], "bulk": self.layers[inside]},
            plane=o.plane,
            element="T6",
            thickness_mm=o.thickness_mm,
        )

    @cached_property
    def fem_model(self) -> Model:
        """Lip, its fixed bottom, and the neck's lower wall."""
        body = self.body
        surface = body.surface("skin")
        pair = RigidContact(
            surface,
            self.neck.lower_wall,
            normal=NormalLaw(),
            friction=FrictionLaw(self.options.friction),
            name="neck",
        )
        return Model(body, contacts=[pair], held=body.dofs("bottom"))

    def load(self, indentation_mm: float) -> Load:
        """Return the load that lowers the neck by this much from where it first touches, mm."""
        wall = self.neck.lower_wall.sampled(0.02)
        opening, lowest = wall.min(axis=0)
        o = self.options
        shift = (
            o.opening_mm - 0.5 * o.lip_width_mm - float(opening),
            o.lip_height_mm - float(lowest) - indentation_mm,
        )
        return Load(move=shift)

    def indentation_mm(self, result: StaticResult) -> float:
        """Return how far the neck has come down at an equilibrium, mm."""
        return self.load(0.0).move[1] - result.load.move[1]

    def pressed(self, *, progress: Progress = no_progress) -> StaticResult:
        """Return the equilibrium at which the neck carries the force.

        Raises
        ------
        PressError
            If the lip cannot carry it.
        """
        o, solver = self.options, fastest_solver()
        below = kept_at(self.fem_model, load=self.load(0.0))
        while True:
            depth = self.indentation_mm(below) + o.step_mm
            if depth > DEEPEST * o.lip_height_mm:
                raise PressError(
                    f"the lip carries {force_n(below):.4g} N when the neck is "
                    f"{self.indentation_mm(below):.2f} mm deep in its {o.lip_height_mm:g} mm, not "
                    f"{o.force:g} N: use a smaller force or a larger lip"
                )
            for result in static_path(
                self.fem_model, self.load(depth), start=below, solver=solver, settings=SEARCH
            ):
                if not result.converged:
                    raise PressError(
                        f"the lip loses its equilibrium at {force_n(below):.4g} N, "
                        f"{self.indentation_mm(below):.2f} mm deep, and cannot carry {o.force:g} N:"
                        " use a smaller force"
                    )
                if force_n(result) >= o.force:
                    return self._between(below, result)
                below = result
            progress(min(force_n(below) / o.force, 1.0), f"{force_n(below):.3f} N")

    def _between(self, below: StaticResult, above: StaticResult) -> StaticResult:
        """Return the equilibrium with the force, between one with less and one with more."""
        o, solver = self.options, fastest_solver()
        reached = above

        def excess(depth: float) -> float:
            nonlocal reached
            reached = static_step(
                self.fem_model, below, self.load(depth), solver=solver, settings=SEARCH
            )
            error = force_n(reached) - o.force
            return 0.0 if abs(force_n(reached) / o.force - 1) < o.force_tolerance else error

        brentq(excess, self.indentation_mm(below), self.indentation_mm(above), xtol=1e-7)
        return reached


def _profile(options: PressOptions, inset_mm: float) -> Array:
    """Return the lip's outline (n, 2) from the right end of its bottom over the top to the left."""
    half = 0.5 * options.lip_width_mm - inset_mm
    top = options.lip_height_mm - inset_mm
    radius = options.lip_radius_mm - inset_mm
    count = max(6, int(np.ceil(0.5 * np.pi * options.lip_radius_mm / options.edge_mm)))
    angle = np.linspace(0.0, 0.5 * np.pi, count + 1)
    right = np.column_stack([np.cos(angle), np.sin(angle)]) * radius
    right += [half - radius, top - radius]
    left = right[::-1] * [-1.0, 1.0]
    return np.concatenate([[[half, 0.0]], right, left, [[-half, 0.0]]])


def force_n(result: StaticResult) -> float:
    """Return the force on the neck, N, upwards."""
    return -float(sum(np.sum(touch.force[:, 1::2]) for touch in result.contacts)) + 0.0
