"""Where the recorded neck meets the head section: the thesis' manual editing, automated.

A recording fits a head section to some millimetres only: it is another face, and scales and depths
err. The thesis moved package and lower face by hand until the sip looked right. Here it is a small
inverse problem. The unknowns ``q`` are those of a shift of the package, its turn about the lower
mark, and a shift of the lower face, that are to be found. Observed are, for each lip, when the neck
touched it first and where. With the undeformed lips, the neck where it was recorded and both
rigid, ``g(t; q)`` is the gap between a lip's skin and the neck, and the residuals are

    r₁ = min_{t ≤ T} g(t; q) / σ_g,   σ_g² = σ_skin² + (ġ(T; 0) σ_T)²       touched first at T,
    r₂ = (s(T; q) − S) / σ_S                                            touched at the place S,

``s`` being the place on the skin that is nearest to the neck. Of all ``q`` that explain what was
observed, ``χ² = Σ r² ≤ n``, the smallest is taken: ``min χ² + λ² |q|²`` (mm and degrees count
alike) within bounds, with ``λ`` as large as the discrepancy principle (Morozov 1966) allows. A
recording that fits already is therefore not moved at all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.optimize import least_squares

from geometry2d.anatomy.head import HeadSection
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion, RigidPlacement, rotated
from mocap.motion.motion import MarkedBody, Motion
from scenarios.results.quantities import LIPS
from scenarios.settings.scenario import FirstContact, Placement, Scenario, ScenarioError
from scenarios.sip.lip_model import WALLS, LipSkin

Array = NDArray[np.float64]

UNKNOWNS = ("shift_x_mm", "shift_y_mm", "turn_deg", "lower_face_x_mm", "lower_face_y_mm")

ANGLE_DIGITS, PLACE_DIGITS = 11, 9
"""Decimals of rad and mm that are kept of a motion: a millionth of its uncertainty, and far above
rounding."""

SKIN_SPACING_MM = 0.4
REACH_MM = 24.0
"""How far from the lip's margin a first contact is looked for, along the skin."""

LOOK_BACK_S = 1.0
INSTANTS = 8
THINNED = 3
"""Before it is first touched a lip must not be touched: looked at so often, so long before, at
every third point of the skin."""

STEP = 1e-3
"""Step of the finite differences, mm or degrees: far above rounding, far below what is seen."""

FINITE_STEP = 0.2
"""Step over which the uncertainty of the answer is judged, mm or degrees."""

WEAKEST = 1e-2
"""The smallest λ, per mm or degree: no regularisation to speak of."""

SAME = 0.1
"""Fits from two starts that differ by less, mm or degrees, are one."""

FINENESS = 0.05
"""How finely λ is searched, as a share of it."""


@dataclass(frozen=True)
class Observed:
    """What the recording says about where head and neck are.

    Attributes
    ----------
    neck
        Motion of the neck in the head section's own frame.
    head_angle_rad
        Turn of the head section from its own frame into the head frame of the recording, whose
        axes are the picture's: only what is written is turned by it.
    """

    neck: RigidMotion
    head_angle_rad: float


@dataclass(frozen=True)
class Shift:
    """A small movement of the package and of the lower face, along the axes of the head section.

    ``turn_deg`` turns the package counter-clockwise about its lower mark.
    """

    shift_x_mm: float = 0.0
    shift_y_mm: float = 0.0
    turn_deg: float = 0.0
    lower_face_x_mm: float = 0.0
    lower_face_y_mm: float = 0.0

    def moved(self, motion: RigidMotion) -> RigidMotion:
        """Return the motion of the shifted and turned neck."""
        return RigidMotion(
            motion.time_s,
            motion.angle_rad + np.deg2rad(self.turn_deg),
            motion.shift_mm + np.array([self.shift_x_mm, self.shift_y_mm]),
        )

    def applied(self, place: RigidPlacement) -> RigidPlacement:
        """Return where the shifted and turned neck is when the recorded one is at ``place``."""
        # The lower mark is the origin of the neck frame: turned about it, the shift stays.
        return RigidPlacement(
            place.angle_rad + float(np.deg2rad(self.turn_deg)),
            (place.shift_mm[0] + self.shift_x_mm, place.shift_mm[1] + self.shift_y_mm),
        )

    @property
    def lower_face_mm(self) -> tuple[float, float]:
        """Shift of the lower face."""
        return self.lower_face_x_mm, self.lower_face_y_mm


@dataclass(frozen=True)
class Placed:
    """Head section and neck where they belong, and how they came there.

    Attributes
    ----------
    head
        The head section, its lower face shifted.
    motion
        Of the neck in the head section's own frame.
    head_angle_rad
        As in :class:`Observed`.
    shift
        What was moved by how much, found or given.
    found
        Standard deviations of what was found, by name, mm or degrees.
    residuals
        What was observed less what the shift explains, in standard deviations, by name.
    """

    head: HeadSection
    motion: RigidMotion
    head_angle_rad: float
    shift: Shift
    found: Mapping[str, float]
    residuals: Mapping[str, float]

    def about(self) -> dict[str, Any]:
        """Return the numbers for the summary; a sigma that nothing bounds is None."""
        return {
            **{name: getattr(self.shift, name) for name in UNKNOWNS},
            "found_with_sigma": {
                name: sigma if np.isfinite(sigma) else None for name, sigma in self.found.items()
            },
            "residuals_sigma": dict(self.residuals),
        }


def observed(scenario: Scenario, neck: NeckSection, head: HeadSection) -> Observed:
    """Return the neck's motion in the head section from the motion that the scenario names.

    How the camera stood must not matter, not even by rounding, which slip and instability
    would amplify: the motion is rounded to `ANGLE_DIGITS` and `PLACE_DIGITS`.

    Raises
    ------
    ScenarioError, MotionError
        If there is no motion file, or it is broken, or lacks the bodies' directions.
    """
    if scenario.motion is None:
        raise ScenarioError(
            f"scenario {scenario.name!r} has no motion yet: convert its recording first"
        )
    motion = Motion.read(scenario.motion.file)
    head_axis, package_axis = (
        _axis(body, scenario.motion.file) for body in (motion.head_body, motion.package_body)
    )
    marks = np.asarray(neck.upper_mark) - np.asarray(neck.lower_mark)
    nose = head.landmarks["nose"] - head.landmarks["ear"]
    head_angle = head_axis - _angle(nose)
    angle = motion.relative_rad + package_axis - _angle(marks)
    position = rotated(motion.relative_mm, -head_angle)
    placed = RigidMotion.of_reference_point(
        motion.time_s,
        np.round(angle - head_angle, ANGLE_DIGITS),
        np.round(position, PLACE_DIGITS),
        np.asarray(neck.lower_mark),
    )
    return Observed(placed, head_angle)


def place(scenario: Scenario, neck: NeckSection, head: HeadSection, seen: Observed) -> Placed:
    """Return head section and neck where the scenario's placement puts them.

    Parameters
    ----------
    scenario
        Its ``placement`` says what is given and what is found, its ``first_contact`` from what.
    neck, head
        The sections, each in its own frame.
    seen
        The recorded motion.

    Raises
    ------
    ScenarioError
        If a shift is to be found and nothing was observed, if no shift within the bounds explains
        what was, or if the lower face would be moved into the upper one.
    """
    settings = scenario.placement
    given = {name: getattr(settings, name) for name in UNKNOWNS}
    wanted = tuple(name for name, value in given.items() if value == "auto")
    start = Shift(**{name: 0.0 if name in wanted else value for name, value in given.items()})
    problem = _Fit(head, neck, seen, scenario.first_contact, start, wanted)
    if not wanted:
        return problem.placed(np.zeros(0))
    if not problem.observations:
        raise ScenarioError(
            f'placement.{wanted[0]} = "auto" needs something observed: give [first_contact] '
            "lower_time_s and upper_time_s, and the places where you saw them"
        )
    return problem.placed(_smallest(problem, settings))


def with_lower_face_moved(head: HeadSection, shift_mm: tuple[float, float]) -> HeadSection:
    """Return the head with lower lip, jaw and tooth shifted, mm along its axes.

    Raises
    ------
    ScenarioError
        If the lips would overlap.
    """
    if shift_mm == (0.0, 0.0):
        return head
    by = np.asarray(shift_mm)
    step = np.diff(head.profile, axis=0)
    below = int(np.argmax(np.hypot(*step.T))) + 1  # the gap between the lips is the longest step
    middle = 0.5 * (head.landmarks["stomion_upper"] + head.landmarks["stomion_lower"])[1]
    lower_names = {"jaw_front", "jaw_back", "lower_incisor", "stomion_lower", "lower_lip",
                   "labrale_inferius", "sulcus", "pogonion", "menton"}  # fmt: skip
    moved = replace(
        head,
        lower=replace(
            head.lower,
            curves={name: points + by for name, points in head.lower.curves.items()},
            focus=head.lower.focus + by,
        ),
        lower_tooth=head.lower_tooth.moved(0.0, by),
        lower_jaw=head.lower_jaw + by,
        mouth=np.where(head.mouth[:, 1:] < middle, head.mouth + by, head.mouth),
        profile=np.concatenate([head.profile[:below], head.profile[below:] + by]),
        landmarks={
            name: point + by if name in lower_names else point
            for name, point in head.landmarks.items()
        },
    )
    upper, lower = (
        shapely.union_all([shapely.Polygon(region) for region in lip.regions.values()])
        for lip in (moved.upper, moved.lower)
    )
    if upper.intersects(lower):
        raise ScenarioError(
            f"the lower face shifted by ({by[0]:.1f}, {by[1]:.1f}) mm overlaps the upper lip: "
            "shift it less, or open the jaw (head.jaw_opening_deg)"
        )
    return moved


@dataclass(frozen=True)
class _Fit:
    """The residuals of what was observed as a function of what is to be found."""

    head: HeadSection
    neck: NeckSection
    seen: Observed
    contact: FirstContact
    start: Shift
    wanted: tuple[str, ...]

    @cached_property
    def observations(self) -> tuple[str, ...]:
        """Names of what was observed."""
        names = [f"{lip}_{what}" for lip in LIPS for what in ("time_s", "place_mm")]
        return tuple(name for name in names if getattr(self.contact, name) is not None)

    @cached_property
    def skins(self) -> dict[str, tuple[Array, Array]]:
        """Points (p, 2), mm, of the skin of each lip near its margin, and their places (p,)."""
        skins = {}
        for lip in LIPS:
            line = LipSkin.of(self.head, lip)
            arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line.points, axis=0).T))])
            wanted = np.arange(0.0, arc[-1], SKIN_SPACING_MM)
            wanted = wanted[np.abs(wanted - line.margin_mm) < REACH_MM]
            points = np.column_stack([np.interp(wanted, arc, x) for x in line.points.T])
            skins[lip] = points, line.outwards * (wanted - line.margin_mm)
        return skins

    @cached_property
    def watched(self) -> dict[str, tuple[RigidPlacement, ...]]:
        """Where the recorded neck is when each lip is touched, and at instants before, by lip."""
        watched = {}
        for lip in LIPS:
            time = getattr(self.contact, f"{lip}_time_s")
            if time is not None:
                before = time - LOOK_BACK_S * np.arange(INSTANTS + 1) / INSTANTS
                watched[lip] = tuple(self.seen.neck.at(float(t)) for t in before)
        return watched

    @cached_property
    def gap_sigma(self) -> dict[str, float]:
        """Standard deviation of the gap at the observed instant, mm, by lip."""
        sigmas = {}
        for lip in self.watched:
            time, step = getattr(self.contact, f"{lip}_time_s"), self.contact.time_sigma_s
            places = tuple(self.seen.neck.at(time + dt) for dt in (-step, step))
            before, after = self._distances(lip, places, self.start).min(axis=1)
            speed = abs(after - before) / (2 * step)
            sigmas[lip] = float(np.hypot(self.contact.skin_sigma_mm, speed * step))
        return sigmas

    def shift(self, q: Array) -> Shift:
        """Return the movement that values of the unknowns make."""
        return replace(
            self.start, **{name: float(v) for name, v in zip(self.wanted, q, strict=True)}
        )

    def residuals(self, q: Array) -> Array:
        """Return (n,) residuals in standard deviations."""
        shift = self.shift(q)
        residuals = []
        for lip, places in self.watched.items():
            at_contact, nearest = self._nearest(lip, self._distances(lip, places[:1], shift)[0])
            before = self._distances(lip, places[1:], shift, every=THINNED)
            gap = min(at_contact, float(before.min()))
            residuals.append(gap / self.gap_sigma[lip])
            seen_at = getattr(self.contact, f"{lip}_place_mm")
            if seen_at is not None:
                residuals.append((nearest - seen_at) / self.contact.place_sigma_mm)
        return np.array(residuals)

    def chi_squared(self, q: Array) -> float:
        """Return the sum of the squared residuals."""
        return float(np.sum(self.residuals(q) ** 2))

    def explains(self, q: Array) -> bool:
        """Return whether what was observed is met as well as it is known."""
        return self.chi_squared(q) <= len(self.observations)

    def placed(self, q: Array) -> Placed:
        """Return head section and neck moved by values of the unknowns."""
        shift = self.shift(q)
        residuals = self.residuals(q)
        found = dict(zip(self.wanted, self._sigmas(q), strict=True)) if self.wanted else {}
        return Placed(
            with_lower_face_moved(self.head, shift.lower_face_mm),
            shift.moved(self.seen.neck),
            self.seen.head_angle_rad,
            shift,
            found,
            dict(zip(self.observations, map(float, residuals), strict=True)),
        )

    def jacobian(self, q: Array) -> Array:
        """Return the derivatives (n, m) of the residuals, by differences."""
        here = self.residuals(q)
        return np.column_stack(
            [(self.residuals(q + STEP * e) - here) / STEP for e in np.eye(q.size)]
        )

    def _sigmas(self, q: Array) -> list[float]:
        """Return standard deviations of what was found; infinite where nothing observed fixes it.

        They are those of the observations alone, the preference for small shifts is none, with
        derivatives over a finite step, because what is nearest to the lip changes by jumps.
        """
        steps = FINITE_STEP * np.eye(q.size)
        slopes = [
            (self.residuals(q + e) - self.residuals(q - e)) / (2 * FINITE_STEP) for e in steps
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
        """Return the distance (t, p), mm, of every so manieth point of the skin from the neck."""
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
        """Return the smallest of the skin's distances (p,), mm, and its place, by a parabola."""
        places = self.skins[lip][1]
        k = int(np.clip(np.argmin(distance), 1, len(distance) - 2))
        left, middle, right = distance[k - 1 : k + 2]
        bend = left - 2 * middle + right
        into = float(np.clip(0.5 * (left - right) / bend, -1.0, 1.0)) if bend > 0 else 0.0
        gap = middle - 0.25 * (left - right) * into
        return float(gap), float(places[k] + into * (places[k + 1] - places[k]))


def _smallest(problem: _Fit, settings: Placement) -> Array:
    """Return the smallest values of the unknowns that explain what was observed."""
    bound = np.array(
        [settings.at_most_deg if n == "turn_deg" else settings.at_most_mm for n in problem.wanted]
    )
    nothing = np.zeros(bound.size)
    if problem.explains(nothing):
        return nothing
    halfway = [sign * 0.5 * row for row in np.diag(bound) for sign in (-1, 1)]
    fits: list[Array] = []
    for start in (nothing, *halfway):
        fit = _fitted(problem, WEAKEST, start, bound)
        if all(np.linalg.norm(fit - other) > SAME for other in fits):
            fits.append(fit)
    explaining = [q for q in fits if problem.explains(q)]
    if not explaining:
        best = min(fits, key=problem.chi_squared)
        raise ScenarioError(_unexplained(problem, best, bound, settings))
    shrunk = [_shrunk(problem, q, bound) for q in explaining]
    return min(shrunk, key=lambda q: float(np.linalg.norm(q)))


def _fitted(problem: _Fit, strength: float, start: Array, bound: Array) -> Array:
    """Return the unknowns that minimise χ² + λ² |q|² near a start, λ being the ``strength``."""
    found = least_squares(
        lambda q: np.concatenate([problem.residuals(q), strength * q]),
        start,
        jac=lambda q: np.vstack([problem.jacobian(q), strength * np.eye(q.size)]),
        bounds=(-bound, bound),
        xtol=1e-6,
        ftol=1e-8,
    )
    return np.asarray(found.x)


def _shrunk(problem: _Fit, q: Array, bound: Array) -> Array:
    """Return the smallest unknowns on the branch of ``q`` that still explain what was observed."""
    weak, strong = float(np.log(WEAKEST)), np.inf
    while strong - weak > FINENESS:
        middle = weak + np.log(4.0) if np.isinf(strong) else 0.5 * (weak + strong)
        candidate = _fitted(problem, float(np.exp(middle)), q, bound)
        if problem.explains(candidate):
            weak, q = middle, candidate
        else:
            strong = middle
    return q


def _unexplained(problem: _Fit, q: Array, bound: Array, settings: Placement) -> str:
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


def _axis(body: MarkedBody, file: str) -> float:
    if body.axis_rad is None:
        raise ScenarioError(
            f"{file} does not say how {body.name} was turned in the first frame: make it with "
            f"drinksim convert, with two markers on {body.name}"
        )
    return body.axis_rad


def _angle(vector: Array) -> float:
    return float(np.arctan2(vector[1], vector[0]))
