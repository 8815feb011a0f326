"""Tables as programs and spreadsheets write them, and what is wrong in them, by line."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry2d.foundation.delimited import (
    NamedTable,
    named_table,
    plain_cell,
    read_named_table,
    rows_of,
    safe_cell,
)
from geometry2d.foundation.errors import DrinksimError


class RefusedError(DrinksimError):
    """What these tests ask for."""


def table(text: str, columns: tuple[str, ...] = ("time_s", "name")) -> NamedTable:
    return named_table(Path("t.csv"), text, columns, what="table", error=RefusedError)


@pytest.mark.parametrize(
    "text",
    [
        "time_s,name\n0.5,a\n1.5,b\n",
        "time_s;name\n0,5;a\n1,5;b\n",
        "sep=;\ntime_s;name\n0.5;a\n1.5;b\n",
        '"sep=;"\ntime_s;name\n0.5;a\n1.5;b\n',
        "time_s\tname\n0,5\ta\n1,5\tb\n",
        "\n\nname , time_s ,\n\na,0.5,\n,,\n b ,1.5,\n,,\n",
        '"time_s","name"\n"0.5","a"\n"1.5","b"',
        "time_s,other,name\n.5,1,a\n15e-1,2,b\n",
    ],
)
def test_a_table_in_any_of_its_spellings(text):
    found = table(text)
    np.testing.assert_array_equal(found.numbers("time_s"), [0.5, 1.5])
    assert found.texts("name") == ["a", "b"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"t\.csv: is empty; a table begins with time_s,name"),
        ("time_s\n1\n", "header lacks name; a table has the columns time_s,name"),
        ("time_s,name,time_s\n1,a,2\n", "names time_s twice"),
        ("time_s,name\n", "no rows below its header"),
        ("time_s,name\n1,a\n2\n", r"t\.csv line 3: has 1 cell and the header 2; mend the row$"),
        ("time_s,name\n1,5,a\n", "line 2: has 3 cells.*decimal commas need another separator"),
        ('time_s,name\n1,"a\n', "line 2: a quotation mark is not closed"),
        ('time_s,name\n1,"a"b\n', "text follows the closing one"),
        (f"time_s,name\n1,{'a' * 140_000}\n", "line 2: a cell has more than 131072 characters"),
        ("time_s,name\n1,a\n2", "line 3: was cut short in its last row"),
        ("name,time_s\na,1.25\nb,2.50\nc,3.7", "line 4: was cut short in its last row"),
        ("name,time_s\na,1.25\nb,2.50\nc,", "line 4: was cut short in its last row"),
    ],
)
def test_what_is_wrong_in_a_table_is_said_with_its_line(text, message):
    with pytest.raises(RefusedError, match=message):
        table(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,time_s\na,x\n", "line 2: time_s = 'x' is not a finite number"),
        ("name,time_s\na,\n", "line 2: time_s = '' is not"),
        ("name,time_s\na,nan\n", "time_s = 'nan' is not"),
        ("name,time_s\na,1e999\n", "time_s = '1e999' is not"),
        ("name,time_s\na,1e13\n", "time_s = '1e13' is too large; check the unit"),
        ("name;time_s\na;1.5\nb;1,5\n", "line 3: time_s = '1,5'.*decimal points and decimal comm"),
        ("name;time_s\na;1.234,5\n", "'1.234,5' is not a finite number"),
        (f"name,time_s\na,{'9' * 9000}\n", "time_s = '9{40}…' is not a finite number"),
    ],
)
def test_what_is_no_number_is_said_with_its_place(text, message):
    with pytest.raises(RefusedError, match=message):
        table(text).numbers("time_s")


def test_the_line_is_that_of_the_file_whatever_stands_above(tmp_path):
    file = tmp_path / "t.csv"
    file.write_bytes(b"\xef\xbb\xbf\r\n\r\nsep=;\r\n\r\ntime_s;name\r\n\r\n1;a\r\nx;b\r\n")
    found = read_named_table(file, ("time_s", "name"), what="table", error=RefusedError)
    with pytest.raises(RefusedError, match=r"t\.csv line 8: time_s = 'x'"):
        found.numbers("time_s")
    with pytest.raises(RefusedError, match=r"none\.csv: no such table"):
        read_named_table(tmp_path / "none.csv", ("time_s",), what="table", error=RefusedError)


def test_blank_cells_are_not_numbers_where_they_may_be_blank():
    found = table("name,time_s\na,\nb,1\n")
    np.testing.assert_array_equal(found.numbers("time_s", blank=True), [np.nan, 1.0])


NAMES = st.text(st.characters(exclude_categories=["Cs", "Cc", "Z"]), min_size=1)


@given(st.lists(NAMES, min_size=1), st.sampled_from(",;\t"))
def test_names_come_back_from_cells_that_no_spreadsheet_computes(names, separator):
    stream = io.StringIO()
    writer = csv.writer(stream, delimiter=separator, lineterminator="\n")
    writer.writerow(("name", "time_s"))
    writer.writerows((safe_cell(name), 1.5) for name in names)
    found = table(stream.getvalue())
    assert found.texts("name") == names
    assert not [cell for row in found.rows for cell in row.cells if cell[:1] in tuple("=+-@")]
    assert [plain_cell(safe_cell(name)) for name in names] == names


@given(st.text("a1,;\t\n\"'=.# ", max_size=60))
def test_any_text_is_rows_or_our_error(text):
    try:
        found = rows_of(Path("t.csv"), text, error=RefusedError)
    except RefusedError as error:
        assert "t.csv line" in str(error)
    else:
        assert all(any(row.cells) for row in found.rows)
