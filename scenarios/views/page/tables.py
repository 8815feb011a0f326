"""What tables of pages are made of."""

from __future__ import annotations

from collections.abc import Sequence

from scenarios.views.page.hypertext import Markup, tag

ABSENT = "–"
"""What stands for a value that is not there."""


def scrolled(title: str, table: Markup, looks: str = "wide") -> Markup:
    """Return a table that scrolls where it is too wide, also by keyboard."""
    return tag(
        "div", table, class_=looks, tabindex="0", role="region", aria_label=f"Table: {title}"
    )


def plain_cells(values: Sequence[str]) -> list[Markup]:
    """Return a cell for each value."""
    return [tag("td", value) for value in values]
