"""Named measurements of the lips' muscles: thickness, position and curvature.

Positions are arc lengths along curves that every head has, measured or drawn: the skin from the
margin of a lip outwards, its inner side from the margin inwards, the bone from the fold between lip
and jaw.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from geometry2d.anatomy.anthropometry import ESTIMATE, HeadError
from geometry2d.foundation.settings import check_ranges, measured

ARTISYNTH = "fibres of ArtiSynth's face (Stavness 2013), 3 mm off its midline"
ULTRASOUND = "1.5-3.0 mm, ultrasound of twelve people (Alfen 2013)"
CHOI = "Choi 2021, ultrasound of 33 people"


_measured = partial(measured, above=0.0)


@dataclass(frozen=True)
class MuscleMeasurements:
    """Named measurements of the lips' muscles; the metadata are unit, source and meaning."""

    mouth_width_mm: float = _measured(
        51.0, "mm", "ArtiSynth's face; 50-55 mm in Europeans", "between the corners of the mouth"
    )
    edge_mm: float = _measured(
        0.5,
        "mm",
        "so that what elements sum up depends little on how they cut the edge",
        "on both sides of its edge, where a muscle's share of the tissue changes from 1 to 0",
    )
    # Orbicularis oris, peripheral part: a sheet.
    upper_peripheral_thickness_mm: float = _measured(
        2.5, "mm", f"2-3 mm, general anatomy; {ULTRASOUND}", "peripheral sheet of the upper lip"
    )
    lower_peripheral_thickness_mm: float = _measured(
        3.0, "mm", "2.5-3.5 mm, general anatomy; thicker than the upper (Vinkka-Puhakka 1989)",
        "peripheral sheet of the lower lip",
    )  # fmt: skip
    upper_peripheral_depth_mm: float = _measured(
        4.0, "mm", "between two layers of connective tissue (Vinkka-Puhakka 1989); estimate",
        "inner side of the upper lip to its peripheral sheet",
    )  # fmt: skip
    lower_peripheral_depth_mm: float = _measured(
        2.5, "mm", "close to the inner side (Vinkka-Puhakka 1989); estimate",
        "inner side of the lower lip to its peripheral sheet",
    )  # fmt: skip
    upper_peripheral_start_mm: float = _measured(
        5.0,
        "mm",
        ESTIMATE,
        "margin of the upper lip, along its inner side, to where the sheet begins",
    )
    lower_peripheral_start_mm: float = _measured(
        5.0,
        "mm",
        ESTIMATE,
        "margin of the lower lip, along its inner side, to where the sheet begins",
    )
    upper_peripheral_beyond_fold_mm: float = _measured(
        8.0, "mm", "to the base of the nose; estimate", "fold of the upper lip to the sheet's end"
    )
    lower_peripheral_beyond_fold_mm: float = _measured(
        6.0, "mm", "to the labiomental fold; estimate", "fold of the lower lip to the sheet's end"
    )
    upper_peripheral_radius_mm: float = _measured(
        23.0, "mm", ARTISYNTH, "radius of its fibres in a horizontal plane"
    )
    lower_peripheral_radius_mm: float = _measured(
        25.0, "mm", ARTISYNTH, "radius of its fibres in a horizontal plane"
    )
    # Orbicularis oris, marginal part: a bundle below the red of the lip.
    upper_marginal_thickness_mm: float = _measured(
        3.0, "mm", f"{ULTRASOUND}; well developed in 43 % of 70 people (Park 2020)",
        "marginal bundle of the upper lip, across the skin",
    )  # fmt: skip
    lower_marginal_thickness_mm: float = _measured(
        3.0, "mm", ULTRASOUND, "marginal bundle of the lower lip, across the skin"
    )
    upper_marginal_length_mm: float = _measured(
        10.0, "mm", "the dry red of the lip; estimate", "marginal bundle of the upper lip, along it"
    )
    lower_marginal_length_mm: float = _measured(
        11.0, "mm", "the dry red of the lip; estimate", "marginal bundle of the lower lip, along it"
    )
    upper_marginal_start_mm: float = _measured(
        1.0, "mm", ESTIMATE, "margin of the upper lip, along its skin, to where the bundle begins"
    )
    lower_marginal_start_mm: float = _measured(
        1.0, "mm", ESTIMATE, "margin of the lower lip, along its skin, to where the bundle begins"
    )
    upper_marginal_depth_mm: float = _measured(
        0.6, "mm", ESTIMATE, "dermis of the upper lip to its marginal bundle"
    )
    lower_marginal_depth_mm: float = _measured(
        0.6, "mm", ESTIMATE, "dermis of the lower lip to its marginal bundle"
    )
    upper_marginal_radius_mm: float = _measured(
        16.0, "mm", ARTISYNTH, "radius of its fibres in a horizontal plane"
    )
    lower_marginal_radius_mm: float = _measured(
        12.0, "mm", ARTISYNTH, "radius of its fibres in a horizontal plane"
    )
    # Muscles that run in the section, from bone to skin.
    mentalis_thickness_mm: float = _measured(
        4.0,
        "mm",
        f"{CHOI}: 6.7 to 10.7 mm below the skin of the chin",
        "mentalis, across its fibres",
    )
    mentalis_bone_mm: float = _measured(
        4.0, "mm", "incisive fossa, below the incisors' roots; estimate",
        "fold of the lower lip, along the bone, to its origin",
    )  # fmt: skip
    mentalis_skin_mm: float = _measured(
        34.0, "mm", f"{CHOI}: 20-30 mm below the line between the mouth's corners",
        "margin of the lower lip, along the skin, to its insertion",
    )  # fmt: skip
    levator_thickness_mm: float = _measured(2.0, "mm", ULTRASOUND, "levator, across its fibres")
    levator_bone_mm: float = _measured(
        15.0, "mm", "so that it points to the lower rim of the orbit; estimate",
        "fold of the upper lip, along the bone, to where it leaves the section",
    )  # fmt: skip
    levator_skin_mm: float = _measured(
        11.0, "mm", "skin above the red of the lip, general anatomy; estimate",
        "margin of the upper lip, along the skin, to its insertion",
    )  # fmt: skip
    depressor_thickness_mm: float = _measured(2.0, "mm", ULTRASOUND, "depressor, across its fibres")
    depressor_bone_mm: float = _measured(
        10.0, "mm", "so that it points to the oblique line of the mandible; estimate",
        "fold of the lower lip, along the bone, to where it leaves the section",
    )  # fmt: skip
    depressor_skin_mm: float = _measured(
        9.0, "mm", "skin below the red of the lip, general anatomy; estimate",
        "margin of the lower lip, along the skin, to its insertion",
    )  # fmt: skip

    def __post_init__(self) -> None:
        check_ranges(self, HeadError)
