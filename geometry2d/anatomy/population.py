"""People sampled at random: heads with the spreads and correlations of a population.

Means and standard deviations of women and men are cephalometric norms. Measurements of one face go
together: the correlations of lips and lower face are those of the identity modes of a public
morphable face, each taken as one standard deviation. What has no known correlation is independent.

Every person has a random sequence of their own, so that a larger panel begins with the people of a
smaller one. A draw that makes no head is counted and sampled anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.anthropometry import CELEBI, HeadError, HeadMeasurements
from geometry2d.anatomy.closed_face import ClosedFace
from geometry2d.anatomy.head import HeadSection, head_section
from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]

Sex = Literal["female", "male"]
Sexes = Literal["both", "female", "male"]

ARNETT_NORMS = "Arnett et al. 1999; not checked against the printed table"
MODES = "identity modes of ICT-FaceKit, each as one standard deviation; its sample is not known"

MOST_TRIES = 200
"""Draws for one person; so many failures mean that the base head is to blame."""


@dataclass(frozen=True)
class Norm:
    """Mean and standard deviation of a measurement among women and among men, and their source."""

    female: tuple[float, float]
    male: tuple[float, float]
    source: str = ARNETT_NORMS

    def of(self, sex: Sex) -> tuple[float, float]:
        """Return mean and standard deviation of a sex."""
        return self.female if sex == "female" else self.male


FACE = {
    "upper_lip_length_mm": Norm((21.0, 1.9), (24.4, 2.5)),
    "lower_lip_length_mm": Norm((46.9, 2.3), (54.3, 2.4)),
    "upper_lip_thickness_mm": Norm((12.6, 1.8), (14.8, 1.4)),
    "lower_lip_thickness_mm": Norm((13.6, 1.4), (15.1, 1.2)),
    "upper_lip_projection_mm": Norm((3.7, 1.2), (3.3, 1.7)),
    "lower_lip_projection_mm": Norm((1.9, 1.4), (1.0, 2.2)),
    "upper_vermilion_mm": Norm((8.0, 1.0), (8.0, 1.0), "7-9 mm in Europeans, as ± 1 SD"),
    "lower_vermilion_mm": Norm((10.0, 1.0), (10.0, 1.0), "9-11 mm in Europeans, as ± 1 SD"),
}
"""Measurements with the correlations of `CORRELATION`, in its order."""

CORRELATION: Array = np.array(
    [
        [1.00, 0.47, 0.29, 0.37, 0.19, 0.17, 0.50, 0.33],
        [0.47, 1.00, 0.36, 0.57, 0.19, 0.23, 0.35, 0.36],
        [0.29, 0.36, 1.00, 0.41, 0.50, 0.01, 0.62, 0.58],
        [0.37, 0.57, 0.41, 1.00, 0.41, 0.57, 0.28, 0.59],
        [0.19, 0.19, 0.50, 0.41, 1.00, 0.79, 0.71, 0.73],
        [0.17, 0.23, 0.01, 0.57, 0.79, 1.00, 0.40, 0.56],
        [0.50, 0.35, 0.62, 0.28, 0.71, 0.40, 1.00, 0.78],
        [0.33, 0.36, 0.58, 0.59, 0.73, 0.56, 0.78, 1.00],
    ]
)
"""Of the measurements in `FACE`; source: `MODES`."""

BELOW_THE_LIP = {
    "sulcus_projection_mm": Norm((-5.3, 1.5), (-7.1, 1.6)),
    "pogonion_projection_mm": Norm((-2.6, 1.9), (-3.5, 1.8)),
}
"""Measurements that follow the one above them on the profile: lower lip, fold, chin."""

FOLLOWS = 0.55
"""Correlation of each of `BELOW_THE_LIP` with the one before. The depth of the fold below the lower
lip then spreads by 1.4 mm (women) and 1.9 mm (men); Celebi 2013 has 1.6 mm for both."""

ALONE = {
    "nose_projection_mm": Norm((16.0, 1.4), (17.4, 1.7)),
    "nasolabial_angle_deg": Norm((108.4, 7.4), (105.7, 9.5), CELEBI.replace("men", "both")),
    "glabella_projection_mm": Norm((-8.5, 2.4), (-8.0, 2.5)),
    "a_point_projection_mm": Norm((-0.1, 1.0), (-0.3, 1.0)),
    "interlabial_gap_mm": Norm((3.3, 1.3), (2.4, 1.1)),
    "pogonion_thickness_mm": Norm((11.8, 1.5), (13.5, 2.3)),
    "menton_thickness_mm": Norm((7.4, 1.6), (8.8, 1.3)),
    "incisor_exposure_mm": Norm((4.7, 1.6), (3.9, 1.2)),
    "overbite_mm": Norm((3.2, 0.7), (3.2, 0.7)),
    "dermis_thickness_mm": Norm(
        (1.0, 0.2), (1.0, 0.2), "thesis: 0.785 and 1.604 mm are ± 2 SD; about 1 mm in its section"
    ),
}
"""Measurements without a known correlation."""

NASION_HEIGHT_MM = {"female": 124.6 - 71.1, "male": 137.7 - 81.1}
"""Arnett: nasion to menton, less the lower third."""

IN_PROPORTION = ("sulcus_below_lip_mm", "pogonion_above_menton_mm")
"""Heights on the chin that grow with the length of the lower lip; an estimate."""

NORMS: Mapping[str, Norm] = {**FACE, **BELOW_THE_LIP, **ALONE}
"""All measurements that differ among people, by name."""


@dataclass(frozen=True)
class Person:
    """A head that was sampled.

    Attributes
    ----------
    number
        From 1.
    sex
        Whose norms were used.
    measurements
        The head's.
    deviations
        By measurement, how many standard deviations it is from the mean of that sex.
    rejected
        Why earlier draws for this person make no head.
    """

    number: int
    sex: Sex
    measurements: HeadMeasurements
    deviations: Mapping[str, float]
    rejected: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """How tables call this person, such as ``P03-female``."""
        return f"P{self.number:02d}-{self.sex}"

    def section(self) -> HeadSection:
        """Return the head, cut through its middle."""
        return head_section(self.measurements)


def sampled_people(
    count: int,
    *,
    sex: Sexes = "both",
    seed: int = 1,
    base: HeadMeasurements | None = None,
    spread: float = 1.0,
) -> tuple[Person, ...]:
    """Return people sampled at random.

    Parameters
    ----------
    count
        How many; a larger panel begins with the people of a smaller one.
    sex
        "both" takes women and men in turn.
    seed
        Of the random numbers.
    base
        Measurements that are not sampled; those of :class:`HeadMeasurements` by default.
    spread
        Factor on all standard deviations; 0 gives mean people.

    Raises
    ------
    HeadError
        If `MOST_TRIES` draws for one person make no head.
    """
    start = base or HeadMeasurements()
    return tuple(_person(number, sex, seed, start, spread) for number in range(1, count + 1))


def _person(number: int, sexes: Sexes, seed: int, base: HeadMeasurements, spread: float) -> Person:
    sex: Sex = ("male" if number % 2 == 0 else "female") if sexes == "both" else sexes
    random = np.random.default_rng([seed, number])
    rejected: list[str] = []
    for deviations in _deviations(random, spread):
        try:
            measurements = _measurements(deviations, sex, base)
            head_section(measurements)
        except DrinksimError as error:
            rejected.append(str(error))
            if len(rejected) == MOST_TRIES:
                raise HeadError(
                    f"person {number}: {MOST_TRIES} draws make no head, the last as {error}: check "
                    "the head of the base scenario"
                ) from error
            continue
        return Person(number, sex, measurements, deviations, tuple(rejected))
    raise AssertionError("draws never end")


def _deviations(random: np.random.Generator, spread: float) -> Iterator[dict[str, float]]:
    """Yield deviations from the mean in standard deviations, by measurement, without end."""
    root = np.linalg.cholesky(CORRELATION)
    rest = np.sqrt(1.0 - FOLLOWS**2)
    while True:
        face = dict(zip(FACE, root @ random.standard_normal(len(FACE)), strict=True))
        before = face["lower_lip_projection_mm"]
        for name in BELOW_THE_LIP:
            before = FOLLOWS * before + rest * random.standard_normal()
            face[name] = before
        alone = dict(zip(ALONE, random.standard_normal(len(ALONE)), strict=True))
        yield {name: spread * float(value) for name, value in {**face, **alone}.items()}


def _measurements(
    deviations: Mapping[str, float], sex: Sex, base: HeadMeasurements
) -> HeadMeasurements:
    values = {
        name: norm.of(sex)[0] + deviations[name] * norm.of(sex)[1] for name, norm in NORMS.items()
    }
    usual = HeadMeasurements()
    scale = values["lower_lip_length_mm"] / usual.lower_lip_length_mm
    in_proportion = {name: scale * getattr(usual, name) for name in IN_PROPORTION}
    sampled = replace(base, **values, **in_proportion, nasion_height_mm=NASION_HEIGHT_MM[sex])
    return replace(sampled, ear_nose_mm=base.ear_nose_mm * _nose_reach(sampled) / _nose_reach(base))


def _nose_reach(m: HeadMeasurements) -> float:
    """Return the distance of the nose's tip from the ear, mm."""
    face = ClosedFace.of(m)
    return float(np.hypot(*(face.subnasale + face.nose_tip)))
