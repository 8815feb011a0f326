"""The outputs of a replay by name: what they are and in which unit."""

from __future__ import annotations

from dataclasses import dataclass

LIPS = ("upper", "lower")
WALLS = ("upper_wall", "lower_wall")
"""The outlines of a neck that lips touch."""
IN_NECK_FRAME = (*WALLS, "package")
"""The outlines of a model that move with the neck."""
WITH_JAW = ("lower_tooth", "lower_jaw")
"""Those that go with the lower jaw."""
JAW_HINGE = "jaw_hinge"
"""The point about which a jaw turns, among the outlines of a model whose jaw does."""


@dataclass(frozen=True)
class Quantity:
    """Name, unit and meaning of one output."""

    name: str
    unit: str
    meaning: str

    @property
    def label(self) -> str:
        """Name and unit, as an axis of a plot is called."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


HISTORY = (
    Quantity("time_s", "s", "time of the recording"),
    Quantity("relative_time", "", "0 at the start of the replay, 1 at its end"),
    Quantity("package_x_mm", "mm", "lower mark of the neck in the head frame, forward"),
    Quantity("package_y_mm", "mm", "lower mark of the neck in the head frame, up"),
    Quantity("package_theta_deg", "deg", "turn of the neck in the head frame"),
    Quantity("dermis_min_log_strain", "", "smallest principal logarithmic strain in the dermis"),
    Quantity("dermis_max_log_strain", "", "largest principal logarithmic strain in the dermis"),
    Quantity("dermis_max_mises_kpa", "kPa", "largest von Mises stress in the dermis"),
    Quantity("upper_lip_pressure_kpa", "kPa", "mean of the two most pressed surface elements"),
    Quantity("lower_lip_pressure_kpa", "kPa", "mean of the two most pressed surface elements"),
    Quantity("upper_lip_window_kpa", "kPa", "highest mean pressure over 0.5 mm of deformed lip"),
    Quantity("lower_lip_window_kpa", "kPa", "highest mean pressure over 0.5 mm of deformed lip"),
    Quantity("upper_lip_contact_mm", "mm", "deformed length of lip within 0.005 mm of the neck"),
    Quantity("lower_lip_contact_mm", "mm", "deformed length of lip within 0.005 mm of the neck"),
    Quantity("upper_lip_force_x_n", "N", "force of the upper lip on the neck, forward"),
    Quantity("upper_lip_force_y_n", "N", "force of the upper lip on the neck, up"),
    Quantity("lower_lip_force_x_n", "N", "force of the lower lip on the neck, forward"),
    Quantity("lower_lip_force_y_n", "N", "force of the lower lip on the neck, up"),
    Quantity("newton_iterations", "", "iterations of this increment, rejected trials included"),
    Quantity("cutbacks", "", "times this increment was cut back"),
    Quantity("upper_lip_force_n", "N", "size of the upper lip's force on the neck"),
    Quantity("lower_lip_force_n", "N", "size of the lower lip's force on the neck"),
    Quantity("upper_lip_mean_kpa", "kPa", "mean pressure over the touched length"),
    Quantity("lower_lip_mean_kpa", "kPa", "mean pressure over the touched length"),
    Quantity("upper_lip_window_1mm_kpa", "kPa", "highest mean pressure over 1 mm"),
    Quantity("lower_lip_window_1mm_kpa", "kPa", "highest mean pressure over 1 mm"),
    Quantity("upper_lip_window_1_5mm_kpa", "kPa", "highest mean pressure over 1.5 mm"),
    Quantity("lower_lip_window_1_5mm_kpa", "kPa", "highest mean pressure over 1.5 mm"),
    Quantity("upper_lip_crest_contrast", "", "how much crests stand out of the pressure, 0 to 1"),
    Quantity("lower_lip_crest_contrast", "", "how much crests stand out of the pressure, 0 to 1"),
    Quantity("neck_moment_nmm", "N mm", "moment of both lips on the neck about its lower mark"),
    Quantity(
        "neck_off_film_mm", "mm", "distance of the neck's lower mark from where it was filmed"
    ),
    Quantity("neck_off_film_deg", "deg", "turn of the neck beyond that of the film"),
    Quantity("upper_lip_seal_kpa", "kPa", "highest pressure over 0.5 mm beyond the liquid's"),
    Quantity("lower_lip_seal_kpa", "kPa", "highest pressure over 0.5 mm beyond the liquid's"),
    Quantity("liquid_kpa", "kPa", "head of the liquid at the rim's lower edge; 0 where it is dry"),
)
"""The columns of history.csv, in order."""

ELEMENT_FIELDS = (
    Quantity("log_strain_min", "", "smallest principal logarithmic strain, element mean"),
    Quantity("log_strain_max", "", "largest principal logarithmic strain, element mean"),
    Quantity("von_mises_mpa", "MPa", "von Mises stress, element mean"),
    Quantity("thickness_stretch", "", "stretch across the section, element mean"),
    Quantity("activation", "", "of the muscle fibres in the element, 0 where there are none"),
)
LATER_FIELDS = ("thickness_stretch", "activation")
"""Those of them that a run of an earlier version lacks."""

CONTACT_FIELDS = (
    Quantity("pressure_mpa", "MPa", "contact pressure of the neck on the lip"),
    Quantity("shear_mpa", "MPa", "contact shear of the neck on the lip"),
    Quantity("gap_mm", "mm", "distance to the neck, negative where they overlap"),
    Quantity("neck_arc_mm", "mm", "place on the outline of the wall that is touched, or nan"),
)
