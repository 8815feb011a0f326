"""What every test may ask for."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

from tests.support.optional import recorded_file
from tests.support.shared import made_once

# Continuous integration draws the same examples every time; at a desk they are new ones.
settings.register_profile("ci", derandomize=True, deadline=None)
if os.environ.get("CI"):
    settings.load_profile("ci")

FIRST = (
    "tests/end_to_end/test_pages.py",
    "tests/mocap/tracking/test_tracking.py",
    "tests/drinksim/test_examples.py",
    "tests/end_to_end/",
    "tests/mocap/",
)
"""What runs first, in this order: long files, and on two workers of a new clone such as need
different kernels, so that neither compiles what the other does."""


def turn(test: str) -> int:
    """Return the place of a test, by its identifier, in the order of :data:`FIRST`."""
    return next((k for k, place in enumerate(FIRST) if test.startswith(place)), len(FIRST))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort tests by their turn; those of one turn keep their order."""
    items.sort(key=lambda item: turn(item.nodeid))


@pytest.fixture(scope="session")
def recorded() -> Callable[[str], Path]:
    """Return a recording that others made by its name; skips where it is absent."""
    return recorded_file


@pytest.fixture(scope="session")
def library_motion(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return the motion.csv of a library scenario's whole film by the scenario's name."""

    def motion(name: str) -> Path:
        from scenarios.settings.scenario import load_scenario
        from scenarios.sip.run import convert_recording

        recording = load_scenario(name).recording
        assert recording is not None
        folder = made_once(
            tmp_path_factory.getbasetemp(),
            f"motion of {name}",
            lambda out: convert_recording(recording, out, progress=lambda share, what: None),
        )
        return folder / "motion.csv"

    return motion
