"""The motion of head and package: one value that a recording gives and a replay takes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.rigid import RigidMotion, RigidPlacement, rotated
from mocap.motion.chart import relative_figure
from mocap.motion.errors import MotionError
from mocap.motion.motion_file import (
    AXIS_DECIMALS,
    COLUMNS,
    DECIMALS,
    HEAD,
    PACKAGE,
    RELATIVE,
    SIGMA,
    Value,
    motion_text,
    read_motion_file,
)
from mocap.motion.phases import (
    ACROSS_THE_NECK,
    DrinkingFigures,
    LipAtRim,
    figures_of,
)
from mocap.motion.picture import PictureScale

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class MarkedBody:
    """A body of the marker file.

    Attributes
    ----------
    name, markers
        Its name and its markers; the first marker is the body's origin.
    axis_rad
        Direction from the first to the last marker in the first frame, rad, counter-clockwise from
        the world's x; None if it is not known, as for a single marker.
    """

    name: str
    markers: tuple[str, ...] = ()
    axis_rad: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """Rigid motions of head and package in the world, and of the package seen from the head.

    :meth:`of` makes a motion from fewer arrays, :meth:`read` from a ``motion.csv``.

    Attributes
    ----------
    time_s
        (n,) increasing times, s; n ≥ 2.
    relative_mm, relative_rad
        (n, 2) position of the package's first marker in the head frame, mm, and (n,) rotation of
        the package relative to the head since the first frame, rad.
    sigma
        (n, 3) standard errors of the relative x and y, mm, and angle, rad; nan if not known.
    head_mm, head_rad
        (n, 2) position of the head's first marker in the world, mm, and (n,) rotation of the head
        since the first frame, rad; all nan if not known.
    package_mm, package_rad
        The same for the package.
    head_body, package_body
        Names, markers and directions of the bodies.
    picture
        Map from the world to the recording's picture at the package's depth; None if not known.
    rendered
        Whether the recording is rendered and not filmed.
    """

    time_s: Array
    relative_mm: Array
    relative_rad: Array
    sigma: Array
    head_mm: Array
    head_rad: Array
    package_mm: Array
    package_rad: Array
    head_body: MarkedBody = MarkedBody("head")
    package_body: MarkedBody = MarkedBody("package")
    picture: PictureScale | None = None
    rendered: bool = False

    def __post_init__(self) -> None:
        count = np.asarray(self.time_s).size
        for name, columns in _ARRAYS.items():
            array = np.array(getattr(self, name), float)
            shape = (count, columns) if columns else (count,)
            if array.shape != shape:
                raise MotionError(f"{name} has shape {array.shape}: {count} times need {shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        self._check_values()

    def _check_values(self) -> None:
        if self.time_s.size < 2:
            raise MotionError(
                f"the motion holds {self.time_s.size} instants: a motion needs at least two"
            )
        if not np.all(np.diff(self.time_s) > 0):
            row = int(np.argmin(np.diff(self.time_s) > 0))
            raise MotionError(
                f"times do not increase after {self.time_s[row]:g} s (row {row + 1}): sort the "
                "rows and drop doubles"
            )
        for name in _ARRAYS:
            known = np.isfinite(getattr(self, name)).reshape(self.time_s.size, -1).all(axis=1)
            may_be_unknown = name not in ("time_s", "relative_mm", "relative_rad")
            if not known.all() and not (may_be_unknown and not known.any()):
                row = int(np.argmin(known))
                raise MotionError(
                    f"{name} in row {row + 1} is not finite: fill or leave out such rows"
                )

    @classmethod
    def of(
        cls,
        time_s: ArrayLike,
        relative_mm: ArrayLike,
        relative_rad: ArrayLike,
        *,
        sigma: ArrayLike | None = None,
        head_mm: ArrayLike | None = None,
        head_rad: ArrayLike | None = None,
        **about: Any,
    ) -> Motion:
        """Return a motion; the package's motion in the world follows from the other two.

        Parameters
        ----------
        time_s, relative_mm, relative_rad, sigma, head_mm, head_rad
            As the attributes; omitted ones are not known.
        **about
            ``head_body``, ``package_body``, ``picture``, ``rendered``.

        Raises
        ------
        MotionError
            If shapes do not fit, times do not increase, or a number is not finite.
        """
        count = np.size(time_s)
        head_at = np.full((count, 2), np.nan) if head_mm is None else np.asarray(head_mm, float)
        turn = np.full(count, np.nan) if head_rad is None else np.asarray(head_rad, float)
        relative, angle = np.asarray(relative_mm, float), np.asarray(relative_rad, float)
        return cls(
            time_s=np.asarray(time_s, float),
            relative_mm=relative,
            relative_rad=angle,
            sigma=np.full((count, 3), np.nan) if sigma is None else np.asarray(sigma, float),
            head_mm=head_at,
            head_rad=turn,
            package_mm=head_at + rotated(relative, turn),
            package_rad=turn + angle,
            **about,
        )

    @classmethod
    def read(cls, path: Path | str) -> Motion:
        """Return the motion in a ``motion.csv``.

        The columns ``time_s`` and ``rel_*`` are required; the others and the header are optional
        (:mod:`mocap.motion.motion_file`).

        Raises
        ------
        MotionError
            If the file is missing, broken, or holds no motion; the message names the file.
        """
        file = Path(path)
        columns, header = read_motion_file(file)
        try:
            return cls(**_arrays(columns), **_of_header(header))
        except MotionError as error:
            raise MotionError(f"{file}: {error}") from None

    def write(self, path: Path | str, *, decimals: int = DECIMALS) -> None:
        """Write the motion as ``motion.csv``; :meth:`read` gives back :meth:`rounded`.

        ``decimals`` are those of mm, degrees and s.
        """
        Path(path).write_bytes(self.text(decimals=decimals).encode("utf-8"))

    def text(self, *, decimals: int = DECIMALS) -> str:
        """Return what :meth:`write` writes."""
        return motion_text(self.columns(), self._header(), decimals=decimals)

    def columns(self) -> dict[str, Array]:
        """Return the known columns (n,) of ``motion.csv`` by name: s, mm, degrees."""
        table = np.column_stack(
            [
                self.time_s,
                self.head_mm,
                np.degrees(self.head_rad),
                self.package_mm,
                np.degrees(self.package_rad),
                self.relative_mm,
                np.degrees(self.relative_rad),
                self.sigma[:, :2],
                np.degrees(self.sigma[:, 2]),
            ]
        )
        named = zip(COLUMNS, table.T, strict=True)
        return {name: column for name, column in named if not np.isnan(column).all()}

    def rounded(self) -> Motion:
        """Return the motion as a file holds it: mm and degrees with six decimals.

        Its replay gives the same bits from memory and from its file.
        """
        table = {
            name: np.array([float(f"{value:.{DECIMALS}f}") for value in column])
            for name, column in self.columns().items()
        }
        bodies: dict[str, Any] = {
            name: replace(body, axis_rad=np.radians(_axis_deg(body)))
            for name, body in (("head_body", self.head_body), ("package_body", self.package_body))
            if body.axis_rad is not None
        }
        return replace(self, **_arrays(table), **bodies)

    @cached_property
    def relative(self) -> RigidMotion:
        """Motion of the package's first marker, and frame about it, in the head frame."""
        return RigidMotion(self.time_s, self.relative_rad, self.relative_mm)

    @cached_property
    def head(self) -> RigidMotion:
        """Motion of the head frame in the world."""
        self._check_world()
        return RigidMotion(self.time_s, self.head_rad, self.head_mm)

    @cached_property
    def package(self) -> RigidMotion:
        """Motion, in the world, of package points given by their position in the first frame."""
        self._check_world()
        return RigidMotion.of_reference_point(
            self.time_s, self.package_rad, self.package_mm, self.package_mm[0]
        )

    def at(self, time_s: float) -> RigidPlacement:
        """Return the package seen from the head at a time, s; at rest before and after the clip."""
        return self.relative.at(time_s)

    def with_(self, **changes: Any) -> Motion:
        """Return a motion with some attributes changed.

        If the relative motion or the head's is changed and the package's is not, the latter
        follows.

        Raises
        ------
        MotionError
            If there is no such attribute, or a value does not fit.
        """
        unknown = changes.keys() - {field.name for field in fields(self)}
        if unknown:
            raise MotionError(
                f"a motion has no {sorted(unknown)[0]}: known are "
                f"{', '.join(field.name for field in fields(self))}"
            )
        follows = {"relative_mm", "relative_rad", "head_mm", "head_rad"} & changes.keys()
        changed = replace(self, **changes)
        if not follows or {"package_mm", "package_rad"} & changes.keys():
            return changed
        return replace(
            changed,
            package_mm=changed.head_mm + rotated(changed.relative_mm, changed.head_rad),
            package_rad=changed.head_rad + changed.relative_rad,
        )

    def shifted(self, *, x_mm: float = 0.0, y_mm: float = 0.0, turn_deg: float = 0.0) -> Motion:
        """Return the motion with the package displaced by a constant.

        ``x_mm`` and ``y_mm`` move it along the axes of the head frame; ``turn_deg`` rotates it
        counter-clockwise about its first marker.

        Raises
        ------
        MotionError
            If it is to be rotated and its direction is not known.
        """
        body, by = self.package_body, np.radians(turn_deg)
        if body.axis_rad is not None:
            body = replace(body, axis_rad=body.axis_rad + float(by))
        elif turn_deg:
            raise MotionError(
                f"the direction of {body.name} is not known, so it cannot be turned: give "
                "package_body an axis_rad"
            )
        return self.with_(relative_mm=self.relative_mm + np.array([x_mm, y_mm]), package_body=body)

    def drinking(self, lip: LipAtRim | None = None) -> DrinkingFigures:
        """Return phases, tilt, pitch, closest approach and style of the sip.

        Parameters
        ----------
        lip
            Position of the upper lip at the rim, if known. It gives the angle of the opening above
            level; without it the standard marks do, which lie across the neck. The camera is
            assumed to be level.
        """
        self._check_world()
        return figures_of(
            self.time_s,
            self.relative_mm,
            self.relative_rad,
            self.head_rad,
            inclination_deg=self._inclination_deg() if lip is None else lip.inclination_deg,
            lip=lip,
        )

    def plot(self) -> Figure:
        """Return a figure of the package's motion seen from the head, with bands of ±2σ."""
        return relative_figure(
            self.time_s,
            self.relative_mm,
            self.relative_rad,
            self.sigma,
            title=f"Motion of the {self.package_body.name} seen from the {self.head_body.name}"
            + (" (rendered recording)" if self.rendered else ""),
            phases_s=self.drinking().phases_s if self.in_world else {},
        )

    def to_dataframe(self) -> pd.DataFrame:
        """Return :meth:`columns` as a pandas table.

        Raises
        ------
        MotionError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            raise MotionError("pandas is not installed: pip install 'drinksim[notebook]'") from None
        return pd.DataFrame(self.columns())

    @property
    def in_world(self) -> bool:
        """Whether the motions of head and package in the world are known."""
        return bool(np.isfinite(self.head_rad[0]) and np.isfinite(self.head_mm[0, 0]))

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Motion):
            return NotImplemented
        return all(
            np.array_equal(getattr(self, field.name), getattr(other, field.name), equal_nan=True)
            if field.name in _ARRAYS
            else getattr(self, field.name) == getattr(other, field.name)
            for field in fields(self)
        )

    def __repr__(self) -> str:
        what = f"{self.package_body.name} seen from {self.head_body.name}"
        span = f"{self.time_s.size} instants, {self.time_s[0]:.2f} to {self.time_s[-1]:.2f} s"
        x, y, turn = np.median(self.sigma, axis=0)
        sigma = "" if np.isnan(x) else f", σ {np.hypot(x, y):.2f} mm {np.degrees(turn):.2f}°"
        return f"Motion({what}, {span}{sigma})"

    def _check_world(self) -> None:
        if not self.in_world:
            raise MotionError(
                "the motion holds no place of the head in the world: its file lacks "
                f"{', '.join(HEAD)}"
            )

    def _inclination_deg(self) -> float | None:
        """Return the angle above level of an opening that faces left, normal to its marks."""
        body = self.package_body
        if body.markers != ACROSS_THE_NECK or body.axis_rad is None:
            return None
        across = np.pi / 2 - body.axis_rad
        return float(np.degrees(np.arctan2(np.sin(across), np.cos(across))))

    def _header(self) -> dict[str, Value]:
        header: dict[str, Value] = {}
        for name, body in (("head", self.head_body), ("package", self.package_body)):
            header[f"{name}_body"] = body.name
            header[f"{name}_markers"] = list(body.markers)
            if body.axis_rad is not None:
                header[f"{name}_axis_deg"] = _axis_deg(body)
        if self.picture is not None:
            header["picture_x_px"], header["picture_y_px"] = self.picture.origin_px
            header["picture_px_per_mm"] = self.picture.px_per_mm
            if self.picture.mirrored:
                header["picture_mirrored"] = True
        header["rendered"] = self.rendered
        return header


_ARRAYS = {
    "time_s": 0,
    "relative_mm": 2,
    "relative_rad": 0,
    "sigma": 3,
    "head_mm": 2,
    "head_rad": 0,
    "package_mm": 2,
    "package_rad": 0,
}
"""Names of the arrays and their numbers of columns; 0 for (n,)."""


def _arrays(columns: dict[str, Array]) -> dict[str, Any]:
    """Return the arrays of a motion from the columns of its file; nan for missing ones."""
    unknown = np.full_like(columns["time_s"], np.nan)
    table = {name: columns.get(name, unknown) for name in COLUMNS}
    arrays = {"time_s": table["time_s"]}
    for body, (x, y, theta) in (("relative", RELATIVE), ("head", HEAD), ("package", PACKAGE)):
        arrays[f"{body}_mm"] = np.column_stack([table[x], table[y]])
        arrays[f"{body}_rad"] = np.radians(table[theta])
    x, y, theta = SIGMA
    return arrays | {"sigma": np.column_stack([table[x], table[y], np.radians(table[theta])])}


def _axis_deg(body: MarkedBody) -> float:
    """Return the direction of a body, rounded so that it is read back unchanged."""
    assert body.axis_rad is not None
    return round(float(np.degrees(body.axis_rad)), AXIS_DECIMALS)


def _of_header(header: dict[str, Any]) -> dict[str, Any]:
    about: dict[str, Any] = {
        f"{name}_body": MarkedBody(
            header.get(f"{name}_body", name),
            tuple(header.get(f"{name}_markers", ())),
            float(np.radians(header[f"{name}_axis_deg"])) if f"{name}_axis_deg" in header else None,
        )
        for name in ("head", "package")
    }
    about["rendered"] = header.get("rendered", False)
    picture = ("picture_x_px", "picture_y_px", "picture_px_per_mm")
    if all(key in header for key in picture):
        x, y, scale = (header[key] for key in picture)
        about["picture"] = PictureScale((x, y), scale, header.get("picture_mirrored", False))
    return about
