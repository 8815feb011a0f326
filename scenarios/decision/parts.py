"""What the sections of a study's page are made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scenarios.views.page.embedded import Embedded, image
from scenarios.views.page.hypertext import Markup, tag

WIDTH = "46rem"
"""Of figures, as of text."""


@dataclass(frozen=True)
class Part:
    """A section of a page, which the list of contents leads to.

    ``is_scripted`` parts are there only where scripts run.
    """

    anchor: str
    title: str
    markup: Markup
    is_scripted: bool = False

    @classmethod
    def of(cls, anchor: str, title: str, *children: str) -> Part:
        """Return a section with a heading."""
        heading = tag("h2", title, id=anchor)
        return cls(anchor, title, tag("section", heading, *children, aria_labelledby=anchor))


def contents(parts: Sequence[Part]) -> Markup:
    """Return the list of contents."""
    entries = []
    for part in parts:
        link = tag("a", part.title, href=f"#{part.anchor}")
        hidden = {"class_": "scripted", "hidden": "hidden"} if part.is_scripted else {}
        entries.append(tag("li", link, **hidden))
    return tag("nav", tag("ul", *entries), aria_label="Contents")


def body(parts: Sequence[Part]) -> Markup:
    """Return the sections, one after the other."""
    return tag("main", *(part.markup for part in parts))


def figure(picture: Embedded) -> Markup:
    """Return a picture as wide as text."""
    return tag("figure", image(picture), style=f"max-width:{WIDTH}")
