"""A small movement of the package and of the lower face in the head section."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely

from geometry2d.anatomy.head import HeadSection
from geometry2d.rigid import RigidMotion, RigidPlacement
from scenarios.settings.scenario import ScenarioError

UNKNOWNS = ("shift_x_mm", "shift_y_mm", "turn_deg", "lower_face_x_mm", "lower_face_y_mm")


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
        """Return a placement ``place`` of the recorded neck, shifted and turned."""
        # The lower mark is the origin of the neck frame: turned about it, the shift stays.
        return RigidPlacement(
            place.angle_rad + float(np.deg2rad(self.turn_deg)),
            (place.shift_mm[0] + self.shift_x_mm, place.shift_mm[1] + self.shift_y_mm),
        )

    @property
    def lower_face_mm(self) -> tuple[float, float]:
        """Shift of the lower face."""
        return self.lower_face_x_mm, self.lower_face_y_mm


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
    below = int(np.argmax(np.hypot(*step.T))) + 1  # from lip to lip is the longest step
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
