"""What a test measures: every comparison it makes, with both sides.

    python -m benchmarks.measured TEST [TEST ...]

``TEST`` is what pytest takes: a file, or a file and a test (``FILE::NAME``). The verification pages
of the documentation name the test behind each number.
"""

from __future__ import annotations

import sys
import tempfile

import pytest


def main(tests: list[str]) -> int:
    """Run the tests and print what they compare."""
    with tempfile.TemporaryDirectory() as cache:
        # Assertions that tell their values are compiled differently: keep them apart.
        sys.pycache_prefix = cache
        told = ["-o", "enable_assertion_pass_hook=true", "-p", "tests.support.measured"]
        return int(pytest.main(["-q", "--no-header", *told, *tests]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
