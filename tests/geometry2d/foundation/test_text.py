"""Text, TOML and tables of users' files: read within bounds, or refused in words that help."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import number, text_of
from geometry2d.foundation.toml import DEEPEST, MOST_BYTES, parsed_toml, read_toml, shown

FUZZ = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


class RefusedError(DrinksimError):
    """What these tests ask for."""


def read(folder: Path, data: bytes, **options: str) -> str:
    file = folder / "file.txt"
    file.write_bytes(data)
    return text_of(file, what="table", error=RefusedError, **options)


def toml(text: str) -> dict[str, object]:
    return parsed_toml(text, where="file.toml", error=RefusedError)


def test_lines_end_alike_and_a_byte_order_mark_is_no_text(tmp_path):
    assert read(tmp_path, b"\xef\xbb\xbfa\r\nb\rc\n") == "a\nb\nc\n"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("a,å\n".encode("latin-1"), r"file\.txt line 1: byte 0xe5 is not UTF-8.*Windows-1252"),
        ("\n\nå\n".encode("cp1252"), r"line 3.*'\\n\\nå\\n'.*save the table in UTF-8"),
        (b"\x81\x8d\x8f", "its encoding is not known"),
        ("a\n".encode("utf-16"), "written in UTF-16: save"),
        ("a\n".encode("utf-32"), "written in UTF-32: save"),
        ("abc\n".encode("utf-16-le"), "looks like UTF-16"),
        (b"abcdefgh\0ij", "zero bytes and is no text, not a table"),
    ],
)
def test_other_encodings_are_named(tmp_path, data, message):
    with pytest.raises(RefusedError, match=message):
        read(tmp_path, data)


def test_a_dialect_that_is_known_to_write_another_encoding_is_read(tmp_path):
    assert read(tmp_path, "å".encode("cp1252"), also="cp1252") == "å"
    assert read(tmp_path, "å".encode(), also="cp1252") == "å"


def test_what_cannot_be_read_is_named(tmp_path):
    with pytest.raises(RefusedError, match=r"none\.txt: no such table; check the path"):
        text_of(tmp_path / "none.txt", what="table", error=RefusedError)
    with pytest.raises(RefusedError, match="cannot be read as a table: Is a directory"):
        text_of(tmp_path, what="table", error=RefusedError)
    (tmp_path / "large").write_bytes(b"a" * 11)
    with pytest.raises(RefusedError, match="larger than 1e-05 MB"):
        text_of(tmp_path / "large", what="table", error=RefusedError, most_bytes=10)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_number_reads_back(value):
    assert number(repr(value)) == value


@pytest.mark.parametrize(
    "text", ["", ".", "e5", "1e", "1_0", "0x1", "inf", "nan", "1 ", "²", "1" * 101, "1e400", "+-1"]
)
def test_what_only_python_takes_for_a_number_is_none(text):
    assert number(text) is None


# --- TOML ---


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = " + "[" * 3000 + "]" * 3000, f"nested more than {DEEPEST} deep"),
        ("x = " + "[" * 40 + "]" * 40, f"nested more than {DEEPEST} deep"),
        ("x = " + "{a = " * 5000, "nested more than|not valid TOML"),
        (".".join("a" * 100_000) + " = 1", f"more than {DEEPEST} parts"),
        (".".join(['"a b"'] * 40) + " = 1", f"more than {DEEPEST} parts"),
        ("[" + " . ".join("b" * 40) + "]", f"more than {DEEPEST} parts"),
        ("[contact]\nfriction = " + "9" * 5000, "too many digits"),
        ("friction = 99999999999999999999", "friction is a number of too many digits"),
        ("friction = 0x" + "f" * 5000, "friction is a number of too many digits"),
        ("a = 1\na = 2", "not valid TOML: Cannot overwrite a value"),
        ("[a]\n[a]", r"not valid TOML: a table or key is defined twice \(at line 2"),
        ("a = [", "not valid TOML"),
    ],
)
def test_toml_beyond_use_is_refused(text, message):
    with pytest.raises(RefusedError, match=rf"^file\.toml.*(?:{message})"):
        toml(text)


def test_dots_that_are_no_key_are_no_matter():
    text = f"x = [{', '.join(['1.5'] * 99)}] # {'.'.join('a' * 99)}\ny = '{'.'.join('a' * 99)}'"
    assert toml(text) == tomllib.loads(text)


def test_a_toml_file_may_not_be_larger_than_settings_ever_are(tmp_path):
    file = tmp_path / "large.toml"
    file.write_text(" " * (MOST_BYTES + 1))
    with pytest.raises(RefusedError, match=r"large\.toml: is larger than 1 MB"):
        read_toml(file, what="scenario", error=RefusedError)


@settings(FUZZ, max_examples=200)
@given(st.text("ab.=[]{}\"'\\#\n 1-_", max_size=80))
def test_any_toml_is_read_as_the_library_reads_it_or_refused(text):
    try:
        expected = tomllib.loads(text)
    except ValueError:
        with pytest.raises(RefusedError, match=r"^file\.toml"):
            toml(text)
    else:
        assert toml(text) == expected


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text() | st.floats(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=60,
)


@FUZZ
@given(VALUES)
def test_any_value_is_shown_on_one_short_line_in_no_words_of_python(value):
    text = shown(value)
    assert len(text) < 50
    assert text.isprintable()
    assert shown(None) == "nothing"


def test_values_are_shown_as_toml_writes_them():
    assert shown("a\nb\x1b") == r'"a\nb\u001b"'
    assert shown([True, "a", 1.5, {"b": [1]}]) == '[true, "a", 1.5, {b = [1]}]'
    assert shown(10**30).startswith("1000")
    assert shown([[[]]] * 1000) == "[[[]], [[]], [[]], [[]], [[]], [[]], [[]…"
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    assert len(shown(deep)) < 50
