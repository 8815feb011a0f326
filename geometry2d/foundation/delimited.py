"""Tables in delimited text: CSV as this program, spreadsheets and other programs write it.

Commas, semicolons or tabs separate the cells; the header decides, or a first line ``sep=;`` as
Excel writes it. If commas do not separate cells, they may be decimal: ``1,5`` is then one and a
half in the whole table. Blank rows are ignored. A file whose last row is cut off is an error.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import number, quoted, text_of

Array = NDArray[np.float64]

SEPARATORS = ",;\t"
STATED = re.compile(r'"?sep=([,;\t|])"?', re.IGNORECASE)
"""Excel's first line, which states the separator."""

LARGEST = 1e12
"""Largest absolute value of a number, in any unit."""

STARTS_FORMULA = ("=", "+", "-", "@")
"""First characters of cells that spreadsheets evaluate."""


class TableRow(NamedTuple):
    """The cells of a row, stripped of white space, and the number of its last line."""

    line: int
    cells: list[str]


@dataclass(frozen=True)
class Rows:
    """The rows of a table, with its header, and the separator of its cells."""

    file: Path
    rows: list[TableRow]
    separator: str
    complete: bool
    """Whether the last line has a line end."""


def rows_of(file: Path, text: str, *, error: type[DrinksimError], separator: str = "") -> Rows:
    """Return the rows of a text that are not blank.

    Parameters
    ----------
    file
        Where the text is from, for messages.
    text
        Its lines end in a line feed.
    error
        What to raise.
    separator
        Separator of the cells; if empty, the first row decides.

    Raises
    ------
    DrinksimError
        An ``error`` if a quotation is not closed or a cell is too long.
    """
    stated, table = _stated_separator(text)
    skipped = text.count("\n", 0, len(text) - len(table))
    header = table.partition("\n")[0]
    separator = stated or separator or max(SEPARATORS, key=header.count)
    reader = csv.reader(io.StringIO(table, newline=""), delimiter=separator, strict=True)
    rows: list[TableRow] = []
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(stripped):
                rows.append(TableRow(reader.line_num + skipped, stripped))
    except csv.Error as problem:
        line = reader.line_num + skipped
        if "field limit" in str(problem):
            reason = f"a cell has more than {csv.field_size_limit()} characters"
        else:
            reason = "a quotation mark is not closed, or text follows the closing one"
        raise error(f"{file} line {line}: {reason}; mend the row") from None
    return Rows(file, rows, separator, text.endswith("\n"))


def header_line(text: str) -> str:
    """Return the first line of a table that is not blank and states no separator."""
    return _stated_separator(text)[1].partition("\n")[0]


def _stated_separator(text: str) -> tuple[str, str]:
    """Return the separator that the first line states, empty if it states none, and the table."""
    table = text.lstrip("\n")
    first, _, rest = table.partition("\n")
    stated = STATED.fullmatch(first)
    return (stated[1], rest.lstrip("\n")) if stated else ("", table)


@dataclass(frozen=True)
class NamedTable:
    """A table whose first row names its columns.

    Parameters
    ----------
    file
        For messages.
    header
        The names of the columns.
    rows
        The rows below, each as wide as the header.
    separator
        Separator of their cells.
    error
        What to raise.
    """

    file: Path
    header: tuple[str, ...]
    rows: list[TableRow]
    separator: str
    error: type[DrinksimError]
    _decimals: set[str] = field(default_factory=set, repr=False, compare=False)

    def texts(self, name: str) -> list[str]:
        """Return the cells of a column."""
        k = self.header.index(name)
        return [plain_cell(row.cells[k]) for row in self.rows]

    def numbers(self, name: str, *, blank: bool = False) -> Array:
        """Return the numbers (n,) of a column.

        Parameters
        ----------
        name
            The column.
        blank
            Whether cells may be empty; they are nan.

        Raises
        ------
        DrinksimError
            An ``error`` that names file, line, column and cell if one is no finite number.
        """
        k = self.header.index(name)
        return np.array([self._number(row, k, name, blank) for row in self.rows], float)

    def _number(self, row: TableRow, k: int, name: str, blank: bool) -> float:
        cell = row.cells[k]
        where = f"{self.file} line {row.line}: {name} = {quoted(cell)}"
        if blank and not cell:
            return float("nan")
        value = decimal_number(cell, self.separator, self._decimals)
        if value is None:
            raise self.error(f"{where} is not a finite number; write one, such as 1.5")
        if len(self._decimals) > 1:
            raise self.error(
                f"{where}: the table has decimal points and decimal commas; write one of them"
            )
        if abs(value) > LARGEST:
            raise self.error(f"{where} is too large; check the unit")
        return value


def decimal_number(cell: str, separator: str, decimals: set[str]) -> float | None:
    """Return the number in a cell, None if it is none; add its decimal mark to ``decimals``."""
    if "," in cell:
        if separator == "," or cell.count(",") > 1 or "." in cell:
            return None
        decimals.add(",")
        cell = cell.replace(",", ".")
    elif "." in cell:
        decimals.add(".")
    return number(cell)


def read_named_table(
    file: Path, columns: Sequence[str], *, what: str, error: type[DrinksimError]
) -> NamedTable:
    """Return a table from a file of delimited text in UTF-8.

    Parameters
    ----------
    file
        The file.
    columns
        Names that its header must have; others may stand beside them.
    what
        What it is, for messages: "table of tracks".
    error
        What to raise.

    Raises
    ------
    DrinksimError
        An ``error`` if the file cannot be read, a column is missing or doubled, a row is wider or
        narrower than the header, or the last row is cut off.
    """
    return named_table(file, text_of(file, what=what, error=error), columns, what=what, error=error)


def named_table(
    file: Path, text: str, columns: Sequence[str], *, what: str, error: type[DrinksimError]
) -> NamedTable:
    """Return a table from its text; arguments and errors as for :func:`read_named_table`."""
    found = rows_of(file, text, error=error)
    if not found.rows:
        raise error(f"{file}: is empty; a {what} begins with {','.join(columns)}")
    header, rows = found.rows[0].cells, found.rows[1:]
    missing = [name for name in columns if name not in header]
    if missing:
        raise error(
            f"{file}: its header lacks {', '.join(missing)}; a {what} has the columns "
            f"{','.join(columns)}"
        )
    doubled = [name for name in columns if header.count(name) > 1]
    if doubled:
        raise error(f"{file}: its header names {doubled[0]} twice; rename or remove one column")
    if not rows:
        raise error(f"{file}: holds no rows below its header")
    refuse_cut(file, rows, len(header), complete=found.complete, error=error)
    refuse_other_width(found, rows, len(header), error)
    return NamedTable(file, tuple(header), rows, found.separator, error)


def refuse_cut(
    file: Path, rows: Sequence[TableRow], width: int, *, complete: bool, error: type[DrinksimError]
) -> None:
    """Raise an error if the last row is cut off.

    It is if it has no line end and either has fewer cells than there are columns, or its last
    number has fewer decimals than that of every other row.

    Parameters
    ----------
    file
        For the message.
    rows
        The rows below the header.
    width
        Number of columns.
    complete
        Whether the last line has a line end; the last row is then complete.
    error
        What to raise.
    """
    if complete or not rows:
        return
    *others, last = rows
    short = len(last.cells) < width
    if others and len(last.cells) == width:
        short = _decimals(last.cells[-1]) < min(_decimals(row.cells[-1]) for row in others)
    if short:
        raise error(
            f"{file} line {last.line}: was cut short in its last row; copy the file again, or "
            "remove the row"
        )


def _decimals(cell: str) -> int:
    """Return the number of digits after the decimal mark; 0 if there is none."""
    mark = max(cell.rfind("."), cell.rfind(","))
    return len(cell) - 1 - mark if mark >= 0 else 0


def refuse_other_width(
    found: Rows, rows: Sequence[TableRow], width: int, error: type[DrinksimError]
) -> None:
    """Raise an error if a row of a table has more or fewer cells than ``width``."""
    for row in rows:
        if len(row.cells) != width:
            cells = f"{len(row.cells)} cell{'s' if len(row.cells) > 1 else ''}"
            hint = ""
            if found.separator == "," and len(row.cells) > width:
                hint = "; decimal commas need another separator, such as semicolons"
            raise error(
                f"{found.file} line {row.line}: has {cells} and the header {width}; "
                f"mend the row{hint}"
            )


def safe_cell(text: str) -> str:
    """Return a text for a cell that no spreadsheet evaluates.

    An apostrophe in front marks it as text; :func:`plain_cell` removes it.

    >>> safe_cell("=1+1"), safe_cell("ear"), plain_cell(safe_cell("'=1"))
    ("'=1+1", 'ear', "'=1")
    """
    return f"'{text}" if text.lstrip("'")[:1] in STARTS_FORMULA else text


def plain_cell(cell: str) -> str:
    """Return the text of a cell written by :func:`safe_cell` or by another program."""
    guarded = cell.startswith("'") and cell.lstrip("'")[:1] in STARTS_FORMULA
    return cell[1:] if guarded else cell
