"""The documentation does what it says: every block runs, every command exists."""

import ast
import re
import shlex
from pathlib import Path

import pytest

from scenarios.cli.parser import drinksim_parser
from scenarios.settings.scenario import load_scenario, resolved_toml
from tests.support.pages import ROOT, Reader, blocks, commands, pages

PAGES = pages()
LANGUAGES = {"sh", "python", "text", "toml", "csv", "xml", ""}
SLOW = ("tutorials/", "how-to/", "reference/scenario")


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def marked(page: Path) -> object:
    slow = any(part in name(page) for part in SLOW)
    return pytest.param(page, id=name(page), marks=[pytest.mark.slow] if slow else [])


TYPED = [page for page in PAGES if any(block.runs for block in blocks(page))]
LEFT_OUT = [
    pytest.param(block, id=f"{name(page)}:{block.line}")
    for page in PAGES
    for block in blocks(page)
    if block.not_run
]


@pytest.mark.parametrize("page", [marked(page) for page in TYPED])
def test_what_a_page_tells_to_type_runs_and_prints_what_it_shows(page, tmp_path):
    Reader(page, tmp_path).read()


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_fences_say_what_they_are(page):
    directives = re.findall(r"^```\{(\w[\w-]*)\}", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(directives) <= {"toctree", "eval-rst"}
    assert {block.language for block in blocks(page)} <= LANGUAGES


@pytest.mark.parametrize("block", LEFT_OUT)
def test_what_is_not_run_says_why_and_is_spelled_right(block):
    assert len(block.not_run.split()) >= 3
    if block.language == "python":
        ast.parse(block.text)
    for command in commands(block.text):
        drinksim_parser().parse_args(shlex.split(command))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_what_makes_a_number_exists(page):
    text = page.read_text(encoding="utf-8")
    for file, test in re.findall(r"(tests/[\w/]+\.py)(?:::(\w+))?", text):
        source = (ROOT / file).read_text(encoding="utf-8")
        assert not test or re.search(rf"def {test}\b", source), f"{file} has no {test}"
    for script in re.findall(r"benchmarks[./](\w+)", text):
        assert list((ROOT / "benchmarks").glob(f"{script}.*")), script


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_modules_that_a_page_names_exist(page):
    text = page.read_text(encoding="utf-8")
    for module in re.findall(r"`((?:geometry2d|mocap|fem2d|scenarios|drinksim)/[\w/]+\.py)`", text):
        assert (ROOT / module).is_file(), module


def test_every_table_of_a_scenario_is_in_the_reference():
    page = (ROOT / "docs" / "reference" / "scenario.md").read_text(encoding="utf-8")
    tables = re.findall(
        r"^(?:# )?\[([\w.]+)\]", resolved_toml(load_scenario("DC-AE")), re.MULTILINE
    )
    assert {f"`[{table}]`" for table in tables} == set(
        re.findall(r"^\| (`\[[\w.]+\]`) \|", page, re.M)
    )


def test_every_command_is_in_the_reference():
    page = (ROOT / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
    (commands_of_parser,) = (
        action.choices for action in drinksim_parser()._actions if isinstance(action.choices, dict)
    )
    assert set(re.findall(r"^\| `drinksim (\w+)", page, re.M)) == set(commands_of_parser)
