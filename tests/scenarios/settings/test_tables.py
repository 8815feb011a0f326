"""Tables of settings: what is read, what is refused, and in which words."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting
from scenarios.settings.files import split_setting
from scenarios.settings.tables import Key, SettingError, check, keys_of, table_from
from scenarios.settings.writing import about, toml_lines


@dataclass(frozen=True)
class Lamp:
    """A table with every kind of field."""

    power_w: float = setting(unit="W", minimum=0.0, maximum=100.0, description="what it draws")
    colour: Literal["warm", "cold"] = setting(
        default="warm", description="of its light", source="the box"
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
        ({"power_w": 1.0, "color": "warm"}, "unknown key lamp.color: did you mean lamp.colour?"),
        ({"power_w": 1.0, "zzz": 1}, "unknown key lamp.zzz: known: angles_deg, bulbs"),
        ({"power_w": 101.0}, "lamp.power_w = 101 W is too large: at most 100 W"),
        ({"power_w": -1}, "lamp.power_w = -1 W is too small: at least 0 W"),
        ({"power_w": float("nan")}, "lamp.power_w = nan W is not a finite number"),
        ({"power_w": "bright"}, r'lamp.power_w = "bright": give a number \(W\)'),
        ({"power_w": True}, "lamp.power_w = true: give a number"),
        ({}, "lamp.power_w is missing: what it draws"),
        ({"power_w": 1.0, "colour": "wram"}, 'lamp.colour = "wram" is not a choice: did you mean'),
        ({"power_w": 1.0, "height_mm": "high"}, 'lamp.height_mm = "high": give a number or "auto"'),
        ({"power_w": 1.0, "bulbs": 1.5}, "lamp.bulbs = 1.5: give a whole number"),
        ({"power_w": 1.0, "dimmed": 1}, "lamp.dimmed = 1: give true or false"),
        ({"power_w": 1.0, "angles_deg": ["a"]}, 'lamp.angles_deg = "a": give a list of numbers'),
    ],
)
def test_what_is_wrong_is_refused_in_words(values: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        table_from(Lamp, values, where="lamp")


def test_a_value_in_place_of_a_table_is_refused() -> None:
    with pytest.raises(SettingError, match="write it as a table"):
        table_from(Lamp, 5, where="lamp")  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["contact.friction", "=1", "contact.=1", ""])
def test_a_setting_without_key_or_value_is_refused(text: str) -> None:
    with pytest.raises(SettingError, match=r"table\.key=value"):
        split_setting(text)


def test_settings_are_toml_or_plain_text() -> None:
    assert split_setting("a.b = [1, 2]") == ("a.b", [1, 2])
    assert split_setting("package.neck=my neck.svg") == ("package.neck", "my neck.svg")
    assert split_setting('x="quoted = text"') == ("x", "quoted = text")


def test_lines_carry_unit_meaning_and_source() -> None:
    line = toml_lines(Lamp(power_w=5.0))[1]
    assert line.startswith('colour = "warm"')
    assert line.endswith("# of its light (warm, cold) [the box]")
    assert about(fields(Lamp)[0]) == "W: what it draws"


def test_a_value_that_was_changed_does_not_claim_the_source_of_the_default() -> None:
    line = toml_lines(Lamp(power_w=5.0, colour="cold"))[1]
    assert line.endswith('# of its light (warm, cold) (changed from "warm")')


class ShadeError(DrinksimError):
    """A shade that cannot be."""


@dataclass(frozen=True)
class Shade:
    """A table with a rule of its own."""

    inner_mm: float = setting(default=1.0, unit="mm", above=0.0, description="inside")
    outer_mm: float = setting(default=2.0, unit="mm", description="outside")

    def __post_init__(self) -> None:
        if self.inner_mm >= self.outer_mm:
            raise ShadeError(f"inner_mm {self.inner_mm:g} leaves no shade")


SHADES = {"small": Shade(), "large": Shade(10.0, 20.0)}


@dataclass(frozen=True)
class Stand:
    """A table with tables inside it: one of its own, one inline, one chosen by name."""

    name: str = setting(example="hall", description="where it stands")
    lamp: Lamp = setting(default=Lamp(power_w=40.0), omit=("note",), description="its lamp")
    shape: Literal["round", "square"] = setting(default="round", description="of the foot")
    size: str = setting(default="small", presets=SHADES, of="shade", description="of the shade")
    shade: Shade = setting(default=SHADES["small"], inline=True, description="its shade")
    spare: Lamp | None = setting(default=None, description="in the cupboard")


def test_tables_inside_tables_are_read_and_written() -> None:
    document = {
        "name": "hall", "size": "large", "outer_mm": 30.0, "lamp": {"bulbs": 2},
        "spare": {"power_w": 25.0},
    }  # fmt: skip
    stand = table_from(Stand, document, where="stand")
    assert stand == Stand(
        "hall", Lamp(power_w=40.0, bulbs=2), "round", "large", Shade(10.0, 30.0), Lamp(power_w=25.0)
    )
    again = tomllib.loads("\n".join(toml_lines(stand)))
    assert table_from(Stand, again, where="stand") == stand
    assert table_from(Stand, {"name": "x"}, where="").spare is None


def test_keys_of_tables_inside_tables_are_named_with_them() -> None:
    paths = [key.path for key in keys_of(Stand, where="stand")]
    assert "stand.lamp.bulbs" in paths and "stand.inner_mm" in paths
    assert "stand.lamp.note" not in paths
    for wrong, message in (
        ({"lamp": {"bulps": 2}}, "unknown key stand.lamp.bulps: did you mean stand.lamp.bulbs"),
        ({"bulbs": 2}, r"unknown key stand.bulbs: did you mean stand.lamp.bulbs or stand.spare"),
        ({"lamp": {"note": "x"}}, "unknown key stand.lamp.note"),
        ({"lamp": 5}, r"stand.lamp = 5: write it as a table, \[stand.lamp\]"),
        ({"spare": {"bulbs": 2}}, "stand.spare.power_w is missing: what it draws"),
        ({"size": "larg"}, 'stand.size = "larg" is not a choice: did you mean .large'),
        ({"inner_mm": 5.0}, r"^stand.inner_mm 5 leaves no shade$"),
        ({"outer_mm": 0.5}, r"^stand.outer_mm = 0.5 mm: stand.inner_mm 1 leaves no shade$"),
        ({"name": ""}, 'stand.name = "": give a text in quotes, e.g. name = "hall"'),
    ):
        with pytest.raises(SettingError, match=message):
            table_from(Stand, {"name": "hall", **wrong}, where="stand")


def test_a_table_made_in_memory_is_checked_like_a_file() -> None:
    with pytest.raises(SettingError, match=r"lamp.bulbs = 0 is too small: at least 1"):
        check(Stand("hall", Lamp(power_w=1.0, bulbs=0)))
    with pytest.raises(SettingError, match=r'lamp.power_w = "5": give a number'):
        check(Stand("hall", Lamp(power_w="5")))  # type: ignore[arg-type]
    check(Stand("hall"))


def test_choices_are_those_of_the_type() -> None:
    choices = {part.path: part.choices for part in keys_of(Lamp) if isinstance(part, Key)}
    assert choices["colour"] == ("warm", "cold")
    assert choices["height_mm"] == ()
