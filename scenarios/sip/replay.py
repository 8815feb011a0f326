"""The replay of a sip: lips, neck and teeth from a scenario, followed from first touch to release.

`replay` writes nothing: it hands every committed increment to its caller.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.rigid import rigid_contacts, rigid_responses
from fem2d.loads.load import Load
from fem2d.solvers.commit import Commit
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import MarchResult, MarchStatus, march
from fem2d.solvers.model import Model
from fem2d.solvers.state import State
from fem2d.threads import Threads
from geometry2d.foundation.progress import Progress, Warn, no_progress, silent
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion, RigidPlacement
from scenarios.messages import lines
from scenarios.placing.carrying import CarriedNeck, carried
from scenarios.placing.placement import Placed, place
from scenarios.placing.recorded_motion import RecordedNeck, recorded_motion
from scenarios.results.increment import Increment, SectionModel
from scenarios.results.quantities import LIPS
from scenarios.results.recorder import Recorder, restored
from scenarios.results.solution import Solution
from scenarios.settings.inputs import check_inputs
from scenarios.settings.scenario import Scenario, ScenarioError
from scenarios.settings.searches import Period
from scenarios.sip.activation import FoundActivation, find_activations
from scenarios.sip.clearance import Approach
from scenarios.sip.findings import (
    Finding,
    Severity,
    findings_of,
    jaw_file_findings,
    jaw_findings,
    neck_findings,
)
from scenarios.sip.hand import about_hand, chosen_hand
from scenarios.sip.jaw import JawCourse
from scenarios.sip.lip_model import Lips
from scenarios.sip.lip_muscles import about_muscles
from scenarios.sip.measures import LipMeasures
from scenarios.sip.mesh_focus import focused_on_path
from scenarios.sip.pull import PullResult, find_pull
from scenarios.sip.tilted_liquid import tilted_liquid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """How a replay ended.

    Attributes
    ----------
    finished
        Whether the whole motion was replayed.
    messages
        What happened and what to mind, one thing each.
    about
        Numbers for the summary: sizes, largest penetration, energies.
    """

    finished: bool
    messages: tuple[str, ...]
    about: Mapping[str, Any]

    @property
    def message(self) -> str:
        """The messages in one line."""
        return "; ".join(self.messages)


@dataclass(frozen=True)
class Prepared:
    """All that a replay starts from: what is "auto" in the scenario is known.

    Attributes
    ----------
    lips
        The mechanical model.
    motion
        Of the neck in the frame of the head section.
    start_s, end_s
        The part of it that is replayed.
    placed, pull, activations
        How neck and lower face were placed, what pulls on a lip, and how active muscles were found
        to be.
    carried
        How the neck takes the place of the one that was filmed.
    findings
        What is odd about all this.
    """

    lips: Lips
    motion: RigidMotion
    start_s: float
    end_s: float
    placed: Placed
    pull: PullResult | None
    activations: tuple[FoundActivation, ...]
    carried: CarriedNeck
    findings: tuple[Finding, ...]

    def about(self) -> dict[str, Any]:
        """Return the numbers for the summary."""
        about: dict[str, Any] = {
            "placement": self.placed.about() | {"carried": self.carried.about()}
        }
        if self.findings:
            about["warnings"] = [str(finding) for finding in self.findings]
        if self.lips.tense is not None:
            about["skin"] = self.lips.tense.about()
        if self.lips.muscles:
            about["muscles"] = about_muscles(self.lips.muscles)
        if self.activations:
            about["activations"] = {each.muscle: each.about() for each in self.activations}
        return about if self.pull is None else about | {"muscle": self.pull.about()}


def prepared(
    scenario: Scenario,
    *,
    threads: Threads | None = None,
    activations: Sequence[FoundActivation] | None = None,
    warn: Warn = silent,
    progress: Progress = no_progress,
) -> Prepared:
    """Return the model and the motion of a scenario whose motion is known.

    Parameters
    ----------
    scenario
        With its ``motion`` set.
    threads
        That share the work, two by default; results are the same bits.
    activations
        What was found of its muscles before; searched if absent.
    progress
        Told what is being done.

    Raises
    ------
    ScenarioError
        If the motion is missing, contradicts head or neck, or never brings the neck near the lips,
        or if what is "auto" cannot be found.
    """
    progress(0.0, "placing the neck")
    there = placed_neck(scenario)
    placed, carried_neck, found = there.placed, there.carried, there.findings
    refuse_contradictions(found, warn)
    motion = carried_neck.motion
    jaw = scenario.head.jaw_course()
    course = None if jaw is None else JawCourse.of(jaw, placed.head.landmarks["hinge"])
    neck = scenario.package.section()
    reach_mm = scenario.numerics.mesh.neck_reach_mm
    if reach_mm is not None:
        placed = replace(placed, head=focused_on_path(placed.head, neck, motion, reach_mm))
    lips = Lips(scenario, placed.head, neck, jaw=course)
    pull = find_pull(lips, motion, threads=threads, progress=progress)
    if pull is not None:
        lips = lips.with_(pull=pull.pull)
    progress(0.0, "meshing the lips")
    start_s, end_s = _contact_period(lips.fem_model, motion, scenario.numerics.period)
    liquid = tilted_liquid(scenario, lips.neck, motion, placed.head_angle_rad)
    if liquid is not None:
        lips = lips.with_(liquid=liquid)
    if activations is None:
        # What was seen of the lips was seen with the neck that was filmed.
        with_filmed = lips.with_(neck=scenario.filmed_package.section())
        activations = find_activations(
            with_filmed, placed.motion, start_s, threads=threads, progress=progress
        )
    if scenario.muscles is not None:
        known = {found.muscle: found.activation for found in activations}
        lips = lips.with_(activations=scenario.muscles.activations(start_s, known))
        instants = [a.time_s[0] for a in lips.activations.values()]
        start_s = min(start_s, *instants) if instants else start_s
    if course is not None:
        start_s = min(start_s, course.opening_deg.time_s[0])
    if scenario.muscle is not None:
        start_s = min(start_s, scenario.muscle.instants_s[0])
        end_s = max(end_s, scenario.muscle.instants_s[-1])
    return Prepared(
        lips, motion, start_s, end_s, placed, pull, tuple(activations), carried_neck, found
    )


@dataclass(frozen=True)
class PlacedNeck:
    """Where head and neck are in a recorded motion.

    Attributes
    ----------
    placed
        How neck and lower face were placed.
    carried
        How the neck takes the place of the one that was filmed.
    approach
        Of the neck to the head.
    findings
        What is wrong or odd about it, errors first.
    """

    placed: Placed
    carried: CarriedNeck
    approach: Approach
    findings: tuple[Finding, ...]


def placed_neck(scenario: Scenario) -> PlacedNeck:
    """Return where head and neck are in the recorded motion, and what is wrong or odd about it.

    Raises
    ------
    ScenarioError
        If the motion is missing, or if what is "auto" cannot be found.
    """
    neck, filmed = scenario.package.section(), scenario.filmed_package.section()
    head = scenario.head.section()
    placed = place(scenario, filmed, head, recorded_motion(scenario, filmed, head))
    carried_neck = carried(placed.motion, filmed, neck, scenario.placement.anchor)
    approach = Approach(placed.head, neck, carried_neck.motion)
    found = findings_of(approach, filmed=filmed, recorded=RecordedNeck.of(scenario))
    return PlacedNeck(placed, carried_neck, approach, (*found, *jaw_file_findings(scenario.head)))


def neck_findings_of(scenario: Scenario) -> tuple[Finding, ...]:
    """Return what is wrong or odd about neck and head, before any motion is known."""
    neck, filmed = scenario.package.section(), scenario.filmed_package.section()
    return (
        *neck_findings(neck, filmed, RecordedNeck.of(scenario)),
        *jaw_findings(scenario.head.section()),
        *jaw_file_findings(scenario.head),
    )


def refuse_unusable(scenario: Scenario, warn: Warn = silent) -> None:
    """Check what can be known of a scenario without its motion: its files, its neck, its jaw.

    Raises
    ------
    DrinksimError
        As of :func:`check_inputs`; or if the neck contradicts the recording.
    """
    check_inputs(scenario)
    refuse_contradictions(neck_findings_of(scenario), warn)


def refuse_contradictions(found: Sequence[Finding], warn: Warn = silent) -> None:
    """Tell the warnings among findings, and raise :class:`ScenarioError` if there are errors."""
    for finding in found:
        if finding.severity is Severity.WARNING:
            warn(str(finding))
    errors = [str(finding) for finding in found if finding.severity is Severity.ERROR]
    if errors:
        raise ScenarioError("; ".join(errors))


def replay(
    scenario: Scenario,
    *,
    on_model: Callable[[SectionModel], None] = lambda model: None,
    on_increment: Callable[[Increment], None],
    resume_from: Increment | None = None,
    reference: Solution | None = None,
    threads: Threads | None = None,
    activations: Sequence[FoundActivation] | None = None,
    on_activations: Callable[[Sequence[FoundActivation]], None] = lambda found: None,
    warn: Warn = silent,
    progress: Progress = no_progress,
) -> Outcome:
    """Replay a scenario whose motion is known, and return how it went.

    Parameters
    ----------
    scenario
        With its ``motion`` set.
    on_model, on_increment
        Called with the undeformed section once, then with every committed increment.
    resume_from
        The last increment of an interrupted replay of the same scenario, with its checkpoint; the
        rest comes out bit for bit as if it had not been interrupted.
    reference
        The run whose forces the hand follows; needed unless it follows the film.
    threads
        That share the work, two by default; results are the same bits.
    activations, on_activations
        What was found of the muscles before, searched if absent; and what is called with it.
    warn
        Called with each thing that is odd, before anything is computed.
    progress
        Called with the share of the motion that is done.

    Raises
    ------
    ScenarioError
        If the motion is missing, or never brings the neck near the lips.
    SolutionError
        If ``resume_from`` is of another model.
    """
    ready = prepared(
        scenario, activations=activations, threads=threads, warn=warn, progress=progress
    )
    on_activations(ready.activations)
    model, motion, head_angle = ready.lips.fem_model, ready.motion, ready.placed.head_angle_rad
    steps, newton = scenario.numerics.steps, scenario.numerics.newton
    state = model.at_rest(
        Load.at(motion.at(ready.start_s), ready.start_s), next_step_s=steps.longest_s
    )
    resumed_at_s = None if resume_from is None else resume_from.time_s
    if resume_from is None:
        on_model(ready.lips.model(head_angle))
    else:
        state = restored(resume_from.checkpoint, resume_from.time_s, state)
    measures = LipMeasures(ready.lips, head_angle, motion)
    hand = chosen_hand(scenario, reference, head_angle)
    recorder = Recorder(
        measures.measured,
        start_s=ready.start_s,
        end_s=ready.end_s,
        head_angle_rad=head_angle,
        force_floor_n=newton.force_floor_n,
        resume_from=resume_from,
    )

    def commit(done: Commit) -> None:
        increment = recorder.increment(done)
        on_increment(increment)
        progress(increment.relative_time, f"{increment.time_s:.2f} s of the recording")

    result = march(
        model,
        motion,
        state,
        hand=hand,
        solver=fastest_solver(),
        end_s=ready.end_s,
        steps=steps,
        newton=newton,
        threads=threads,
        on_commit=commit,
    )
    body = ready.lips.body
    about = {
        "elements": len(body.tables.connectivity),
        "nodes": len(body.nodes),
        **recorder.extremes.about(),
        "unstable": [measures.located(passage) for passage in recorder.unstable],
        **ready.about(),
    }
    if reference is not None:
        about["hand"] = about_hand(scenario, reference)
    about["notes"] = list(_notes(ready, result, about))
    return Outcome(
        result.status is MarchStatus.FINISHED,
        _messages(ready, result, about, resumed_at_s),
        about,
    )


def _notes(ready: Prepared, result: MarchResult, about: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what to mind about the model and its motion, in the words of an engineer."""
    finished = result.status is MarchStatus.FINISHED
    model = ready.lips.fem_model
    mesh = ready.lips.scenario.numerics.mesh
    near = _neighbourhood(model, ready.lips.scenario.numerics.period.near_mm)
    left = not near(ready.motion.at(ready.end_s))
    caught = _touching(model, result.state) if finished and left else ()
    notes = (
        lines.placement_message(about["placement"]),
        lines.carried_message(about["placement"]["carried"]),
        lines.hand_message(about["hand"]) if "hand" in about else None,
        *about.get("warnings", ()),
        lines.skin_message(about["skin"]) if "skin" in about else None,
        lines.muscle_message(about["muscle"]) if "muscle" in about else None,
        lines.muscles_message(about["muscles"]) if "muscles" in about else None,
        lines.activations_message(about["activations"]) if "activations" in about else None,
        lines.crushed_message(about["largest_penetration_neck_mm"]),
        *(
            lines.mesh_message(lip, about, contact_mm=mesh.contact_mm, layer_mm=mesh.layer_mm)
            for lip in LIPS
        ),
        lines.caught_message(caught),
    )
    return tuple(note for note in notes if note)


def _messages(
    ready: Prepared, result: MarchResult, about: Mapping[str, Any], resumed_at_s: float | None
) -> tuple[str, ...]:
    """Return how a replay went, the solver's part first, and what to mind."""
    ending = lines.ending(
        result.status.value,
        increments=result.increments,
        iterations=result.iterations,
        cutbacks=result.cutbacks,
        resumed_at_s=resumed_at_s,
        stopped_at_s=None if result.status is MarchStatus.FINISHED else result.state.time_s,
        end_s=ready.end_s,
    )
    unstable = lines.unstable_message(about["unstable"])
    return (ending, *((unstable,) if unstable else ()), *about["notes"])


def _contact_period(model: Model, motion: RigidMotion, period: Period) -> tuple[float, float]:
    """Return when the neck comes near the undeformed lips, and when it has left them for good."""
    times = np.linspace(motion.time_s[0], motion.time_s[-1], 4 * motion.time_s.size)
    near = _neighbourhood(model, period.near_mm)
    first = next((k for k in range(len(times)) if near(motion.at(float(times[k])))), None)
    if first is None:
        raise ScenarioError(
            f"the neck never comes nearer than {period.near_mm:g} mm to a lip: check the marker "
            "file's scale, or shift the package with --set placement.shift_x_mm=…"
        )
    last = next(k for k in reversed(range(len(times))) if near(motion.at(float(times[k]))))
    return (
        float(times[max(first - 1, 0)]),
        float(min(times[min(last + 1, len(times) - 1)] + period.after_release_s, times[-1])),
    )


def _neighbourhood(model: Model, near_mm: float) -> Callable[[RigidPlacement], bool]:
    """Return what tells whether the neck is near the undeformed lips."""
    nothing = np.zeros_like(model.body.nodes)
    moving = [
        (pair.outline, pair.surface.positions(nothing).reshape(-1, 2))
        for pair in rigid_contacts(model.contacts)
        if pair.moving
    ]

    def touches(place: RigidPlacement, outline: Outline, skin: Array) -> bool:
        points = place.pull_back(skin)
        left, low, right, high = outline.box
        nearest = np.clip(points, (left, low), (right, high))
        points = points[np.all(np.abs(points - nearest) < near_mm, axis=1)]
        return len(points) > 0 and bool(np.min(outline.project(points).distance) < near_mm)

    def near(place: RigidPlacement) -> bool:
        return any(touches(place, outline, skin) for outline, skin in moving)

    return near


def _touching(model: Model, state: State) -> tuple[str, ...]:
    """Return the lips that touch the neck in a committed state."""
    touches = model.contact_responses(state.displacement, state.placement, state)
    pressed = [
        touch.contact.name
        for touch in rigid_responses(touches)
        if touch.contact.moving and touch.edges.size
    ]
    return tuple(lip for lip in LIPS if any(name.startswith(lip) for name in pressed))
