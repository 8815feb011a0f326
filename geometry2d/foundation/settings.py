"""Fields of frozen dataclasses with unit, range, meaning and source.

A dataclass whose fields are made by :func:`setting` is the only source of its defaults. Scenario
files, command-line options, their help and the reference tables are derived from it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from geometry2d.foundation.errors import DrinksimError


def setting(
    *,
    description: str,
    default: Any = dataclasses.MISSING,
    unit: str = "",
    source: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    above: float | None = None,
    spread: float | None = None,
    **more: Any,
) -> Any:
    """Return a dataclass field with metadata.

    Parameters
    ----------
    description, unit, source
        Meaning, unit and source of the value.
    default
        Default value; without it the field is required.
    minimum, maximum, above
        Bounds of the number, or of each number in a tuple. ``above`` is excluded, the others are
        allowed.
    spread
        Standard deviation among people, if a source states it.
    more
        Metadata for particular readers, such as the roles of :mod:`scenarios.settings.tables`.
    """
    metadata = {
        "description": description,
        "unit": unit,
        "source": source,
        "minimum": minimum,
        "maximum": maximum,
        "above": above,
        "spread": spread,
        **more,
    }
    return dataclasses.field(default=default, metadata=metadata)


def measured(
    default: float | None,
    unit: str,
    source: str,
    description: str,
    spread: float | None = None,
    **bounds: float,
) -> Any:
    """Return the field of a measurement; arguments as for :func:`setting`."""
    return setting(
        default=default, unit=unit, source=source, description=description, spread=spread, **bounds
    )


def in_unit(number: float, metadata: Mapping[str, Any]) -> str:
    """Return a number with the unit of its field.

    >>> in_unit(0.5, {"unit": "mm"}), in_unit(2, {})
    ('0.5 mm', '2')
    """
    unit = metadata.get("unit") or ""
    return f"{number:g} {unit}" if unit else f"{number:g}"


def range_error(number: float, metadata: Mapping[str, Any]) -> str | None:
    """Return the end of a message about a number out of its range; None if it is in its range.

    >>> range_error(-1.0, {"minimum": 0.0, "unit": "mm"})
    'is too small: at least 0 mm'
    >>> range_error(0.0, {"above": 0.0})
    'is too small: more than 0'
    >>> range_error(1.0, {})
    """
    low, high = metadata.get("minimum"), metadata.get("maximum")
    above = metadata.get("above")
    if not math.isfinite(number):
        return "is not a finite number"
    if low is not None and number < low:
        return f"is too small: at least {in_unit(low, metadata)}"
    if above is not None and number <= above:
        return f"is too small: more than {in_unit(above, metadata)}"
    if high is not None and number > high:
        return f"is too large: at most {in_unit(high, metadata)}"
    return None


def check_ranges(table: Any, error: type[DrinksimError]) -> None:
    """Raise ``error`` if a number of a dataclass is not finite or out of its range."""
    for field in dataclasses.fields(table):
        value = getattr(table, field.name)
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, int | float) and not isinstance(number, bool):
                wrong = range_error(number, field.metadata)
                if wrong is not None:
                    raise error(f"{field.name} = {in_unit(number, field.metadata)} {wrong}")
