"""Tables of what was filmed, how it moved, and how head and motion are brought together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from geometry2d.foundation.settings import setting
from scenarios.settings.tables import SettingError


@dataclass(frozen=True)
class Recording:
    """The video of the sip, and where its markers are."""

    video: str = setting(file=True, example="sip.mp4", description="video file")
    markers: str | None = setting(
        file=True,
        default=None,
        example="markers.toml",
        description="marker file; a film with coded stickers needs none",
    )
    start_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="first time used; from the start if absent"
    )
    end_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="last time used; to the end if absent"
    )

    def __post_init__(self) -> None:
        if self.start_s is not None and self.end_s is not None and self.start_s >= self.end_s:
            raise SettingError(
                f"recording.start_s = {self.start_s:g} s is not before end_s = {self.end_s:g} s"
            )


@dataclass(frozen=True)
class MotionFile:
    """A motion that has been measured already: it is replayed instead of the recording's."""

    file: str = setting(file=True, example="motion.csv", description="table of the motion")


@dataclass(frozen=True)
class Placement:
    """Where neck and lower face are put in the head section, beyond what the recording says.

    Axes are those of the head in its natural position: x forward, y up. What is "auto" is found
    from [first_contact] (:mod:`scenarios.placing.placement`).
    """

    shift_x_mm: float | Literal["auto"] = setting(
        default=0.0, unit="mm", minimum=-30.0, maximum=30.0, description="package forward"
    )
    shift_y_mm: float | Literal["auto"] = setting(
        default=0.0, unit="mm", minimum=-30.0, maximum=30.0, description="package upward"
    )
    turn_deg: float | Literal["auto"] = setting(
        default=0.0,
        unit="deg",
        minimum=-45.0,
        maximum=45.0,
        description="package turned counter-clockwise about the lower mark",
    )
    lower_face_x_mm: float | Literal["auto"] = setting(
        default=0.0,
        unit="mm",
        minimum=-20.0,
        maximum=20.0,
        description="lower lip, jaw and tooth forward",
    )
    lower_face_y_mm: float | Literal["auto"] = setting(
        default=0.0,
        unit="mm",
        minimum=-20.0,
        maximum=20.0,
        description="lower lip, jaw and tooth upward",
    )
    anchor: Literal["lower_rim", "rim_centre", "marks"] = setting(
        default="lower_rim",
        description="what of a neck that was not filmed is where it was on the filmed one",
    )
    at_most_mm: float = setting(
        default=10.0, unit="mm", minimum=0.1, maximum=20.0, description="bound of every auto shift"
    )
    at_most_deg: float = setting(
        default=10.0, unit="deg", minimum=0.1, maximum=20.0, description="bound of an auto turn"
    )


@dataclass(frozen=True)
class FirstContact:
    """When and where the neck was seen to touch each lip first.

    Places are arc lengths along the lip's skin from its margin: positive towards the face,
    negative into the mouth.
    """

    lower_time_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="first contact with the lower lip"
    )
    lower_place_mm: float | None = setting(
        default=None, unit="mm", description="where on the lower lip"
    )
    upper_time_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="first contact with the upper lip"
    )
    upper_place_mm: float | None = setting(
        default=None, unit="mm", description="where on the upper lip"
    )
    time_sigma_s: float = setting(
        default=0.04,
        unit="s",
        minimum=1e-3,
        description="standard deviation of the times",
        source="one picture of a film with 25 a second",
    )
    place_sigma_mm: float = setting(
        default=1.5,
        unit="mm",
        minimum=0.01,
        description="standard deviation of the places",
        source="estimate: a lip read off by eye",
    )
    skin_sigma_mm: float = setting(
        default=0.3,
        unit="mm",
        minimum=0.01,
        description="standard deviation of where the skin is",
        source="estimate: how well a section fits a face",
    )

    def __post_init__(self) -> None:
        for lip in ("lower", "upper"):
            if getattr(self, f"{lip}_place_mm") is not None and (
                getattr(self, f"{lip}_time_s") is None
            ):
                raise SettingError(
                    f"first_contact.{lip}_place_mm has no {lip}_time_s: say when it was touched"
                )

    @property
    def observed(self) -> bool:
        """Whether any contact was seen."""
        return self.lower_time_s is not None or self.upper_time_s is not None
