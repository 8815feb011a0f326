"""What continuous integration asks of a wheel fits the sources; versions agree."""

import importlib.util
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def script(name):
    """A script of continuous integration as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / ".ci" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_dependency_has_a_lowest_version():
    lowest = script("package").lowest()
    assert "numpy==2.1.*" in lowest
    assert len(lowest) >= len(PROJECT["dependencies"])


@pytest.mark.skipif(sys.platform != "linux", reason="continuous integration runs on Linux")
def test_pythons_are_found_oldest_first():
    supported = [
        name.rsplit(maxsplit=1)[-1] for name in PROJECT["classifiers"] if ":: Python :: 3." in name
    ]
    assert PROJECT["requires-python"] == f">={supported[0]}"
    found = subprocess.run(
        [ROOT / ".ci" / "pythons"], check=True, capture_output=True, text=True
    ).stdout.split()
    versions = [
        subprocess.run(
            [python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"],
            check=True, capture_output=True, text=True,
        ).stdout.strip()
        for python in found
    ]  # fmt: skip
    assert versions
    assert versions == [version for version in supported if version in versions]


def test_the_version_is_the_same_everywhere():
    version = PROJECT["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(rf"^version: {re.escape(version)}$", citation, re.MULTILINE)
    first = re.search(
        r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert version in first[1]


def test_those_who_are_cited_are_the_authors():
    names = re.findall(r'^  - name: "(.*)"$', (ROOT / "CITATION.cff").read_text(encoding="utf-8"),
                       re.MULTILINE)  # fmt: skip
    assert names == [author["name"] for author in PROJECT["authors"]]
