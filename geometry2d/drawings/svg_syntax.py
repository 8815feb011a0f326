"""Syntax of SVG attributes: numbers, lengths, path data and transforms."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from geometry2d.drawings.chains import MOST_PIECES, DrawingError
from geometry2d.foundation.text import NUMBER, number, quoted

Array = NDArray[np.float64]

MM_PER_UNIT = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72, "pc": 25.4 / 6, "q": 0.25}
"""Physical units of SVG, mm; px is not among them, because programs disagree on its size."""

NO_PHYSICAL_UNIT = frozenset(["", "px", "%", "em", "ex", "ch", "rem", "vw", "vh"])
"""Units without a physical size."""

FLAG = re.compile("[01]")
SEPARATOR = re.compile(r"[\s,]*+")
TRANSFORM = re.compile(r"[\s,]*+([A-Za-z]++)\s*+\(([^()]*+)\)")
ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
LARGEST_NUMBER = 1e9
"""Largest absolute value of a number in a drawing."""

MOST_TRANSFORMS = 100
"""Largest number of transforms of an element."""


def path_steps(text: str, where: str) -> list[tuple[str, bool, Array]]:
    """Return, for each step of path data, its capital letter, whether relative, and its numbers."""
    steps: list[tuple[str, bool, Array]] = []
    runs = re.split(r"([A-DF-Za-df-z])", text)  # e and E belong to numbers
    if runs[0].strip():
        raise DrawingError(f"{where}: path data start with {quoted(runs[0].strip())}, not with M")
    for letter, arguments in zip(runs[1::2], runs[2::2], strict=True):
        command = letter.upper()
        if command not in ARGUMENTS or (not steps and command != "M"):
            raise DrawingError(f"{where}: path data have {letter!r} where a command should be")
        numbers = attribute_numbers(arguments, where, arcs=command == "A")
        if len(steps) + len(numbers) // max(ARGUMENTS[command], 1) > MOST_PIECES:
            raise DrawingError(f"{where} has more than {MOST_PIECES} steps: simplify the path")
        each = ARGUMENTS[command]
        if each == 0 and not numbers:
            steps.append((command, False, np.zeros(0)))
        elif each and numbers and len(numbers) % each == 0:
            for k in range(0, len(numbers), each):
                # Further pairs after M are lines.
                step = "L" if command == "M" and k else command
                steps.append((step, letter.islower(), np.array(numbers[k : k + each])))
        else:
            raise DrawingError(f"{where}: {letter} has {len(numbers)} numbers, not {each} each")
    return steps


def attribute_numbers(text: str, where: str, *, arcs: bool = False) -> list[float]:
    """Return the numbers of an attribute; in arcs the 4th and 5th of each seven are single digits.

    "1 01-20" then means a flag 1, a flag 0, a flag 1 and -20 (SVG 2, section 9.3.9).
    """
    numbers: list[float] = []
    at = SEPARATOR.match(text).end()  # type: ignore[union-attr]  # matches nothing at least
    while at < len(text):
        found = (FLAG if arcs and len(numbers) % 7 in (3, 4) else NUMBER).match(text, at)
        value = number(found.group()) if found else None
        if found is None or value is None:
            raise DrawingError(
                f"{where}: {quoted(text[at:])} stands where a number should be: write one"
            )
        if abs(value) > LARGEST_NUMBER:
            raise DrawingError(
                f"{where}: {quoted(found.group())} is too large for a drawing: check the unit"
            )
        numbers.append(value)
        at = SEPARATOR.match(text, found.end()).end()  # type: ignore[union-attr]
    return numbers


def millimetres(text: str, where: str) -> float | None:
    """Return a physical length, mm, or None if the text has no physical unit."""
    stripped = text.strip().lower()
    found = NUMBER.match(stripped)
    value = number(found.group()) if found else None
    unit = stripped[found.end() :].strip() if found else stripped
    if value is not None and unit in MM_PER_UNIT:
        return value * MM_PER_UNIT[unit]
    if stripped != "auto" and (value is None or unit not in NO_PHYSICAL_UNIT):
        raise DrawingError(f'{where} {quoted(text)} is no length: write one, such as "50mm"')
    return None


def transform_map(text: str, where: str) -> Array:
    """Return the map (2, 3) of a transform attribute (CSS Transforms 1, section 8)."""
    result = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    at = count = 0
    while found := TRANSFORM.match(text, at):
        at, count = found.end(), count + 1
        if count > MOST_TRANSFORMS:
            raise DrawingError(f"{where} has more than {MOST_TRANSFORMS} transforms: ungroup it")
        result = after(result, _one_transform(found[1], attribute_numbers(found[2], where), where))
    if text[at:].strip(" ,\t\r\n"):
        raise DrawingError(
            f"{where}: transform {quoted(text[at:])} cannot be read: ungroup it, or convert it to "
            "a path"
        )
    return result


def _one_transform(kind: str, n: list[float], where: str) -> Array:
    if kind == "matrix" and len(n) == 6:
        return np.array([[n[0], n[2], n[4]], [n[1], n[3], n[5]]])
    if kind == "translate" and len(n) in (1, 2):
        return np.array([[1.0, 0.0, n[0]], [0.0, 1.0, n[1] if len(n) == 2 else 0.0]])
    if kind == "scale" and len(n) in (1, 2):
        return np.array([[n[0], 0.0, 0.0], [0.0, n[-1], 0.0]])
    if kind == "rotate" and len(n) in (1, 3):
        c, s = np.cos(np.radians(n[0])), np.sin(np.radians(n[0]))
        x, y = n[1:] if len(n) == 3 else (0.0, 0.0)
        return np.array([[c, -s, x - c * x + s * y], [s, c, y - s * x - c * y]])
    if kind in ("skewX", "skewY") and len(n) == 1:
        slope = float(np.tan(np.radians(n[0])))
        across, up = (slope, 0.0) if kind == "skewX" else (0.0, slope)
        return np.array([[1.0, across, 0.0], [up, 1.0, 0.0]])
    raise DrawingError(f"{where}: transform {quoted(kind)} with {len(n)} numbers is not known")


def after(outer: Array, inner: Array) -> Array:
    """Return the map (2, 3) that applies ``inner`` first."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def applied(to: Array, points: Array) -> Array:
    """Return points (n, 2) under a map (2, 3)."""
    mapped: Array = points @ to[:, :2].T + to[:, 2]
    return mapped
