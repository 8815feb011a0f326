"""What the sections of a study's page are made of."""

from __future__ import annotations

from scenarios.views.page.embedded import Embedded, image
from scenarios.views.page.hypertext import Markup, tag

ABSENT = "–"
WIDTH = "46rem"
"""Of figures, as of text."""


def section(anchor: str, title: str, *parts: str) -> Markup:
    """Return a section with a heading that can be linked to."""
    return tag("section", tag("h2", title, id=anchor), *parts, aria_labelledby=anchor)


def figure(picture: Embedded) -> Markup:
    """Return a picture as wide as text."""
    return tag("figure", image(picture), style=f"max-width:{WIDTH}")


def scrolled(title: str, table: Markup) -> Markup:
    """Return a table that scrolls where it is too wide, also by keyboard."""
    return tag(
        "div", table, class_="wide", tabindex="0", role="region", aria_label=f"Table: {title}"
    )
