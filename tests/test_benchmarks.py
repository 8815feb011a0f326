"""Benchmarks are run by hand and seldom: what they import must exist all the same."""

import importlib
from pathlib import Path

import pytest
from PIL import Image

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
OF_OTHERS = {"lip_press_dolfinx", "lip_press_felupe"}
"""Run in environments of their own, beside a library that this one lacks."""
NAMES = sorted(path.stem for path in BENCHMARKS.glob("*.py") if path.stem not in OF_OTHERS)


@pytest.mark.parametrize("name", NAMES)
def test_a_benchmark_finds_what_it_imports(name):
    assert importlib.import_module(f"benchmarks.{name}").__doc__


def test_every_picture_of_the_documentation_is_drawn_by_its_benchmark():
    shown = {path.stem for path in (BENCHMARKS.parent / "docs" / "pictures").glob("*")}
    assert shown == importlib.import_module("benchmarks.pictures").PICTURES.keys()


@pytest.mark.slow
def test_the_table_of_the_filming_guide_is_measured():
    errors = importlib.import_module("benchmarks.filming_errors")
    good = errors.measured(errors.CASES["as the guide says"], 0)
    assert good.error_mm < 3 * good.stated_mm < 0.1
    assert good.seen == 1.0
    rolled = errors.measured(errors.CASES["camera rolled by 3°"], 0)
    assert rolled.error_mm > 100 * good.stated_mm
    guide = (BENCHMARKS.parent / "docs" / "how-to" / "filming.md").read_text(encoding="utf-8")
    assert [name for name in errors.CASES if f"| {name} |" not in guide] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["head", "muscles", "a38-f", "filming-setup", "filming-places", "filming-dots"]
)
def test_pictures_of_the_documentation_are_drawn(name: str, tmp_path: Path) -> None:
    importlib.import_module("benchmarks.pictures").main([str(tmp_path), "--quick", name])
    with Image.open(tmp_path / f"{name}.png") as picture:
        assert min(picture.size) > 500
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 200
