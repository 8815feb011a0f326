"""How a person meets a neck: at his or her own lips.

A recording shows the path of one package to one face. Another face has its lips elsewhere. A person
brings the rim to the lips, so the whole path is shifted: at first contact with the lower lip, the
lower edge of the rim comes to the same place on the skin of the person's lower lip (arc length from
the margin) that it comes to on the filmed face. Directions in the head's natural position stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.anthropometry import HeadMeasurements
from geometry2d.anatomy.head import HeadSection
from geometry2d.curves import at_arc_lengths, nearest_arc_length
from mocap.motion.motion import Motion
from scenarios.placing.lip_skin import LipSkin
from scenarios.placing.placement import place
from scenarios.placing.recorded_motion import recorded_motion
from scenarios.placing.shift import UNKNOWNS, Shift, with_lower_face_moved
from scenarios.settings.person import Head
from scenarios.settings.scenario import Scenario
from scenarios.sip.clearance import Approach

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Meeting:
    """Where the filmed rim meets the filmed lower lip.

    Attributes
    ----------
    scenario
        The filmed sip with the filmed neck, its placement known in numbers.
    motion
        Its motion.
    shift
        What its placement moves.
    time_s
        First contact of the neck with the undeformed lower lip, or closest approach, s.
    place_mm
        Place on the lower lip's skin that is nearest to the rim's lower edge then, from the margin.
    skin_mm
        (2,) that place in the head section.
    nose_rad
        Direction of the nose's marker from the ear in the head section.
    """

    scenario: Scenario
    motion: Motion
    shift: Shift
    time_s: float
    place_mm: float
    skin_mm: tuple[float, float]
    nose_rad: float

    @classmethod
    def of(cls, scenario: Scenario) -> Meeting:
        """Return the meeting of the sip of a scenario whose motion is known.

        Raises
        ------
        ScenarioError
            If its placement cannot be found.
        """
        neck, head = scenario.package.section(), scenario.head.section()
        placed = place(scenario, neck, head, recorded_motion(scenario, neck, head))
        approach = Approach(placed.head, neck, placed.motion)
        times, places = approach.time_s, approach.placements
        gap = approach.gaps_mm["lower"]
        first = int(np.argmax(gap <= 0)) if np.any(gap <= 0) else int(np.argmin(gap))
        rim = places[first].apply(neck.rim_edge("lower"))
        skin = LipSkin.of(placed.head, "lower")
        arc = nearest_arc_length(skin.points, rim)
        at = at_arc_lengths(skin.points, arc)
        return cls(
            scenario=scenario.with_(
                placement={name: getattr(placed.shift, name) for name in UNKNOWNS},
                first_contact=None,
            ),
            motion=scenario.known_motion(),
            shift=placed.shift,
            time_s=float(times[first]),
            place_mm=skin.place_mm(arc),
            skin_mm=(float(at[0]), float(at[1])),
            nose_rad=direction_of_nose(placed.head),
        )

    def met_by(self, measurements: HeadMeasurements) -> Scenario:
        """Return the filmed sip with another head, its lower lip where the rim comes.

        Raises
        ------
        DrinksimError
            If the measurements make no head, or its lips overlap.
        """
        head = Head(measurements=measurements)
        section = with_lower_face_moved(head.section(), self.shift.lower_face_mm)
        skin = LipSkin.of(section, "lower")
        here = at_arc_lengths(skin.points, skin.arc_mm(self.place_mm))
        by = np.asarray(here) - np.asarray(self.skin_mm)
        shift = {
            "shift_x_mm": self.shift.shift_x_mm + float(by[0]),
            "shift_y_mm": self.shift.shift_y_mm + float(by[1]),
        }
        return self.scenario.with_(head=head, placement=shift)

    def motion_for(self, nose_rad: float, motion: Motion | None = None) -> Motion:
        """Return a motion of the filmed sip as a head has it that looks the same way.

        A recording knows a head by the direction from ear to nose, which differs among faces that
        are held alike.

        Parameters
        ----------
        nose_rad
            Direction of that head's nose from its ear; see :func:`direction_of_nose`.
        motion
            By default the measured one.
        """
        seen = self.motion if motion is None else motion
        body = seen.head_body
        assert body.axis_rad is not None  # placing the filmed head needed it
        axis = body.axis_rad + nose_rad - self.nose_rad
        return seen.with_(head_body=replace(body, axis_rad=axis))


def direction_of_nose(head: HeadSection) -> float:
    """Return the direction of the nose's marker from the ear in a head section, rad."""
    x, y = head.landmarks["nose"] - head.landmarks["ear"]
    return float(np.arctan2(y, x))
