"""What the sips of a study say to mind: each thing once, with how many say it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from scenarios.campaign.study import NOTES_BETWEEN
from scenarios.campaign.table import Row
from scenarios.decision.comparison import factor_columns
from scenarios.messages.lines import MESH_DOUBT

NUMBER = re.compile(r"[-+−]?\d+(\.\d+)?")


@dataclass(frozen=True)
class Note:
    """What some sips say, numbers apart.

    Attributes
    ----------
    text
        In the words, and with the numbers, of the first.
    first
        Which sip that is: its factors.
    count
        How many say it.
    """

    text: str
    first: str
    count: int


def gathered(rows: Sequence[Row]) -> list[Note]:
    """Return what the sips say to mind, the most frequent first."""
    names, found = factor_columns(rows), dict[str, Note]()
    for row in rows:
        for text in dict.fromkeys(filter(None, str(row.get("notes") or "").split(NOTES_BETWEEN))):
            kind = NUMBER.sub("0", text)
            known = found.get(kind)
            first = ", ".join(str(row[name]) for name in names if row.get(name) is not None)
            found[kind] = Note(
                known.text if known else text,
                known.first if known else first,
                known.count + 1 if known else 1,
            )
    return sorted(found.values(), key=lambda note: -note.count)


def mesh_sentence(rows: Sequence[Row]) -> str | None:
    """Return in how many sips the mesh is too coarse for the pressure compared, if in any."""
    doubts = [doubt for row in rows if (doubt := row.get("mesh_doubt")) is not None]
    rough = [doubt for doubt in doubts if doubt > MESH_DOUBT]
    if not rough:
        return None
    return (
        f"The mesh is coarse for the highest pressure in {len(rough)} of {len(doubts)} sips: two "
        f"measures of it differ by more than {100 * MESH_DOUBT:.0f} %, by up to "
        f"{100 * max(rough):.0f} %. A difference of one sip from another within that is the "
        "mesh's: replay both on a finer one (numerics.mesh.layer_mm) before you rely on it."
    )
