"""The table of a study: a row a sip, as Parquet and as CSV."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from geometry2d.foundation.delimited import safe_cell
from geometry2d.foundation.output import file_at_once
from scenarios.campaign.engine import INSTALL
from scenarios.campaign.variation import StudyError

PARQUET_FILE = "results.parquet"

Row = Mapping[str, Any]


def check_tables() -> None:
    """Raise :class:`StudyError` if what writes tables is not installed."""
    _arrow()


def columns_of(rows: Sequence[Row]) -> list[str]:
    """Return the names of all columns, in the order in which they come."""
    return list(dict.fromkeys(name for row in rows for name in row))


def write_csv(rows: Sequence[Row], out: Path) -> None:
    """Write rows as CSV; what a row lacks is empty."""
    names = columns_of(rows)
    with file_at_once(out) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(names)
        writer.writerows([_written(row.get(name)) for name in names] for row in rows)


def write_parquet(rows: Sequence[Row], out: Path) -> None:
    """Write rows as Parquet; what a row lacks is null.

    Raises
    ------
    StudyError
        If pyarrow is not installed.
    """
    pyarrow, parquet = _arrow()
    columns = {name: _column([row.get(name) for row in rows]) for name in columns_of(rows)}
    with file_at_once(out) as partial:
        parquet.write_table(pyarrow.table(columns), partial)


def read_parquet(file: Path) -> list[dict[str, Any]]:
    """Return the rows of a table.

    Raises
    ------
    StudyError
        If pyarrow is not installed, or the file is no such table.
    """
    _, parquet = _arrow()
    try:
        rows: list[dict[str, Any]] = parquet.read_table(file).to_pylist()
    except (OSError, ValueError) as error:
        raise StudyError(f"{file}: is no table of a study ({error})") from None
    return rows


def _column(values: list[Any]) -> list[Any]:
    """Return values of one kind: numbers where all are, texts otherwise."""
    known = [value for value in values if value is not None]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in known):
        if all(isinstance(value, int) for value in known):
            return values
        return [None if value is None else float(value) for value in values]
    if all(isinstance(value, bool) for value in known):
        return values
    return [None if value is None else str(value) for value in values]


def _written(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return safe_cell(value)
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise StudyError(f"pyarrow is not installed, which tables need: {INSTALL}") from None
    return pyarrow, parquet
