"""Tables of named settings: a frozen dataclass is the one source of keys, units, ranges and help.

Reading TOML, checking, ``--set``, options of commands and resolved files are derived from the
fields (:func:`geometry2d.foundation.settings.setting`), so that none of them can disagree. A field
whose type is another such dataclass is a table inside the table. Entries of a field's metadata say
more about its role:

``inline``
    True: the keys of this dataclass stand in the table that holds it, not in one of their own.
``omit``
    Names of this dataclass that are no keys: something else decides them.
``presets``, ``of``, ``sources``
    The value is a name in the mapping ``presets``; it gives the table in the field ``of`` its
    values, and keys of that table then change single ones. If ``of`` names several tables, a preset
    has one under each name, and stands for those of their keys in which presets differ. ``sources``
    says where the values of a preset come from.
``replaces``
    If the value is given, the keys of its table with these names have no effect.
``file``
    True: the value is the path of a file.
``example``
    A text that may not be empty, and what it could be.
"""

from __future__ import annotations

import dataclasses
import re
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, TypeVar

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import in_unit, range_error
from geometry2d.foundation.text import short
from geometry2d.foundation.toml import shown
from scenarios.settings.names import nearest, nearest_key

Table = TypeVar("Table")
Value = object


class SettingError(DrinksimError):
    """A setting is unknown, of the wrong kind, out of its range, or without effect."""


@dataclass(frozen=True)
class Key:
    """One key of a table or of a table inside it.

    Attributes
    ----------
    path
        Its name with its tables, joined by dots.
    field, hint
        The dataclass field that it sets, and that field's type.
    """

    path: str
    field: dataclasses.Field[Any]
    hint: Any

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that its value may be; empty if it is not such a key, or takes numbers too."""
        presets = self.field.metadata.get("presets")
        if presets is not None:
            return tuple(presets)
        if any(typing.get_origin(kind) is not Literal for kind in _alternatives(self.hint)):
            return ()
        return self.words

    @property
    def words(self) -> tuple[str, ...]:
        """The words that its value may be, perhaps beside numbers."""
        kinds = _alternatives(self.hint)
        return tuple(
            word
            for kind in kinds
            if typing.get_origin(kind) is Literal
            for word in typing.get_args(kind)
        )

    @property
    def has_default(self) -> bool:
        """Whether it may be left out."""
        return self.field.default is not dataclasses.MISSING

    def checked(self, value: Value) -> Value:
        """Return a value as the field's type; :class:`SettingError` if it may not be that."""
        if self.choices:
            if value not in self.choices:
                remedy = nearest(str(value), self.choices)
                raise SettingError(f"{self.path} = {shown(value)} is not a choice: {remedy}")
            return value
        checked = self._of_type(value, self.hint)
        for number in checked if isinstance(checked, tuple) else (checked,):
            if isinstance(number, int | float) and not isinstance(number, bool):
                wrong = range_error(number, self.field.metadata)
                if wrong is not None:
                    with_unit = in_unit(number, self.field.metadata)
                    raise SettingError(f"{self.path} = {with_unit} {wrong}")
        return checked

    def _of_type(self, value: Value, hint: Any) -> Value:
        """Return ``value`` as the annotated type, or refuse it; whole numbers pass as floats."""
        for kind in _alternatives(hint):
            if typing.get_origin(kind) is Literal and value in typing.get_args(kind):
                return value
            if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
                return _as_float(value)
            if kind is str and isinstance(value, str) and (value or not self._needs_text):
                return value
            if kind in (int, bool) and type(value) is kind:
                return value
            if typing.get_origin(kind) is tuple and isinstance(value, list | tuple):
                item = typing.get_args(kind)[0]
                if _length(kind) in (None, len(value)):
                    return tuple(self._of_type(entry, item) for entry in value)
        raise SettingError(f"{self.path} = {shown(value)}: give {self._wanted()}")

    @property
    def _needs_text(self) -> bool:
        return "example" in self.field.metadata

    def _wanted(self) -> str:
        names = {
            float: "a number",
            int: "a whole number",
            str: "a text in quotes",
            bool: "true or false",
        }
        wanted = []
        for kind in _alternatives(self.hint):
            if typing.get_origin(kind) is Literal:
                wanted += [shown(option) for option in typing.get_args(kind)]
            elif typing.get_origin(kind) is tuple:
                count = _length(kind)
                wanted.append(f"a list of {count} numbers" if count else "a list of numbers")
            elif kind is not type(None):
                wanted.append(names.get(kind, kind.__name__))
        unit = self.field.metadata.get("unit") or ""
        example = self.field.metadata.get("example")
        return (
            " or ".join(wanted)
            + (f" ({unit})" if unit else "")
            + (f', e.g. {self.field.name} = "{example}"' if example else "")
        )


@dataclass(frozen=True)
class SubTable:
    """A table inside a table: the field that holds it, its dataclass, whether it may be absent.

    In place of the dataclass, the first that the field's type names, a program may put a value of
    another kind that the type names. That is no setting, and no file holds it.
    """

    field: dataclasses.Field[Any]
    kind: type[Any]
    optional: bool

    @property
    def inline(self) -> bool:
        """Whether its keys stand in the table that holds it."""
        return bool(self.field.metadata.get("inline"))

    @property
    def omit(self) -> tuple[str, ...]:
        """Names of its fields that are no keys."""
        omitted: tuple[str, ...] = self.field.metadata.get("omit", ())
        return omitted


def parts_of(
    kind: type[object], *, where: str = "", omit: tuple[str, ...] = ()
) -> Iterator[Key | SubTable]:
    """Yield the keys and tables of a table, in order; inline tables as tables."""
    return iter(_parts(typing.cast(Any, kind), where, omit))


@cache
def _parts(kind: Any, where: str, omit: tuple[str, ...]) -> tuple[Key | SubTable, ...]:
    """Return the parts of a table; a study makes thousands of scenarios of the same few kinds."""
    hints = typing.get_type_hints(kind)
    parts: list[Key | SubTable] = []
    for field in dataclasses.fields(typing.cast(Any, kind)):
        if field.name in omit:
            continue
        hint = hints[field.name]
        kinds = [each for each in _alternatives(hint) if dataclasses.is_dataclass(each)]
        if kinds:
            optional = type(None) in _alternatives(hint)
            parts.append(SubTable(field, typing.cast(type[Any], kinds[0]), optional))
        else:
            parts.append(Key(joined(where, field.name), field, hint))
    return tuple(parts)


def keys_of(kind: type[object], *, where: str = "", omit: tuple[str, ...] = ()) -> Iterator[Key]:
    """Yield all keys of a table and of the tables inside it."""
    for part in parts_of(kind, where=where, omit=omit):
        if isinstance(part, Key):
            yield part
        else:
            inside = where if part.inline else joined(where, part.field.name)
            yield from keys_of(part.kind, where=inside, omit=part.omit)


def preset_tables(field: dataclasses.Field[Any], name: object) -> dict[str, Any]:
    """Return the tables that a preset of a field gives their values, by the names of their fields.

    Empty if the field has no presets for tables.
    """
    if "of" not in field.metadata:
        return {}
    of, preset = field.metadata["of"], field.metadata["presets"][name]
    return {of: preset} if isinstance(of, str) else {table: getattr(preset, table) for table in of}


def preset_keys(field: dataclasses.Field[Any]) -> dict[str, tuple[str, ...]]:
    """Return the names of the keys that the presets of a field stand for, by table."""
    of = field.metadata.get("of", ())
    every = [preset_tables(field, name) for name in field.metadata.get("presets", ())]
    if isinstance(of, str):
        return {of: tuple(each.name for each in dataclasses.fields(every[0][of]))}
    return {
        table: tuple(
            each.name
            for each in dataclasses.fields(every[0][table])
            if len({getattr(tables[table], each.name) for tables in every}) > 1
        )
        for table in of
    }


def replaced_in(table: object) -> tuple[str, ...]:
    """Return the names of the keys of a table that have no effect, as others replace them."""
    return tuple(
        name
        for field in dataclasses.fields(typing.cast(Any, table))
        if getattr(table, field.name) is not None
        for name in field.metadata.get("replaces", ())
    )


def table_from(
    kind: type[Table],
    values: Mapping[str, Value],
    *,
    where: str,
    base: Table | None = None,
    omit: tuple[str, ...] = (),
) -> Table:
    """Return a table of type ``kind`` with ``values`` laid over ``base`` or over the defaults.

    Parameters
    ----------
    kind
        The dataclass.
    values
        By key; for tables inside it by name, as mappings.
    where
        The table's name, empty if it has none.
    base
        What is not in ``values`` is taken from here.
    omit
        Fields that are no keys.

    Raises
    ------
    SettingError
        If a key is unknown or missing, or a value of the wrong type or out of its range. It names
        key, value and remedy.
    """
    if not isinstance(values, Mapping):
        raise SettingError(f"{where} = {shown(values)}: write it as a table, [{where}]")
    parts = list(parts_of(kind, where=where, omit=omit))
    _refuse_unknown(values, parts, where, [key.path for key in keys_of(kind, where=where)])
    made: dict[str, Any] = {}
    presets: dict[str, Any] = {}
    for part in parts:
        if isinstance(part, Key):
            if part.field.name in values:
                made[part.field.name] = part.checked(values[part.field.name])
                if "of" in part.field.metadata:
                    presets |= preset_tables(part.field, made[part.field.name])
            elif base is None and not part.has_default:
                about = part.field.metadata.get("description") or "it has no default"
                raise SettingError(f"{part.path} is missing: {about}")
        else:
            inner = _values_of(part, values)
            start = presets.get(part.field.name, _start(part, base))
            if inner or (start is None and not part.optional):
                inside = where if part.inline else joined(where, part.field.name)
                start = table_from(part.kind, inner, where=inside, base=start, omit=part.omit)
            made[part.field.name] = start
    try:
        if base is not None:
            return typing.cast(Table, dataclasses.replace(typing.cast(Any, base), **made))
        return kind(**made)
    except SettingError:
        raise
    except DrinksimError as error:
        if not where:
            raise
        raise SettingError(_told(error, kind, parts, where, made, base)) from error


def check(table: object, *, where: str = "", omit: tuple[str, ...] = ()) -> None:
    """Check every value of a table and of the tables inside it.

    Raises
    ------
    SettingError
        If a value is of the wrong type or out of its range.
    """
    for part in parts_of(type(table), where=where, omit=omit):
        value = getattr(table, part.field.name)
        if isinstance(part, SubTable):
            if isinstance(value, part.kind):
                inside = where if part.inline else joined(where, part.field.name)
                check(value, where=inside, omit=part.omit)
        elif value is not None or not part.has_default:
            part.checked(value)


def _refuse_unknown(
    values: Mapping[str, Value], parts: list[Key | SubTable], where: str, keys: list[str]
) -> None:
    known = {part.field.name for part in parts if isinstance(part, Key) or not part.inline}
    for part in parts:
        if isinstance(part, SubTable) and part.inline:
            known |= {key.field.name for key in keys_of(part.kind, omit=part.omit)}
    for name in values:
        if name not in known:
            path = joined(where, name)
            raise SettingError(f"unknown key {short(path)}: {nearest_key(path, keys)}")


def _values_of(part: SubTable, values: Mapping[str, Value]) -> Mapping[str, Value]:
    """Return what is given for a table inside a table."""
    if part.inline:
        names = {key.field.name for key in keys_of(part.kind, omit=part.omit)}
        return {name: value for name, value in values.items() if name in names}
    return typing.cast(Mapping[str, Value], values.get(part.field.name, {}))


def _start(part: SubTable, base: object | None) -> Any:
    """Return what a table inside a table is where nothing is given; None if it is absent."""
    if base is not None:
        return getattr(base, part.field.name)
    return None if part.field.default is dataclasses.MISSING else part.field.default


def _told(
    error: DrinksimError,
    kind: Any,
    parts: list[Key | SubTable],
    where: str,
    made: Mapping[str, Any],
    base: Any,
) -> str:
    """Return an error of a dataclass with its keys' tables, and the value that is to blame."""
    keys = {part.field.name: part for part in parts if isinstance(part, Key)}
    if not keys:
        return str(error)
    named = re.compile(rf"(?<![\w.])({'|'.join(map(re.escape, keys))})(?!\w)")
    message = named.sub(rf"{where}.\1", str(error))

    def allowed_without(name: str) -> bool:
        rest = {other: value for other, value in made.items() if other != name}
        try:
            kind(**rest) if base is None else dataclasses.replace(base, **rest)
        except (DrinksimError, TypeError):
            return False
        return True

    guilty = next((name for name in made if name in keys and allowed_without(name)), None)
    if guilty is None or f"{where}.{guilty}" in message:
        return message
    value, metadata = made[guilty], keys[guilty].field.metadata
    text = in_unit(value, metadata) if isinstance(value, int | float) else shown(value)
    return f"{where}.{guilty} = {text}: {message}"


def _length(kind: Any) -> int | None:
    """Return how many items a tuple of this type has; None if any number."""
    items = typing.get_args(kind)
    return None if items[-1] is Ellipsis else len(items)


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:  # a whole number of more than 300 digits
        return float("inf")


def joined(where: str, name: str) -> str:
    """Return the path of a name in a table; the outermost table has no name."""
    return f"{where}.{name}" if where else name


def _alternatives(hint: Any) -> tuple[Any, ...]:
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return typing.get_args(hint)
    return (hint,)
