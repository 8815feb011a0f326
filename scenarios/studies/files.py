"""What all studies leave: tables, a summary, and messages for the person who started them."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


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
    """Write rows of numbers and words as CSV; numbers read back to the same bits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow([repr(float(x)) if isinstance(x, float) else x for x in row])


def write_summary(folder: Path, content: Mapping[str, Any]) -> None:
    """Write ``summary.json``, which marks a directory as a result."""
    text = json.dumps(content, indent=2, ensure_ascii=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
