"""Tables of the package: its neck, and the friction of what touches."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.foundation.settings import setting
from geometry2d.neck import NECK_SOURCES, NECKS, NeckMeasurements, NeckSection, neck_section
from scenarios.settings.culprit import built

CARTON_KEYS = ("package_width_mm", "package_height_mm", "shoulder_mm")
"""Measurements of the carton behind the neck, which a drawing of the neck leaves open."""


@dataclass(frozen=True)
class Package:
    """The neck of the package: a named one and its measurements, or the user's own drawing.

    :mod:`geometry2d.drawings.drawn_neck` says what a drawing holds. Beside it the measurements only
    describe the carton behind the neck.
    """

    neck: str = setting(
        default="A38",
        presets=NECKS,
        of="measurements",
        sources=NECK_SOURCES,
        description="neck of the library, whose measurements the others here change",
    )
    outline: str | None = setting(
        default=None,
        file=True,
        example="neck.svg",
        replaces=(
            "neck",
            *(field.name for field in fields(NeckMeasurements) if field.name not in CARTON_KEYS),
        ),
        description="drawing of the neck, SVG or DXF, in place of its measurements",
    )
    measurements: NeckMeasurements = setting(
        default=NECKS["A38"], inline=True, description="measurements of neck and carton"
    )
    mass_g: float | None = setting(
        default=None,
        unit="g",
        above=0.0,
        maximum=5000.0,
        description="mass of the empty package, for hand.share_of_weight",
    )

    def section(self) -> NeckSection:
        """Return the neck, cut through its axis.

        Raises
        ------
        SettingError
            If the measurements do not describe a neck: it names one of them.
        geometry2d.drawings.chains.DrawingError
            If the drawing does not.
        """
        if self.outline is None:
            return built(neck_section, self.measurements, NECKS[self.neck], where="package")
        return drawn_neck(Path(self.outline), carton=self.measurements)


@dataclass(frozen=True)
class Friction:
    """Coulomb friction of the pairs that touch."""

    friction: float = setting(
        default=1.0,
        minimum=0.0,
        maximum=3.0,
        description="friction coefficient between lip and package",
        source="thesis, section 4.2",
    )
    teeth_friction: float = setting(
        default=0.0,
        minimum=0.0,
        maximum=3.0,
        description="friction coefficient between lip and teeth",
        source="thesis, section 4.2",
    )
    lip_friction: float = setting(
        default=0.3,
        minimum=0.0,
        maximum=3.0,
        description="friction coefficient between lip and lip, and in folds",
        source="assumed: wet with saliva",
    )
