"""What the README tells a newcomer to type exists and is spelled right."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from scenarios.cli.parser import drinksim_parser

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = sorted(set(re.findall(r"`drinksim ([^`]+)`", README)))


def test_quick_start_is_one_block_of_two_lines_that_make_knows():
    start = README.split("## Quick start")[1].split("\n## ")[0]
    blocks = re.findall(r"```(\w*)\n(.*?)```", start, flags=re.DOTALL)
    assert blocks == [("sh", "make demo\nmake test\n")]
    targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert {"demo", "test"} <= set(targets)


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_are_accepted(command):
    arguments = shlex.split(command)
    if "--help" in arguments:
        with pytest.raises(SystemExit) as stop:
            drinksim_parser().parse_args(arguments)
        assert stop.value.code == 0
    else:
        drinksim_parser().parse_args(arguments)


def test_links_and_pictures_exist():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target


def test_version_is_in_the_changelog():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert "## Unreleased" in changelog or project["version"] in changelog
