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
@pytest.mark.parametrize("name", ["head", "muscles", "a38-f"])
def test_pictures_of_the_documentation_are_drawn(name: str, tmp_path: Path) -> None:
    importlib.import_module("benchmarks.pictures").main([str(tmp_path), "--quick", name])
    with Image.open(tmp_path / f"{name}.png") as picture:
        assert min(picture.size) > 500
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 200
