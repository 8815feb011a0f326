"""Pytest plugin that prints what tests compare: the numbers behind a verification.

    python -m benchmarks.measured tests/verification/test_wrinkling.py::test_biots_half_space

Every assertion that holds is printed as it stands and with its values. Of one that holds several
times, and of arrays, the comparison that is farthest off stands for all.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

MOST_LETTERS = 160
"""Values longer than this are cut."""

APPROXIMATELY = re.compile(r"Obtained: (\S+) Expected: (\S+) ± (\S+)")


@dataclass(frozen=True)
class Compared:
    """What one assertion compared: in words, and how far off it was as a share of its tolerance."""

    values: str
    share: float
    times: int = 1

    def beside(self, other: Compared) -> Compared:
        """Return what stands for both."""
        worst = self if self.share > other.share else other
        return Compared(worst.values, worst.share, self.times + other.times)


_compared: dict[str, dict[str, Compared]] = {}
_compare_arrays = np.testing.assert_allclose


def _keep(test: str, assertion: str, compared: Compared) -> None:
    of_test = _compared.setdefault(test, {})
    before = of_test.get(assertion)
    of_test[assertion] = before.beside(compared) if before else compared


def pytest_assertion_pass(item: pytest.Item, lineno: int, orig: str, expl: str) -> None:
    """Keep what an assertion says and the values that made it hold."""
    values = " ".join(expl.split()).split(" + where ")[0]
    numbers = APPROXIMATELY.search(values)
    said = _approximately(*numbers.groups()) if numbers else Compared(values[:MOST_LETTERS], 0.0)
    _keep(item.nodeid, f"line {lineno}: {orig}", said)


def _approximately(obtained: str, expected: str, tolerance: str) -> Compared:
    value, wanted, within = float(obtained), float(expected), float(tolerance)
    apart = value - wanted
    percent = f", {100 * apart / wanted:+.3g} %" if wanted else ""
    words = f"{value:.7g} against {wanted:.7g} ± {within:.2g}{percent}"
    return Compared(words, abs(apart) / within if within else 0.0)


@pytest.fixture(autouse=True)
def _arrays_are_measured(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    def measured(
        actual: Any, desired: Any, rtol: float = 1e-7, atol: float = 0, **rest: Any
    ) -> None:
        _compare_arrays(actual, desired, rtol, atol, **rest)
        wanted = np.abs(np.asarray(desired, float))
        apart = np.abs(np.asarray(actual, float) - np.asarray(desired, float))
        share = np.max(apart / np.maximum(atol + rtol * wanted, 1e-300), initial=0.0)
        words = (
            f"largest deviation {np.max(apart, initial=0.0):.3g}, "
            f"largest value {np.max(wanted, initial=0.0):.4g}"
        )
        _keep(
            request.node.nodeid,
            f"arrays, rtol = {rtol:g}, atol = {atol:g}",
            Compared(words, float(share)),
        )

    monkeypatch.setattr(np.testing, "assert_allclose", measured)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Print every test with its comparisons."""
    for test, assertions in _compared.items():
        terminalreporter.section(test, sep="-")
        for assertion, compared in assertions.items():
            times = f" (the worst of {compared.times})" if compared.times > 1 else ""
            terminalreporter.write_line(f"  {assertion}\n      {compared.values}{times}")
