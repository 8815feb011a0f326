"""Named soft-tissue measurements of a head and the landmarks of a closed face.

Cephalometry measures a face relative to subnasale, where nose and lip meet: projections are
horizontal distances from the true vertical through subnasale, heights are vertical distances. All
defaults describe an adult man: the recorded person of the thesis is a man. All lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import check_ranges, measured

Array = NDArray[np.float64]

ARNETT = "Arnett et al. 1999, men; not checked against the printed table"
CELEBI = "Celebi 2013, men"
ESTIMATE = "estimate for an adult man"


class HeadError(DrinksimError):
    """Measurements that describe no head."""


@dataclass(frozen=True)
class HeadMeasurements:
    """Named measurements of a head; the metadata of each field are unit, source and meaning.

    If the source states a standard deviation, the metadata hold it as ``spread``.
    """

    # Where the face hangs on the jaw's hinge.
    hinge_forward_mm: float = measured(
        11.5, "mm", "10-13 mm, general anatomy", "hinge axis of the jaw, from tragus to eye corner"
    )
    hinge_above_deg: float = measured(
        10.0, "deg", ESTIMATE, "direction tragus to outer eye corner, above horizontal"
    )
    hinge_incisor_mm: float = measured(
        90.9,
        "mm",
        "Bonwill triangle of side 105 mm, seen from the side: 105·√3/2",
        "hinge axis to the edge of the lower incisor",
        above=0.0,
    )
    hinge_incisor_below_deg: float = measured(
        34.0,
        "deg",
        "Balkwill angle 22-26° and an occlusal plane falling forward by 10°",
        "direction hinge to lower incisor, below horizontal, teeth closed",
    )
    ear_nose_mm: float = measured(
        104.3,
        "mm",
        "the recordings' [scale] head",
        "ear marker to the marker beside the nose tip",
        above=0.0,
    )
    # Profile, horizontal positions from the true vertical through subnasale.
    nose_projection_mm: float = measured(17.4, "mm", ARNETT, "nose tip ahead of subnasale", 1.7)
    nose_tip_height_mm: float = measured(10.5, "mm", ESTIMATE, "nose tip above subnasale")
    nasolabial_angle_deg: float = measured(
        105.7,
        "deg",
        CELEBI,
        "at subnasale, between columella and the foremost point of the upper lip",
        9.5,
        minimum=85.0,
        maximum=125.0,
    )
    nasion_height_mm: float = measured(
        56.6, "mm", f"{ARNETT}: 137.7 - 81.1", "nasion above subnasale"
    )
    glabella_projection_mm: float = measured(-8.0, "mm", ARNETT, "glabella ahead of subnasale", 2.5)
    upper_lip_length_mm: float = measured(
        24.4, "mm", ARNETT, "subnasale to the lower margin of the upper lip", 2.5, above=0.0
    )
    upper_lip_projection_mm: float = measured(
        3.3, "mm", ARNETT, "upper lip ahead of subnasale", 1.7
    )
    upper_lip_thickness_mm: float = measured(
        14.8, "mm", ARNETT, "foremost point of the upper lip to its inner side", 1.4, above=0.0
    )
    upper_vermilion_mm: float = measured(
        8.0, "mm", "7-9 mm in Europeans", "height of the upper lip's red part", above=0.0
    )
    a_point_projection_mm: float = measured(
        -0.3, "mm", ARNETT, "hollow of the upper lip (A') ahead of subnasale", 1.0
    )
    interlabial_gap_mm: float = measured(
        2.4, "mm", ARNETT, "gap of the relaxed lips, teeth closed", 1.1
    )
    lower_lip_length_mm: float = measured(
        54.3, "mm", ARNETT, "upper margin of the lower lip to menton", 2.4, above=0.0
    )
    lower_lip_projection_mm: float = measured(
        1.0, "mm", ARNETT, "lower lip ahead of subnasale", 2.2
    )
    lower_lip_thickness_mm: float = measured(
        15.1, "mm", ARNETT, "foremost point of the lower lip to its inner side", 1.2, above=0.0
    )
    lower_vermilion_mm: float = measured(
        10.0, "mm", "9-11 mm in Europeans", "height of the lower lip's red part", above=0.0
    )
    sulcus_projection_mm: float = measured(
        -7.1, "mm", ARNETT, "labiomental fold (B') ahead of subnasale", 1.6
    )
    sulcus_below_lip_mm: float = measured(
        20.7,
        "mm",
        "doi 10.1186/s40902-019-0191-7 (2019), Table 9",
        "lower lip's margin to the labiomental fold",
        1.1,
    )
    mentolabial_angle_deg: float = measured(
        120.0,
        "deg",
        "most liked 107-118, accepted to 140 (2017)",
        "between the lower lip's tangent where its red part ends and the chin's steepest",
        minimum=95.0,
        maximum=150.0,
    )
    pogonion_projection_mm: float = measured(
        -3.5, "mm", ARNETT, "foremost point of the chin ahead of subnasale", 1.8
    )
    pogonion_above_menton_mm: float = measured(20.0, "mm", ESTIMATE, "pogonion above menton")
    menton_behind_pogonion_mm: float = measured(
        16.0, "mm", ESTIMATE, "lowest point of the chin behind its foremost"
    )
    # Depth of the tissue over bone.
    a_point_thickness_mm: float = measured(
        15.0, "mm", ESTIMATE, "tissue over the upper jaw at the hollow of the upper lip", above=0.0
    )
    sulcus_thickness_mm: float = measured(
        11.5, "mm", ESTIMATE, "tissue over the lower jaw at the labiomental fold", above=0.0
    )
    pogonion_thickness_mm: float = measured(
        13.5, "mm", ARNETT, "tissue over the chin, in front", 2.3, above=0.0
    )
    menton_thickness_mm: float = measured(
        8.8, "mm", ARNETT, "tissue under the chin", 1.3, above=0.0
    )
    nose_thickness_mm: float = measured(
        13.0, "mm", "bulk of 10-20 mm in the study", "tissue of the nose over cartilage", above=0.0
    )
    dermis_thickness_mm: float = measured(
        1.0,
        "mm",
        "about 1 mm in the study; 1.11-1.94 mm in men",
        "dermis of the skin where no place says otherwise",
        above=0.0,
    )
    nose_dermis_mm: float | None = measured(
        None,
        "mm",
        "1.25: 3.30 times the eyelid's 0.38 (Ha 2005)",
        "dermis at the tip of the nose; between two places it changes smoothly",
        above=0.0,
    )
    philtrum_dermis_mm: float | None = measured(
        None,
        "mm",
        "1.11-1.94 in men (180 patients)",
        "dermis at the hollow of the upper lip, A'",
        above=0.0,
    )
    fold_dermis_mm: float | None = measured(
        None,
        "mm",
        "1.11-1.94 in men (180 patients)",
        "dermis at the labiomental fold, B'",
        above=0.0,
    )
    chin_dermis_mm: float | None = measured(
        None,
        "mm",
        "1.19: 3.14 times the eyelid's 0.38 (Ha 2005, as in the study)",
        "dermis over the foremost point of the chin",
        above=0.0,
    )
    submental_dermis_mm: float | None = measured(
        None,
        "mm",
        "1.02 ± 0.24 in men, by ultrasound (2022)",
        "dermis under the chin",
        0.24,
        above=0.0,
    )
    vermilion_thickness_mm: float = measured(
        1.0,
        "mm",
        "about 1 mm in the study",
        "dermis of the red part and of the lip's margin",
        above=0.0,
    )
    dermis_wrap_mm: float = measured(
        6.0,
        "mm",
        ESTIMATE,
        "how far the dermis goes round the lip's margin to the inside",
        above=0.0,
    )
    # Teeth and jaw.
    incisor_exposure_mm: float = measured(
        3.9, "mm", ARNETT, "edge of the upper incisor below the upper lip", 1.2
    )
    overbite_mm: float = measured(
        3.2, "mm", ARNETT, "upper incisor's edge below the lower one's", 0.7
    )
    upper_crown_mm: float = measured(
        10.5, "mm", "Wheeler: 10-11 mm", "upper incisor's crown", above=0.0
    )
    upper_crown_depth_mm: float = measured(7.0, "mm", "Wheeler", "upper incisor, front to back")
    upper_crown_slope_deg: float = measured(
        2.0, "deg", "torque 7° less half the occlusal plane's 10°", "front face, edge forward"
    )
    lower_crown_mm: float = measured(9.0, "mm", "Wheeler", "lower incisor's crown", above=0.0)
    lower_crown_depth_mm: float = measured(6.0, "mm", "Wheeler", "lower incisor, front to back")
    lower_crown_slope_deg: float = measured(
        9.0, "deg", "torque -1° and an occlusal plane of 10°", "front face, edge forward"
    )
    tooth_clearance_mm: float = measured(
        0.3,
        "mm",
        "0.2-0.5 mm, moist lips lie close to the teeth",
        "lips to the front of the teeth",
        above=0.0,
    )
    vestibule_depth_mm: float = measured(
        8.0, "mm", ESTIMATE, "how far above the crown the lips are free from the jaw"
    )
    tie_fade_mm: float = measured(
        4.0, "mm", "so that no element sees the tie end", "arc length over which the tie fades in"
    )
    jaw_opening_deg: float = measured(
        7.0,
        "deg",
        "lips parted as just before contact; 10.9° is pure hinge",
        "turn of the jaw",
        minimum=0.0,
        maximum=25.0,
    )

    def __post_init__(self) -> None:
        check_ranges(self, HeadError)
