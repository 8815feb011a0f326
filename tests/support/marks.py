"""Marks for single cases of a parametrised test."""

import pytest
from _pytest.mark.structures import ParameterSet


def slow(*values: object) -> ParameterSet:
    """Return a case that ``-m 'not slow'`` leaves out."""
    return pytest.param(*values, marks=pytest.mark.slow)
