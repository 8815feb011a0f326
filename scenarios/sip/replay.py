"""The replay of a sip: lips, neck and teeth from a scenario, followed from first touch to release.

`replay` writes nothing: it hands every committed increment to its caller.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem2d.contact.rigid import ContactHistory, ContactResponse, RigidContact
from fem2d.contact.self_contact import SelfContactHistory
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import Commit, MarchStatus, StepSettings, march
from fem2d.solvers.model import System
from fem2d.solvers.newton import NewtonSettings
from fem2d.solvers.stability import Instability, Passage, passages_with
from fem2d.solvers.state import State
from geometry2d.rigid import UNMOVED, RigidMotion, RigidPlacement, rotated
from scenarios.results.solution import LIPS, ContactField, Increment, Model
from scenarios.settings.scenario import Scenario, ScenarioError
from scenarios.sip.lip_model import Lips
from scenarios.sip.measures import ContactLine, recovered_traction
from scenarios.sip.placement import Placed, observed, place
from scenarios.sip.pull import FoundPull, found_pull

Array = NDArray[np.float64]

NEAR_MM = 2.0
"""The replay starts when the neck comes this close to a lip, and ends when it has left again."""

AFTER_RELEASE_S = 0.2
"""How long the lips are followed after the neck has gone."""

CRUSHED_MM = 0.1
"""Penetration that no pressure a lip can carry explains: some 5 MPa."""


@dataclass(frozen=True)
class Outcome:
    """How a replay ended.

    Attributes
    ----------
    finished
        Whether the whole motion was replayed.
    sentence
        What happened, in words.
    about
        Numbers for the summary: sizes, largest penetration, energies.
    """

    finished: bool
    sentence: str
    about: Mapping[str, Any]


@dataclass(frozen=True)
class Prepared:
    """All that a replay starts from: what "auto" stood for is known.

    Attributes
    ----------
    lips
        The mechanical model.
    motion
        Of the neck in the frame of the head section.
    start_s, end_s
        The part of it that is replayed.
    placed, drawn
        How neck and lower face were placed, and what pulls on a lip.
    """

    lips: Lips
    motion: RigidMotion
    start_s: float
    end_s: float
    placed: Placed
    drawn: FoundPull | None

    def about(self) -> dict[str, Any]:
        """Return the numbers for the summary."""
        about = {"placement": self.placed.about()}
        return about if self.drawn is None else about | {"muscle": self.drawn.about()}


def prepared(
    scenario: Scenario, *, progress: Callable[[str], None] = lambda what: None
) -> Prepared:
    """Return the model and the motion of a scenario whose motion is known.

    Raises
    ------
    ScenarioError
        If the motion is missing, or never brings the neck near the lips, or if what is "auto"
        cannot be found.
    """
    neck, head = scenario.package.section(), scenario.head_section()
    progress("placing the neck")
    placed = place(scenario, neck, head, observed(scenario, neck, head))
    lips = Lips(scenario, placed.head, neck)
    drawn = found_pull(lips, placed.motion, progress=progress)
    if drawn is not None:
        lips = replace(lips, pull=drawn.pull)
    start_s, end_s = _contact_period(lips.system, placed.motion)
    if scenario.muscle is not None:
        start_s = min(start_s, scenario.muscle.instants_s[0])
        end_s = max(end_s, scenario.muscle.instants_s[-1])
    return Prepared(lips, placed.motion, start_s, end_s, placed, drawn)


def replay(
    scenario: Scenario,
    *,
    on_model: Callable[[Model], None] = lambda model: None,
    on_increment: Callable[[Increment], None],
    resume_from: Increment | None = None,
    steps: StepSettings | None = None,
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> Outcome:
    """Replay a scenario whose motion is known, and return how it went.

    Parameters
    ----------
    scenario
        With its ``motion`` set.
    on_model, on_increment
        Called with the undeformed section once, then with every committed increment.
    resume_from
        The last increment of an interrupted replay of the same scenario; the rest comes out bit
        for bit as if it had not been interrupted.
    steps
        How long steps are; the defaults are those of every reported result.
    progress
        Called with the share of the motion that is done.

    Raises
    ------
    ScenarioError
        If the motion is missing, or never brings the neck near the lips.
    """
    ready = prepared(scenario, progress=lambda what: progress(0.0, what))
    lips, motion, start_s, end_s = ready.lips, ready.motion, ready.start_s, ready.end_s
    progress(0.0, "meshing the lips")
    system = lips.system
    steps = replace(steps or StepSettings(), watch_stability=True)
    if resume_from is None:
        state = system.state_at_rest(start_s, motion.at(start_s), next_step_s=steps.longest_s)
        on_model(lips.model(ready.placed.head_angle_rad))
    else:
        state = _restored(resume_from, len(system.contacts), len(system.folds))
    recorder = _Recorder(lips, start_s, end_s, ready.placed.head_angle_rad, resume_from)

    def commit(done: Commit) -> None:
        increment = recorder.increment(done)
        on_increment(increment)
        progress(increment.relative_time, "following the neck")

    result = march(
        system,
        motion,
        state,
        solver=fastest_solver(),
        end_s=end_s,
        steps=steps,
        on_commit=commit,
    )
    finished = result.status is MarchStatus.FINISHED
    sentence = (
        f"{result.status.value} in {result.increments} increments "
        f"({result.iterations} iterations, {result.cutbacks} cutbacks)"
    )
    if resume_from is not None:
        sentence += f" since it was resumed at {resume_from.time_s:.3f} s"
    if not finished:
        sentence += f", stopped at {result.state.time_s:.3f} s of {end_s:.3f} s"
    sentence += f"; {ready.placed.sentence()}"
    if ready.drawn is not None:
        sentence += f"; {ready.drawn.sentence()}"
    about = recorder.about()
    sentence += recorder.unstable_in_words()
    sentence += crushed_in_words(about["largest_penetration_neck_mm"])
    if finished and not _neighbourhood(system)(motion.at(end_s)):
        sentence += hooked_in_words(_touching(system, result.state))
    return Outcome(finished, sentence, about | ready.about())


def crushed_in_words(deepest_mm: float) -> str:
    """Return that a lip was caught between neck and teeth if it was, to be added to a sentence."""
    if deepest_mm <= CRUSHED_MM:
        return ""
    return (
        f"; the neck went {deepest_mm:.2f} mm into a lip, as if driven into the teeth: do not "
        "trust what follows, and move the package with placement.shift_x_mm"
    )


def hooked_in_words(touching: tuple[str, ...]) -> str:
    """Return that lips are on a neck that has left them, to be added to a sentence."""
    if not touching:
        return ""
    lips = " and ".join(touching)
    return (
        f"; the {lips} lip still hung on the neck at the end, as if caught by the thread: a person "
        "would have let go, so do not trust what was drawn along"
    )


class _Recorder:
    """Turns commits into increments and remembers the extremes for the summary.

    What is computed in the frame of the head section is told in the head frame of the recording.
    What it remembers is kept with the state of each increment, so that a resumed replay goes on
    with it.
    """

    def __init__(
        self,
        lips: Lips,
        start_s: float,
        end_s: float,
        head_angle_rad: float,
        resume_from: Increment | None,
    ) -> None:
        self._lips = lips
        self._start_s, self._end_s = start_s, end_s
        self._head_angle_rad = head_angle_rad
        body = lips.body
        self._skin = {lip: lips.free_surface(lip) for lip in LIPS}
        self._dermis = np.concatenate([body.elements_of(f"{lip}_dermis") for lip in LIPS])
        self._extremes = dict.fromkeys(_EXTREMES, 0.0)
        self._unstable: tuple[Passage, ...] = ()
        self._last_s = start_s
        if resume_from is not None:
            kept = resume_from.state
            self._extremes = dict(zip(_EXTREMES, kept["extremes"].tolist(), strict=True))
            self._unstable = tuple(_passage(row) for row in kept["unstable"].tolist())
            self._last_s = resume_from.time_s

    def increment(self, commit: Commit) -> Increment:
        state, lips = commit.state, self._lips
        inside = lips.body.fields(state.displacement)
        volume = inside.volume / inside.volume.sum(axis=1, keepdims=True)
        strain = inside.log_strain
        lines = {lip: self._line(lip, commit) for lip in LIPS}
        history = {
            "dermis_min_log_strain": float(strain[self._dermis].min()),
            "dermis_max_log_strain": float(strain[self._dermis].max()),
            "dermis_max_mises_kpa": 1e3 * float(inside.von_mises[self._dermis].max()),
        }
        for lip, line in lines.items():
            force = self._told(self._force_on_neck(lip, commit))
            history |= {
                f"{lip}_lip_pressure_kpa": 1e3 * line.top_two_edges(),
                f"{lip}_lip_window_kpa": 1e3 * line.highest_window(),
                f"{lip}_lip_contact_mm": line.contact_length(),
                f"{lip}_lip_force_x_n": float(force[0]),
                f"{lip}_lip_force_y_n": float(force[1]),
            }
        self._remember(commit)
        x, y = self._told(state.placement.shift_mm).tolist()
        return Increment(
            time_s=state.time_s,
            relative_time=(state.time_s - self._start_s) / (self._end_s - self._start_s),
            placement=RigidPlacement(state.placement.angle_rad + self._head_angle_rad, (x, y)),
            displacement=self._told(state.displacement),
            element={
                "log_strain_min": np.sum(volume * strain.min(axis=-1), axis=1),
                "log_strain_max": np.sum(volume * strain.max(axis=-1), axis=1),
                "von_mises_mpa": np.sum(volume * inside.von_mises, axis=1),
            },
            contact={lip: self._field(lip, commit) for lip in LIPS},
            history=history,
            newton_iterations=commit.newton.iterations,
            cutbacks=commit.cutbacks,
            state=_kept(state)
            | {
                "extremes": np.array([self._extremes[name] for name in _EXTREMES]),
                "unstable": np.array([_row(p) for p in self._unstable]).reshape(-1, 7),
            },
        )

    def _told(self, vectors: ArrayLike) -> Array:
        """Return vectors (..., 2) in the head frame of the recording."""
        return rotated(vectors, self._head_angle_rad)

    def about(self) -> dict[str, Any]:
        body = self._lips.body
        return {
            "elements": len(body.tables.connectivity),
            "nodes": len(body.nodes),
            **self._extremes,
            "unstable": [
                {
                    "from_s": passage.start_s,
                    "to_s": passage.end_s,
                    "modes": passage.worst.modes,
                    "lip": (place := self._place_on_skin(passage.worst))[0],
                    "arc_mm": place[1],
                    "x_mm": float((at := self._told(passage.worst.place_mm))[0]),
                    "y_mm": float(at[1]),
                }
                for passage in self._unstable
            ],
        }

    def unstable_in_words(self) -> str:
        """Return when and where the equilibrium was unstable, to be added to a sentence."""
        if not self._unstable:
            return ""
        longest = max(self._unstable, key=lambda passage: passage.end_s - passage.start_s)
        lip, arc = self._place_on_skin(longest.worst)
        x, y = self._told(longest.worst.place_mm)
        count = len(self._unstable)
        times = "once" if count == 1 else f"{count} times, longest"
        return (
            f"; the equilibrium was unstable {times} from {longest.start_s:.3f} to "
            f"{longest.end_s:.3f} s, most of all the {lip} lip {arc:.1f} mm along its surface "
            f"({x:.1f}, {y:.1f} mm), and was passed with inertia"
        )

    def _place_on_skin(self, instability: Instability) -> tuple[str, float]:
        """Return the lip of an instability, and the arc length of the skin that is nearest, mm."""
        body = self._lips.body
        nearest: list[tuple[float, str, float]] = []
        for lip in LIPS:
            skin = self._lips.free_surface(lip)
            away = skin.positions(np.zeros_like(body.nodes)) - body.nodes[instability.node]
            distance = np.linalg.norm(away, axis=-1)
            at = np.unravel_index(np.argmin(distance), distance.shape)
            nearest.append((float(distance[at]), lip, float(skin.arc_length[at])))
        _, lip, arc = min(nearest)
        return lip, arc

    def _pairs(self, lip: str, commit: Commit) -> list[tuple[RigidContact, ContactResponse]]:
        system = self._lips.system
        return [
            (pair, touch)
            for pair, touch in zip(system.contacts, commit.contacts, strict=True)
            if pair.moving and pair.name.startswith(lip)
        ]

    def _line(self, lip: str, commit: Commit) -> ContactLine:
        pairs, skin = self._pairs(lip, commit), self._skin[lip]
        load = np.sum([p.surface.carried(t.points.pressure) for p, t in pairs], axis=0)
        length = skin.weight * skin.stretch(commit.state.displacement)
        position = pairs[0][0].surface.positions(commit.state.displacement).reshape(-1, 2)
        steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
        gap = np.min([touch.points.gap for _, touch in pairs], axis=0)
        place = np.concatenate([[0.0], np.cumsum(steps)]).reshape(gap.shape)
        thickness = skin.thickness_mm
        return ContactLine(load / thickness, length / thickness, place, gap)

    def _force_on_neck(self, lip: str, commit: Commit) -> Array:
        force = np.zeros(2)
        for _, touch in self._pairs(lip, commit):
            force -= touch.force.reshape(-1, 2).sum(axis=0)
        return force

    def _field(self, lip: str, commit: Commit) -> ContactField:
        pairs, skin = self._pairs(lip, commit), self._skin[lip]
        deformed = skin.weight * skin.stretch(commit.state.displacement)
        gaps = [pair.surface.nodal(touch.points.gap) for pair, touch in pairs]
        nearest = np.argmin(gaps, axis=0)

        def chosen(name: str) -> Array:
            values = np.stack([p.surface.nodal(getattr(t.points, name)) for p, t in pairs])
            taken: Array = np.take_along_axis(values, nearest[None], axis=0)[0]
            return taken

        # A node that two edges share is a point of both and carries what both give it.
        place, first, node = np.unique(skin.arc_length, return_index=True, return_inverse=True)

        def traction(name: str) -> Array:
            carried = [p.surface.carried(getattr(t.points, name)) for p, t in pairs]
            force = np.zeros(len(place))
            np.add.at(force, node.ravel(), np.sum(carried, axis=0).ravel())
            return recovered_traction(force, deformed.sum(axis=1))

        pressure = traction("pressure")
        return ContactField(
            arc_mm=place,
            pressure_mpa=pressure,
            shear_mpa=traction("shear"),
            gap_mm=chosen("gap").ravel()[first],
            neck_arc_mm=np.where(pressure > 0, chosen("outline_arc").ravel()[first], np.nan),
        )

    def _remember(self, commit: Commit) -> None:
        system = self._lips.system
        self._unstable = passages_with(
            self._unstable, self._last_s, commit.state.time_s, commit.instability
        )
        self._last_s = commit.state.time_s
        seen = dict.fromkeys(_EXTREMES, 0.0)
        for pair, touch in zip(system.contacts, commit.contacts, strict=True):
            placement = commit.state.placement if pair.moving else UNMOVED
            name = f"largest_penetration_{'neck' if pair.moving else 'teeth'}_mm"
            seen[name] = max(seen[name], -float(np.min(touch.points.gap)))
            between = pair.deepest(commit.state.displacement, placement, touch)
            name = "largest_penetration_between_nodes_mm"
            seen[name] = max(seen[name], between)
        for fold in commit.folds:
            overlap = -float(np.min(fold.points.gap[fold.touching], initial=0.0))
            seen["largest_penetration_lips_mm"] = max(seen["largest_penetration_lips_mm"], overlap)
        seen["largest_strain_energy_nmm"] = commit.energies.strain
        seen["largest_kinetic_energy_nmm"] = commit.energies.kinetic
        if commit.newton.force_scale > NewtonSettings().force_floor_n:
            seen["largest_unbalanced_force_share"] = commit.newton.imbalance
        self._extremes = {name: max(self._extremes[name], seen[name]) for name in _EXTREMES}


_EXTREMES = (
    "largest_penetration_neck_mm",
    "largest_penetration_teeth_mm",
    "largest_penetration_between_nodes_mm",
    "largest_penetration_lips_mm",
    "largest_unbalanced_force_share",
    "largest_strain_energy_nmm",
    "largest_kinetic_energy_nmm",
)


def _row(passage: Passage) -> list[float]:
    worst = passage.worst
    return [
        passage.start_s,
        passage.end_s,
        worst.modes,
        *worst.place_mm,
        worst.node,
        worst.participation,
    ]


def _passage(row: list[float]) -> Passage:
    start, end, modes, x, y, node, participation = row
    return Passage(start, end, Instability(int(modes), (x, y), int(node), participation))


def _contact_period(system: System, motion: RigidMotion) -> tuple[float, float]:
    """Return when the neck comes near the undeformed lips, and when it has left them for good."""
    times = np.linspace(motion.time_s[0], motion.time_s[-1], 4 * motion.time_s.size)
    near = _neighbourhood(system)
    first = next((k for k in range(len(times)) if near(motion.at(float(times[k])))), None)
    if first is None:
        raise ScenarioError(
            f"the neck never comes nearer than {NEAR_MM:g} mm to a lip: check the marker file's "
            "scale, or shift the package with --set placement.shift_x_mm=…"
        )
    last = next(k for k in reversed(range(len(times))) if near(motion.at(float(times[k]))))
    return (
        float(times[max(first - 1, 0)]),
        float(min(times[min(last + 1, len(times) - 1)] + AFTER_RELEASE_S, times[-1])),
    )


def _neighbourhood(system: System) -> Callable[[RigidPlacement], bool]:
    """Return what tells whether the neck is near the undeformed lips."""
    nothing = np.zeros_like(system.body.nodes)
    moving = [
        (pair.outline, pair.surface.positions(nothing).reshape(-1, 2))
        for pair in system.contacts
        if pair.moving
    ]

    def near(place: RigidPlacement) -> bool:
        return any(
            np.min(outline.project(place.pull_back(skin)).distance) < NEAR_MM
            for outline, skin in moving
        )

    return near


def _touching(system: System, state: State) -> tuple[str, ...]:
    """Return the lips that touch the neck in a committed state."""
    touches = system.contact_responses(state.displacement, state.placement, state)
    pressed = [
        pair.name
        for pair, touch in zip(system.contacts, touches, strict=True)
        if pair.moving and touch.edges.size
    ]
    return tuple(lip for lip in LIPS if any(name.startswith(lip) for name in pressed))


def _kept(state: State) -> dict[str, Array]:
    kept = {
        "placement": np.array([state.placement.angle_rad, *state.placement.shift_mm]),
        "displacement": state.displacement,
        "velocity": state.velocity,
        "acceleration": state.acceleration,
        "next_step_s": np.array(state.next_step_s),
    }
    for number, history in enumerate(state.histories):
        kept[f"body_position_{number}"] = history.body_position
        kept[f"traction_{number}"] = history.traction
    for number, fold in enumerate(state.fold_histories):
        kept |= {f"fold_{number}_{item.name}": getattr(fold, item.name) for item in fields(fold)}
    return kept


def _restored(increment: Increment, pairs: int, folds: int) -> State:
    kept = increment.state
    angle, x, y = kept["placement"].tolist()
    return State(
        increment.time_s,
        RigidPlacement(angle, (x, y)),
        kept["displacement"],
        kept["velocity"],
        kept["acceleration"],
        tuple(
            ContactHistory(kept[f"body_position_{n}"], kept[f"traction_{n}"]) for n in range(pairs)
        ),
        float(kept["next_step_s"]),
        tuple(
            SelfContactHistory(
                **{f.name: kept[f"fold_{n}_{f.name}"] for f in fields(SelfContactHistory)}
            )
            for n in range(folds)
        ),
    )
