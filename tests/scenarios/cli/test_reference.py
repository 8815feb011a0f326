"""The reference page, the help of commands, TOML and the dataclasses say the same."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from scenarios.cli.options import option_of
from scenarios.cli.reference import settings_of_commands, settings_page
from scenarios.settings.layers import values_by_path
from scenarios.settings.scenario import MotionFile, Scenario, load_scenario, resolved_toml
from scenarios.settings.tables import keys_of, table_from
from scenarios.settings.writing import about, toml_value
from tests.scenarios.cli.test_cli import help_of

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "settings.md"
DEFAULTS = Scenario("mine", motion=MotionFile("/motion.csv"))


def rows(heading: str) -> dict[str, list[str]]:
    """Return the cells of the first table below a heading of the page, by the first cell."""
    below = PAGE.read_text(encoding="utf-8").split(f"\n## `{heading}`\n")[1].split("\n## ")[0]
    lines = re.findall(r"^\| `(.*?)` \| (.*) \|$", below.split("stands for:")[0], re.MULTILINE)
    return {name: [cell.strip() for cell in cells.split(" | ")] for name, cells in lines}


def test_the_page_is_the_one_that_the_code_makes() -> None:
    remedy = "python -m scenarios.cli.reference > docs/reference/settings.md"
    assert PAGE.read_text(encoding="utf-8") == settings_page(), remedy


def test_every_key_of_a_scenario_is_on_the_page_with_its_default() -> None:
    values = values_by_path(DEFAULTS)
    for key in keys_of(Scenario):
        table, _, name = key.path.rpartition(".")
        if not table or table == "filmed":
            continue
        unit, default = rows(f"[{table}]")[name][:2]
        assert unit == (key.field.metadata.get("unit") or "")
        if key.path in values and table != "motion":
            assert default == f"`{toml_value(values[key.path])}`", key.path
        else:
            optional = table.partition(".")[0] in ("muscle", "muscles", "liquid")
            assert default in ("absent", "required") or optional, key.path


OPTIONAL = ("recording.", "filmed.", "muscle.", "muscles.", "liquid.", "head.jaw.")
"""Tables that may be absent, and are by default."""


def test_the_printed_file_has_the_same_keys_values_and_meanings() -> None:
    text = resolved_toml(DEFAULTS)
    assert table_from(Scenario, tomllib.loads(text), where="") == DEFAULTS
    for key in keys_of(Scenario):
        if key.path.startswith(OPTIONAL):
            continue
        described = [
            line for line in text.splitlines() if re.match(rf"(# )?{key.field.name} =", line)
        ]
        meaning = str(key.field.metadata["description"])
        assert any(meaning in line for line in described), key.path


@pytest.mark.parametrize("command", settings_of_commands())
def test_options_of_studies_are_those_of_their_tables(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = help_of(capsys, command)
    page = rows(f"drinksim {command}")
    for key in keys_of(settings_of_commands()[command]):
        option = option_of(key.field.name)
        value = f"{{{','.join(key.choices)}}}" if key.choices else "VALUE"
        meant = f"{about(key.field)} (default: {key.field.default})"
        assert f"{option} {value} {meant}" in shown
        assert page[option][1] == f"`{toml_value(key.field.default)}`"


def test_short_options_of_a_replay_are_settings(capsys: pytest.CaptureFixture[str]) -> None:
    shown = help_of(capsys, "replay")
    for name in ("plane", "resolution"):
        (key,) = (key for key in keys_of(Scenario) if key.path == f"numerics.{name}")
        assert f"--{name} {{{','.join(key.choices)}}} {about(key.field)}" in shown


def test_presets_are_on_the_page() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name in ("quick", "coarse", "fine"):
        mesh = load_scenario("A38-F", [f"numerics.resolution={name}"]).numerics.mesh
        assert re.search(rf"^\| `mesh.contact_mm` \|.* {mesh.contact_mm} \|", text, re.MULTILINE)
