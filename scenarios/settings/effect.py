"""Keys that have no effect because of the values of others.

What a drawing or a preset replaces is not among them: :mod:`scenarios.settings.layers` sees to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mocap.motion.motion import Motion
from scenarios.settings.hand import HandSettings
from scenarios.settings.motion import FirstContact, MotionFile, Placement
from scenarios.settings.muscles import NAMES, Muscles
from scenarios.settings.numerics import Numerics
from scenarios.settings.person import Head, Muscle
from scenarios.settings.searches import ActivationSearch, PullSearch
from scenarios.settings.tables import keys_of

FITTING = ("difference", "uncertainty_difference", "weakest", "same", "fineness")
MEASURING = ("skin_spacing_mm", "reach_mm", "look_back_s", "instants", "thinning")
"""Keys of [numerics.shift_search] that the search for a shift needs, and those that measuring
first contacts needs."""

SEEN_KEYS = {
    "clears": ("clearance_mm",),
    "reaches": ("lower_reach_mm", "reach_time_s"),
    "seals": ("seal_time_s", "seal_kpa"),
}
"""Keys of [muscles.seen], by what they say of a lip."""

SHIFTS = ("shift_x_mm", "shift_y_mm", "lower_face_x_mm", "lower_face_y_mm")


@dataclass(frozen=True)
class Ineffective:
    """Keys without effect.

    Attributes
    ----------
    keys
        Their paths.
    because
        Paths of the keys that make them so.
    reason
        Why, to be put behind the key.
    """

    keys: tuple[str, ...]
    because: tuple[str, ...]
    reason: str


def ineffective_keys(
    *,
    motion: MotionFile | Motion | None,
    placement: Placement,
    first_contact: FirstContact,
    hand: HandSettings,
    muscle: Muscle | None,
    muscles: Muscles | None,
    head: Head,
    numerics: Numerics,
) -> Iterator[Ineffective]:
    """Yield the keys that have no effect beside these tables, whatever their values."""
    yield from _of_motion(motion)
    yield from _of_placement(placement, first_contact)
    yield from _of_hand(hand)
    yield from _of_muscle(muscle)
    yield from _of_muscles(muscles)
    yield from _of_head(head)
    yield from _of_numerics(numerics)


def _of_motion(motion: MotionFile | Motion | None) -> Iterator[Ineffective]:
    if motion is not None:
        yield Ineffective(
            ("recording.start_s", "recording.end_s"),
            ("motion.file",),
            "as the motion is given: leave it out, or convert that part of the recording anew",
        )


def _of_hand(hand: HandSettings) -> Iterator[Ineffective]:
    springs = ("hand.stiffness_n_per_m", "hand.turning_stiffness_nm_per_rad")
    if hand.mode == "recorded":
        keys = (
            *springs,
            "hand.reference",
            "hand.reference_scenario",
            "hand.width_mm",
            "hand.damping_n_s_per_m",
        )
        yield Ineffective(keys, ("hand.mode",), "as the neck follows the film: set hand.mode")
    if hand.mode == "force":
        yield Ineffective(
            springs, ("hand.mode",), "as forces are held: a hand of springs is 'same'"
        )


def _of_placement(placement: Placement, seen: FirstContact) -> Iterator[Ineffective]:
    if "auto" not in [getattr(placement, name) for name in (*SHIFTS, "turn_deg")]:
        yield Ineffective(
            tuple(f"numerics.shift_search.{name}" for name in FITTING),
            tuple(f"placement.{name}" for name in (*SHIFTS, "turn_deg")),
            'as nothing in [placement] is "auto"',
        )
    shifts = tuple(f"placement.{name}" for name in SHIFTS)
    if "auto" not in [getattr(placement, name) for name in SHIFTS]:
        yield Ineffective(("placement.at_most_mm",), shifts, 'as no shift is "auto"')
    if placement.turn_deg != "auto":
        yield Ineffective(
            ("placement.at_most_deg",), ("placement.turn_deg",), 'as turn_deg is not "auto"'
        )
    times = ("first_contact.lower_time_s", "first_contact.upper_time_s")
    places = ("first_contact.lower_place_mm", "first_contact.upper_place_mm")
    if not seen.observed:
        yield Ineffective(
            (
                "first_contact.time_sigma_s",
                "first_contact.skin_sigma_mm",
                *(f"numerics.shift_search.{name}" for name in MEASURING),
            ),
            times,
            "as no first contact is given",
        )
    if seen.lower_place_mm is None and seen.upper_place_mm is None:
        yield Ineffective(
            ("first_contact.place_sigma_mm",), places, "as no place of first contact is given"
        )


def _of_muscle(muscle: Muscle | None) -> Iterator[Ineffective]:
    if muscle is None:
        yield Ineffective(
            tuple(key.path for key in keys_of(PullSearch, where="numerics.pull_search")),
            ("muscle",),
            "as there is no [muscle]",
        )
    if muscle is not None and "auto" not in (muscle.traction_kpa, muscle.direction_deg):
        yield Ineffective(
            ("muscle.clearance_mm",),
            ("muscle.traction_kpa", "muscle.direction_deg"),
            "as traction_kpa and direction_deg are numbers",
        )


def _of_muscles(muscles: Muscles | None) -> Iterator[Ineffective]:
    automatic = () if muscles is None else muscles.automatic
    names = tuple(f"muscles.{name}" for name in NAMES)
    if not automatic:
        search = keys_of(ActivationSearch, where="numerics.activation_search")
        keys = tuple(key.path for key in search)
        yield Ineffective(keys, ("muscles", *names), 'as nothing in [muscles] is "auto"')
    if muscles is None:
        return
    decisive = {muscles.observation(name) for name in automatic}
    for observation, keys in SEEN_KEYS.items():
        if observation not in decisive:
            paths = tuple(f"muscles.seen.{key}" for key in keys)
            yield Ineffective(paths, names, 'as no muscle that it would decide over is "auto"')


def _of_head(head: Head) -> Iterator[Ineffective]:
    measured = head.measurements
    if head.jaw is not None:
        yield Ineffective(
            ("head.jaw_opening_deg",), ("head.jaw.opening_deg",), "as [head.jaw] tells it"
        )
    places = tuple(
        f"{place}_dermis_mm" for place in ("nose", "philtrum", "fold", "chin", "submental")
    )
    if None not in [getattr(measured, name) for name in places]:
        yield Ineffective(
            ("head.dermis_thickness_mm",),
            tuple(f"head.{name}" for name in places),
            "as all five places have a thickness of their own",
        )


def _of_numerics(numerics: Numerics) -> Iterator[Ineffective]:
    if not numerics.inertia.is_dynamic:
        yield Ineffective(
            ("numerics.inertia.spectral_radius",),
            ("numerics.inertia.density_tonne_per_mm3", "numerics.inertia.relaxation_s"),
            "as nothing resists motion",
        )
