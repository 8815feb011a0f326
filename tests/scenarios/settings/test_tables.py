"""Tables of settings: what is read, what is refused, and in which words."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry2d.foundation.settings import setting
from scenarios.settings.tables import (
    SettingError,
    about,
    split_override,
    table_from,
    toml_lines,
)


@dataclass(frozen=True)
class Lamp:
    """A table with every kind of field."""

    power_w: float = setting(unit="W", minimum=0.0, maximum=100.0, description="what it draws")
    colour: str = setting(
        default="warm", choices=("warm", "cold"), description="of its light", source="the box"
    )
    height_mm: float | Literal["auto"] = setting(default="auto", unit="mm", description="above")
    bulbs: int = setting(default=1, minimum=1, description="how many")
    dimmed: bool = setting(default=False, description="whether")
    angles_deg: tuple[float, ...] = setting(default=(0.0, 90.0), unit="deg", description="arms")
    note: str | None = setting(default=None, description="anything")


@given(
    st.builds(
        Lamp,
        power_w=st.floats(0, 100),
        colour=st.sampled_from(["warm", "cold"]),
        height_mm=st.floats(-1e300, 1e300) | st.just("auto"),
        bulbs=st.integers(1, 10**6),
        dimmed=st.booleans(),
        angles_deg=st.lists(st.floats(-360, 360)).map(tuple),
        note=st.none() | st.text(),
    )
)
def test_a_table_written_as_toml_reads_back_the_same(lamp: Lamp) -> None:
    document = tomllib.loads("\n".join(toml_lines(lamp)))
    assert table_from(Lamp, document, where="lamp") == lamp


def test_whole_numbers_are_numbers() -> None:
    assert table_from(Lamp, {"power_w": 5}, where="lamp").power_w == 5.0


def test_values_are_laid_over_a_base() -> None:
    base = Lamp(power_w=7.0, colour="cold")
    lamp = table_from(Lamp, {"power_w": 8.0}, where="lamp", base=base)
    assert (lamp.power_w, lamp.colour) == (8.0, "cold")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"power_w": 1.0, "color": "warm"}, "unknown key lamp.color: did you mean 'colour'?"),
        ({"power_w": 1.0, "zzz": 1}, "unknown key lamp.zzz: known: angles_deg, bulbs"),
        ({"power_w": 101.0}, "lamp.power_w = 101 W is too large: at most 100 W"),
        ({"power_w": -1}, "lamp.power_w = -1 W is too small: at least 0 W"),
        ({"power_w": float("nan")}, "lamp.power_w = nan: give a finite number"),
        ({"power_w": "bright"}, r"lamp.power_w = 'bright': give a number \(W\)"),
        ({"power_w": True}, "lamp.power_w = True: give a number"),
        ({}, "lamp.power_w is missing: what it draws"),
        ({"power_w": 1.0, "colour": "wram"}, "lamp.colour = 'wram' is not a choice: did you mean"),
        ({"power_w": 1.0, "height_mm": "high"}, "lamp.height_mm = 'high': give a number or 'auto'"),
        ({"power_w": 1.0, "bulbs": 1.5}, "lamp.bulbs = 1.5: give a whole number"),
        ({"power_w": 1.0, "dimmed": 1}, "lamp.dimmed = 1: give true or false"),
        ({"power_w": 1.0, "angles_deg": ["a"]}, "lamp.angles_deg = 'a': give a number"),
    ],
)
def test_what_is_wrong_is_refused_in_words(values: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        table_from(Lamp, values, where="lamp")


def test_a_value_in_place_of_a_table_is_refused() -> None:
    with pytest.raises(SettingError, match="write it as a table"):
        table_from(Lamp, 5, where="lamp")  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["contact.friction", "=1", "contact.=1", ""])
def test_an_override_without_key_or_value_is_refused(text: str) -> None:
    with pytest.raises(SettingError, match=r"table\.key=value"):
        split_override(text)


def test_overrides_are_toml_or_plain_text() -> None:
    assert split_override("a.b = [1, 2]") == (["a", "b"], [1, 2])
    assert split_override("package.neck=my neck.svg") == (["package", "neck"], "my neck.svg")
    assert split_override('x="quoted = text"') == (["x"], "quoted = text")


def test_lines_carry_unit_meaning_and_source() -> None:
    line = toml_lines(Lamp(power_w=5.0))[1]
    assert line.startswith('colour = "warm"')
    assert line.endswith("# of its light [the box]")
    assert about(fields(Lamp)[0]) == "W: what it draws"
