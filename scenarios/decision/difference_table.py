"""A table whose rows are people, and whose bars are what one neck does to them less another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.campaign.table import Row
from scenarios.decision.comparison import PairedDifference
from scenarios.views.page.hypertext import Markup, joined, tag
from scenarios.views.page.tables import scrolled

MARGIN = 0.06
"""Room beyond the outermost value on a track, as a share of what is shown."""


def number_of(value: float, pair: PairedDifference) -> str:
    """Return a value with the digits that the means of a pair are worth."""
    largest = max(abs(float(pair.first_values.mean())), abs(float(pair.second_values.mean())), 1e-9)
    digits = min(max(2 - int(np.floor(np.log10(largest))), 0), 6)
    return f"{value:.{digits}f}".replace("-", "−")


def runs_of_units(rows: Sequence[Row], pair: PairedDifference) -> dict[tuple[str, str], str]:
    """Return where the first sip of each neck and unit lies, by their names."""
    found: dict[tuple[str, str], str] = {}
    for row in rows:
        found.setdefault((str(row["neck"]), str(row.get(pair.unit))), str(row["run"]))
    return found


@dataclass(frozen=True)
class _Track:
    """The values between which a track runs."""

    low: float
    high: float

    @classmethod
    def of(cls, pair: PairedDifference) -> _Track:
        ends = [end for end in pair.interval if np.isfinite(end)]
        values = [0.0, *ends, *pair.differences]
        low, high = min(values), max(values)
        room = MARGIN * ((high - low) or 1.0)
        return cls(low - room, high + room)

    def percent(self, value: float) -> str:
        return f"{100 * (value - self.low) / (self.high - self.low):.2f}%"


def difference_table(
    pair: PairedDifference, label: str, runs: Mapping[tuple[str, str], str]
) -> Markup:
    """Return the difference of every unit, the largest last, with mean and interval.

    Parameters
    ----------
    pair
        The differences.
    label
        What differs, with its unit.
    runs
        Where the sips are, by neck and unit; what is not in it is not linked.
    """
    track = _Track.of(pair)
    order = np.argsort(pair.differences, kind="stable")
    first, second = str(pair.first), str(pair.second)
    names = (pair.unit, f"{first} less {second}", "difference", first, second, "sips")
    looks = ("", "spread", "", "", "", "")
    head = [
        tag("th", name, scope="col", **({"class_": kind} if kind else {}))
        for name, kind in zip(names, looks, strict=True)
    ]
    rows = [_unit_row(pair, int(k), track, runs) for k in order]
    caption = tag("caption", f"{label}: {first} less {second}")
    table = tag("table", caption, tag("thead", tag("tr", *head)), tag("tbody", *rows))
    title = f"{first} less {second}, {label}"
    return tag("div", scrolled(title, table), class_="differences")


def _unit_row(
    pair: PairedDifference, k: int, track: _Track, runs: Mapping[tuple[str, str], str]
) -> Markup:
    name, difference = pair.units[k], float(pair.differences[k])
    against = name in pair.exceptions
    links = [
        tag("a", str(neck), href=runs[str(neck), name], aria_label=f"{neck}, {name}")
        for neck in (pair.first, pair.second)
        if (str(neck), name) in runs
    ]
    return tag(
        "tr",
        tag("th", name, scope="row"),
        tag("td", _bar(pair, difference, track), class_="spread"),
        tag("td", number_of(difference, pair), *([" ↔"] if against else [])),
        tag("td", number_of(float(pair.first_values[k]), pair)),
        tag("td", number_of(float(pair.second_values[k]), pair)),
        tag("td", *(part for link in links for part in (link, " "))),
        class_="against" if against else "along",
    )


def _bar(pair: PairedDifference, difference: float, track: _Track) -> Markup:
    """Return a track with the interval, 0, the mean and a unit's difference on it."""
    low, high = pair.interval
    marks = []
    if np.isfinite(low) and np.isfinite(high):
        end = 100 - float(track.percent(high)[:-1])
        marks.append(
            tag("span", class_="interval", style=f"left:{track.percent(low)};right:{end:.2f}%")
        )
    marks += [
        tag("span", class_="zero", style=f"left:{track.percent(0.0)}"),
        tag("span", class_="mean", style=f"left:{track.percent(pair.mean)}"),
        tag(
            "span",
            class_="dot below" if difference < 0 else "dot above",
            style=f"left:{track.percent(difference)}",
        ),
    ]
    return tag("div", joined(*marks), class_="spot", aria_hidden="true")
