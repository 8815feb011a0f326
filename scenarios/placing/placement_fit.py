"""The small shift of package and lower face that explains observed first contacts.

A recording fits a head section to a few millimetres only: it shows another face, and scales and
depths err. The thesis moved package and lower face by hand until the sip looked right. Here it is a
small inverse problem. The unknowns ``q`` are the components of a shift of the package, its turn
about the lower mark, and a shift of the lower face. Observed are, for each lip, time and place of
its first contact with the neck. With undeformed lips and the neck where it was recorded, both
rigid, ``g(t; q)`` is the gap between a lip's skin and the neck, and the residuals are

    r₁ = min_{t ≤ T} g(t; q) / σ_g,   σ_g² = σ_skin² + (ġ(T; 0) σ_T)²       first contact at T,
    r₂ = (s(T; q) − S) / σ_S                                            contact at the place S,

where ``s`` is the place on the skin that is nearest to the neck. Of all ``q`` that explain the
observations, ``χ² = Σ r² ≤ n``, the smallest is taken: ``min χ² + λ² |q|²`` (mm and degrees count
alike) within bounds, with ``λ`` as large as the discrepancy principle (Morozov 1966) allows. A
recording that already fits is therefore not moved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from geometry2d.anatomy.head import HeadSection
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidPlacement
from scenarios.placing.lip_skin import LipSkin
from scenarios.placing.recorded_motion import RecordedMotion
from scenarios.placing.shift import Shift
from scenarios.results.quantities import LIPS, WALLS
from scenarios.settings.scenario import FirstContact, Placement, ScenarioError
from scenarios.settings.searches import ShiftSearch

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlacementFit:
    """The residuals of the observations as a function of the unknowns.

    Parameters
    ----------
    head, neck
        The sections, each in its own frame.
    recorded
        The recorded motion.
    contact
        The observed first contacts and their standard deviations.
    start
        The movement whose given components are kept; the wanted ones are zero.
    wanted
        Names of the unknowns, in the order of ``q``.
    search
        How gaps are measured, and in which steps the unknowns are searched.
    """

    head: HeadSection
    neck: NeckSection
    recorded: RecordedMotion
    contact: FirstContact
    start: Shift
    wanted: tuple[str, ...]
    search: ShiftSearch

    @cached_property
    def observations(self) -> tuple[str, ...]:
        """Names of the observations."""
        names = [f"{lip}_{what}" for lip in LIPS for what in ("time_s", "place_mm")]
        return tuple(name for name in names if getattr(self.contact, name) is not None)

    @cached_property
    def skins(self) -> dict[str, tuple[Array, Array]]:
        """Points (p, 2), mm, of the skin of each lip near its margin, and their places (p,)."""
        skins = {}
        for lip in LIPS:
            line = LipSkin.of(self.head, lip)
            arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line.points, axis=0).T))])
            wanted = np.arange(0.0, arc[-1], self.search.skin_spacing_mm)
            wanted = wanted[np.abs(wanted - line.margin_mm) < self.search.reach_mm]
            points = np.column_stack([np.interp(wanted, arc, x) for x in line.points.T])
            skins[lip] = points, line.outwards * (wanted - line.margin_mm)
        return skins

    @cached_property
    def watched(self) -> dict[str, tuple[RigidPlacement, ...]]:
        """Placements of the recorded neck at the first contact and at instants before, by lip."""
        watched, search = {}, self.search
        for lip in LIPS:
            time = getattr(self.contact, f"{lip}_time_s")
            if time is not None:
                before = (
                    time - search.look_back_s * np.arange(search.instants + 1) / search.instants
                )
                watched[lip] = tuple(self.recorded.neck.at(float(t)) for t in before)
        return watched

    @cached_property
    def gap_sigma(self) -> dict[str, float]:
        """Standard deviation of the gap at the observed instant, mm, by lip."""
        sigmas = {}
        for lip in self.watched:
            time, step = getattr(self.contact, f"{lip}_time_s"), self.contact.time_sigma_s
            places = tuple(self.recorded.neck.at(time + dt) for dt in (-step, step))
            before, after = self._distances(lip, places, self.start).min(axis=1)
            speed = abs(after - before) / (2 * step)
            sigmas[lip] = float(np.hypot(self.contact.skin_sigma_mm, speed * step))
        return sigmas

    def shift(self, q: Array) -> Shift:
        """Return the movement for values (m,) of the unknowns."""
        return replace(
            self.start, **{name: float(v) for name, v in zip(self.wanted, q, strict=True)}
        )

    def residuals(self, q: Array) -> Array:
        """Return (n,) residuals in standard deviations."""
        shift = self.shift(q)
        residuals = []
        for lip, places in self.watched.items():
            at_contact, nearest = self._nearest(lip, self._distances(lip, places[:1], shift)[0])
            before = self._distances(lip, places[1:], shift, every=self.search.thinning)
            gap = min(at_contact, float(before.min()))
            residuals.append(gap / self.gap_sigma[lip])
            observed_place = getattr(self.contact, f"{lip}_place_mm")
            if observed_place is not None:
                residuals.append((nearest - observed_place) / self.contact.place_sigma_mm)
        return np.array(residuals)

    def chi_squared(self, q: Array) -> float:
        """Return the sum of the squared residuals."""
        return float(np.sum(self.residuals(q) ** 2))

    def explains(self, q: Array) -> bool:
        """Return whether the residuals are no larger than the observations' errors."""
        return self.chi_squared(q) <= len(self.observations)

    def jacobian(self, q: Array) -> Array:
        """Return the derivatives (n, m) of the residuals, by differences."""
        here, step = self.residuals(q), self.search.difference
        return np.column_stack(
            [(self.residuals(q + step * e) - here) / step for e in np.eye(q.size)]
        )

    def sigmas(self, q: Array) -> list[float]:
        """Return the standard deviations (m,) of the unknowns; infinite where undetermined.

        They follow from the observations alone, without the preference for small shifts.
        Derivatives are taken over a finite step, because the nearest point of a skin jumps.
        """
        step = self.search.uncertainty_difference
        slopes = [
            (self.residuals(q + step * e) - self.residuals(q - step * e)) / (2 * step)
            for e in np.eye(q.size)
        ]
        _, s, vt = np.linalg.svd(np.column_stack(slopes), full_matrices=True)
        fixed = s > 1e-6 * s[0] if s.size and s[0] > 0 else np.zeros(s.size, bool)
        variance = np.zeros(len(q))
        for k in range(len(q)):
            known = k < s.size and fixed[k]
            variance += vt[k] ** 2 / s[k] ** 2 if known else np.where(vt[k] ** 2 > 1e-9, np.inf, 0)
        return [float(v) for v in np.sqrt(variance)]

    def _distances(
        self, lip: str, places: tuple[RigidPlacement, ...], shift: Shift, *, every: int = 1
    ) -> Array:
        """Return the distances (t, p), mm, of every ``every``-th point of a skin from the neck."""
        points = self.skins[lip][0][::every]
        if lip == "lower":
            points = points + shift.lower_face_mm
        local = np.stack([shift.applied(p).pull_back(points) for p in places])
        distance = np.min(
            [getattr(self.neck, wall).project(local.reshape(-1, 2)).distance for wall in WALLS],
            axis=0,
        )
        by_instant: Array = distance.reshape(len(places), len(points))
        return by_instant

    def _nearest(self, lip: str, distance: Array) -> tuple[float, float]:
        """Return the smallest of distances (p,), mm, and its place, by a parabola through three."""
        places = self.skins[lip][1]
        k = int(np.clip(np.argmin(distance), 1, len(distance) - 2))
        left, middle, right = distance[k - 1 : k + 2]
        bend = left - 2 * middle + right
        into = float(np.clip(0.5 * (left - right) / bend, -1.0, 1.0)) if bend > 0 else 0.0
        gap = middle - 0.25 * (left - right) * into
        return float(gap), float(places[k] + into * (places[k + 1] - places[k]))


def smallest_shift(problem: PlacementFit, settings: Placement) -> Array:
    """Return the smallest values (m,) of the unknowns that explain the observations.

    Raises
    ------
    ScenarioError
        If no values within the bounds of the settings do.
    """
    bound = np.array(
        [settings.at_most_deg if n == "turn_deg" else settings.at_most_mm for n in problem.wanted]
    )
    nothing, search = np.zeros(bound.size), problem.search
    if problem.explains(nothing):
        return nothing
    halfway = [sign * 0.5 * row for row in np.diag(bound) for sign in (-1, 1)]
    fits: list[Array] = []
    for start in (nothing, *halfway):
        fit = _fitted(problem, search.weakest, start, bound)
        if all(np.linalg.norm(fit - other) > search.same for other in fits):
            fits.append(fit)
    explaining = [q for q in fits if problem.explains(q)]
    if not explaining:
        best = min(fits, key=problem.chi_squared)
        raise ScenarioError(_unexplained(problem, best, bound, settings))
    shrunk = [_shrunk(problem, q, bound) for q in explaining]
    return min(shrunk, key=lambda q: float(np.linalg.norm(q)))


def _fitted(problem: PlacementFit, strength: float, start: Array, bound: Array) -> Array:
    """Return the unknowns that minimise χ² + λ² |q|² near a start; ``strength`` is λ."""
    found = least_squares(
        lambda q: np.concatenate([problem.residuals(q), strength * q]),
        start,
        jac=lambda q: np.vstack([problem.jacobian(q), strength * np.eye(q.size)]),
        bounds=(-bound, bound),
        xtol=1e-6,
        ftol=1e-8,
    )
    return np.asarray(found.x)


def _shrunk(problem: PlacementFit, q: Array, bound: Array) -> Array:
    """Return the smallest unknowns on the branch of ``q`` that explain the observations."""
    weak, strong = float(np.log(problem.search.weakest)), np.inf
    while strong - weak > problem.search.fineness:
        middle = weak + np.log(4.0) if np.isinf(strong) else 0.5 * (weak + strong)
        candidate = _fitted(problem, float(np.exp(middle)), q, bound)
        if problem.explains(candidate):
            weak, q = middle, candidate
        else:
            strong = middle
    return q


def _unexplained(problem: PlacementFit, q: Array, bound: Array, settings: Placement) -> str:
    """Return which observation fits worst, and the remedy."""
    residuals = problem.residuals(q)
    worst = int(np.argmax(np.abs(residuals)))
    name = problem.observations[worst]
    at_bound = [n for n, v, b in zip(problem.wanted, q, bound, strict=True) if abs(v) > 0.98 * b]
    remedy = (
        f"{', '.join(at_bound)} reached the bound: raise placement.at_most_mm or at_most_deg, or "
        if at_bound
        else ""
    )
    return (
        f"no shift within {settings.at_most_mm:g} mm and {settings.at_most_deg:g}° explains the "
        f"first contacts: first_contact.{name} stays {abs(residuals[worst]):.1f} standard "
        f"deviations off; {remedy}check [first_contact] and the scale of the marker file"
    )
