"""What all studies leave: tables, a summary, and messages for the person who started them."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geometry2d.foundation.delimited import safe_cell
from geometry2d.foundation.text import number


@dataclass(frozen=True)
class StudyResult:
    """How a study ended.

    Attributes
    ----------
    folder
        Where its files are.
    messages
        What a reader must know of the result, one thing each.
    complete
        Whether all that was asked for could be computed.
    """

    folder: Path
    messages: tuple[str, ...]
    complete: bool = True


def write_table(path: Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write rows of numbers and words as CSV.

    Numbers read back to the same bits, and no spreadsheet computes a word
    (:func:`geometry2d.foundation.delimited.safe_cell`).
    """

    def cell(value: object) -> object:
        if isinstance(value, str) and number(value) is None:
            return safe_cell(value)
        return repr(float(value)) if isinstance(value, float) else value

    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow([cell(value) for value in row])


def write_summary(folder: Path, content: Mapping[str, Any]) -> None:
    """Write ``summary.json``, which marks a directory as a result."""
    text = json.dumps(content, indent=2, ensure_ascii=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
