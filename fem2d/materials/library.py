"""Materials from TOML files, and the library of those the thesis names.

A material is a table with the key ``law`` and that law's parameters, with units in their names:

``neo-hookean``
    ``C10_mpa`` and ``D1_per_mpa`` (or ``poisson``)
``ogden``
    ``mu_mpa``, ``alpha`` (a number or one for each term) and ``D_per_mpa`` (or ``poisson``)
``holzapfel-gasser-ogden``
    ``C10_mpa``, ``k1_mpa``, ``k2``, ``kappa``, ``D_per_mpa`` (or ``poisson``) and ``fibres``

``source`` and ``reading`` say in words where the numbers come from and which reading was taken
where the source contradicts itself; ``range.<parameter> = [lowest, first guess, highest]`` keeps
the limits of a calibration. A library file holds one such table a layer and is addressed as
``file/layer``, e.g. ``L2-Ogden/dermis``; a file with a single layer by its name alone.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.material import Material, MaterialError
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from geometry2d.foundation.text import short
from geometry2d.foundation.toml import read_toml, shown

MOST_TERMS = 20
"""Terms of a law, and families of fibres; laws in use have a handful."""

SIZES = (1e-9, 1e9)
"""Parameters, in the units of their names, are 0 or of a size between these."""

LIBRARY = Path(str(files("fem2d") / "materials" / "library"))
NOTES = ("source", "reading", "range")
# law: (required parameters, optional ones, names of the compressibility)
LAWS: dict[str, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {
    "neo-hookean": (("C10_mpa",), (), ("D1_per_mpa", "D_per_mpa")),
    "ogden": (("mu_mpa", "alpha"), (), ("D_per_mpa", "D1_per_mpa")),
    "holzapfel-gasser-ogden": (
        ("C10_mpa", "k1_mpa", "k2", "kappa"),
        ("fibres",),
        ("D_per_mpa", "D1_per_mpa"),
    ),
}


@dataclass(frozen=True)
class MaterialCard:
    """A material of a file, with what is known about its numbers.

    Attributes
    ----------
    name
        ``file/layer``.
    material
        The law.
    parameters
        The table as written.
    source, reading
        Where the numbers come from; which reading was taken, and why.
    ranges
        ``{parameter: (lowest, first guess, highest)}`` of a calibration.
    """

    name: str
    material: Material
    parameters: Mapping[str, Any]
    source: str = ""
    reading: str = ""
    ranges: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)


def library_materials() -> list[str]:
    """Return the names of all materials of the library, ``file/layer``."""
    return [
        f"{path.stem}/{layer}" for path in sorted(LIBRARY.glob("*.toml")) for layer in _read(path)
    ]


def configuration(name: str) -> dict[str, Material]:
    """Return the layers of a library file, outermost first.

    >>> list(configuration("L2-Ogden"))
    ['dermis', 'bulk']
    """
    layers = [full for full in library_materials() if full.split("/")[0] == name]
    if not layers:
        known = list(dict.fromkeys(full.split("/")[0] for full in library_materials()))
        raise MaterialError(_nearest("configuration", name, known))
    return {full.split("/")[1]: material_card(full).material for full in layers}


def configuration_cards(name_or_file: str) -> dict[str, MaterialCard]:
    """Return the layers of a library file or of a TOML file of your own, outermost first.

    A file of your own has one table a layer, like the library's.

    Raises
    ------
    MaterialError
        If there is no such configuration, or a layer is described wrongly.

    >>> configuration_cards("L2-Ogden")["dermis"].ranges["mu_mpa"]
    (0.005, 0.0113, 0.05)
    """
    path = Path(name_or_file)
    if path.suffix != ".toml":
        return {
            layer: material_card(f"{name_or_file}/{layer}") for layer in configuration(name_or_file)
        }
    if not path.is_file():
        raise MaterialError(f"configuration file {name_or_file} does not exist: check the path")
    layers = _read(path)
    for name, table in layers.items():
        if not isinstance(table, dict):
            raise MaterialError(
                f"{path}: {short(name)} = {shown(table)} belongs to no layer: write one table "
                "a layer, e.g. [dermis] and [bulk]"
            )
    if not 1 <= len(layers) <= MOST_TERMS:
        raise MaterialError(
            f"{path}: {len(layers)} layers: write one table a layer, e.g. [dermis] and [bulk]"
        )
    return {
        name: _card(f"{path.stem}/{name}", table, f"{path.name}, [{short(name)}]: ")
        for name, table in layers.items()
    }


def material_named(name_or_file: str) -> Material:
    """Return a material of the library, or of a TOML file.

    Parameters
    ----------
    name_or_file
        ``L2-Ogden/dermis``; ``L1`` where a library file has one layer; or the path of a TOML file
        with one material.

    Raises
    ------
    MaterialError
        If there is no such material, or it is described wrongly.

    >>> material_named("L1").C10_mpa
    0.0049767
    """
    return material_card(name_or_file).material


def material_card(name_or_file: str) -> MaterialCard:
    """Return a material with its source and reading; arguments as of :func:`material_named`."""
    path = Path(name_or_file)
    if path.suffix == ".toml":
        if not path.is_file():
            raise MaterialError(
                f"material file {name_or_file} does not exist: give a path, or one of "
                + ", ".join(library_materials())
            )
        return _card(path.stem, _read(path), f"{name_or_file}: ")
    known = library_materials()
    single = {n.split("/")[0]: n for n in known}
    name = name_or_file
    if name in single and sum(n.startswith(f"{name}/") for n in known) == 1:
        name = single[name]
    if name not in known:
        raise MaterialError(_nearest("material", name, known))
    file, layer = name.split("/")
    return _card(name, _read(LIBRARY / f"{file}.toml")[layer], f"{name}: ")


def material_from(table: Mapping[str, Any], where: str = "") -> Material:
    """Return the material that a table describes.

    Parameters
    ----------
    table
        Keys as in the module's description.
    where
        Start of every message, e.g. the name of the file and a colon.

    Raises
    ------
    MaterialError
        Naming the parameter, its value and the remedy.
    """
    law = table.get("law")
    if not isinstance(law, str) or law not in LAWS:
        raise MaterialError(
            (f"{where}law = {shown(law)} is unknown: " if law else f"{where}law is missing: ")
            + "choose one of "
            + ", ".join(LAWS)
        )
    required, optional, compressible = LAWS[law]
    allowed = ("law", *required, *optional, *compressible, "poisson", *NOTES)
    for key in table:
        if key not in allowed:
            near = difflib.get_close_matches(key, allowed, n=1)
            raise MaterialError(
                f"{where}{short(key)} = {shown(table[key])} is no parameter of {law}"
                + (f": did you mean {near[0]}?" if near else f": it has {', '.join(allowed)}")
            )
    for key in required:
        if key not in table:
            raise MaterialError(f"{where}{key} is missing: {law} needs {', '.join(required)}")
    given = [key for key in (*compressible, "poisson") if key in table]
    if len(given) != 1:
        raise MaterialError(
            f"{where}"
            + (f"{' and '.join(given)} are given" if given else "compressibility is missing")
            + f": give poisson (e.g. 0.49) or {compressible[0]}, not both"
        )
    try:
        return _law(law, table, given[0])
    except MaterialError as error:
        raise MaterialError(f"{where}{error}") from None


def _law(law: str, table: Mapping[str, Any], given: str) -> Material:
    poisson = _number(table, "poisson") if given == "poisson" else None
    if law == "ogden":
        D = None if poisson is not None else _numbers(table, given)
        return Ogden(_numbers(table, "mu_mpa"), _numbers(table, "alpha"), D, poisson=poisson)
    C10 = _number(table, "C10_mpa")
    D1 = None if poisson is not None else _number(table, given)
    if law == "neo-hookean":
        return NeoHookean(C10, D1, poisson=poisson)
    directions = _directions(table.get("fibres", [[1.0, 0.0, 0.0]]))
    k1, k2, kappa = (_number(table, key) for key in ("k1_mpa", "k2", "kappa"))
    return HolzapfelGasserOgden(C10, k1, k2, kappa, D1, directions, poisson=poisson)


def _directions(fibres: object) -> tuple[tuple[float, float, float], ...]:
    """Return the direction of each family of fibres."""
    rows = fibres if isinstance(fibres, list) and len(fibres) <= MOST_TERMS else []
    if not rows or not all(isinstance(row, list) and len(row) == 3 for row in rows):
        raise MaterialError(
            f"fibres = {shown(fibres)}: give one direction [x, y, z] for each family, at most "
            f"{MOST_TERMS}"
        )
    found = [[_number({"fibres": value}, "fibres") for value in row] for row in rows]
    return tuple((x, y, z) for x, y, z in found)


def _number(table: Mapping[str, Any], key: str) -> float:
    value = table[key]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MaterialError(f"{key} = {shown(value)} is not a number: write one")
    if value != 0 and not SIZES[0] <= abs(value) <= SIZES[1]:
        raise MaterialError(
            f"{key} = {shown(value)} is neither 0 nor between {SIZES[0]:g} and "
            f"{SIZES[1]:g} in size: check the unit"
        )
    return float(value)


def _numbers(table: Mapping[str, Any], key: str) -> tuple[float, ...]:
    value = table[key]
    values = value if isinstance(value, list) else [value]
    if not 1 <= len(values) <= MOST_TERMS:
        raise MaterialError(f"{key} has {len(values)} terms: give 1 to {MOST_TERMS}")
    return tuple(_number({key: v}, key) for v in values)


def _card(name: str, table: Mapping[str, Any], where: str) -> MaterialCard:
    material = material_from(table, where)
    for key in ("source", "reading"):
        if not isinstance(table.get(key, ""), str):
            raise MaterialError(f"{where}{key} = {shown(table[key])}: write a text in quotes")
    return MaterialCard(
        name,
        material,
        {key: value for key, value in table.items() if key not in NOTES},
        table.get("source", ""),
        table.get("reading", ""),
        _ranges(table, where),
    )


def _ranges(table: Mapping[str, Any], where: str) -> dict[str, tuple[float, float, float]]:
    """Return the limits of a calibration by parameter."""
    given = table.get("range", {})
    if not isinstance(given, Mapping):
        raise MaterialError(f"{where}range = {shown(given)}: write range.k2 = [0.1, 0.13, 0.2]")
    ranges = {}
    for key, limits in given.items():
        place = f"{where}range.{short(key)} = {shown(limits)}"
        if key not in table:
            raise MaterialError(f"{place}: there is no parameter of that name: correct it")
        if isinstance(table[key], list) and len(table[key]) != 1:
            raise MaterialError(f"{place}: only a single number may vary: leave the range out")
        if not isinstance(limits, list) or len(limits) != 3:
            raise MaterialError(f"{place}: give lowest, first guess and highest")
        try:
            low, guess, high = (_number({key: value}, key) for value in limits)
        except MaterialError as error:
            raise MaterialError(f"{where}range.{error}") from None
        ranges[key] = (low, guess, high)
    return ranges


def _read(path: Path) -> dict[str, Any]:
    return read_toml(path, what="material file", error=MaterialError)


def _nearest(kind: str, name: str, known: list[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    return (
        f"there is no {kind} {name!r}"
        + (f": did you mean {near[0]!r}?" if near else ":")
        + f" The library has {', '.join(known)}; a file of your own ends in .toml"
    )
