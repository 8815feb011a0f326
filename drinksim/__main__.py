"""The command line: ``python -m drinksim`` and the console script."""

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    from scenarios.cli.main import main as run

    return run(arguments)


if __name__ == "__main__":
    sys.exit(main())
