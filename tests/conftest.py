"""What every test may ask for."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

from tests.support.optional import recorded_file

# Continuous integration draws the same examples every time; at a desk they are new ones.
settings.register_profile("ci", derandomize=True, deadline=None)
if os.environ.get("CI"):
    settings.load_profile("ci")


@pytest.fixture(scope="session")
def recorded() -> Callable[[str], Path]:
    """Return a recording that others made by its name; skips where it is absent."""
    return recorded_file
