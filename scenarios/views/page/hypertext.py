"""HTML written so that no text from a file can become markup.

Every child of a :func:`tag` is escaped unless it is :class:`Markup`, which only this module makes.
"""

from __future__ import annotations

import html

VOID = ("img", "meta", "col", "input")
"""The elements without an end tag."""


class Markup(str):
    """Text that is HTML already and is not escaped again."""

    __slots__ = ()


def tag(name: str, /, *children: str, **attributes: str) -> Markup:
    """Return an element with its children and attributes, escaped.

    An attribute's trailing underscore is dropped, other underscores are hyphens: ``class_``,
    ``aria_label``.

    >>> tag("p", "a < b", tag("b", "c"), class_="x")
    '<p class="x">a &lt; b<b>c</b></p>'
    """
    opening = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(value)}"'
        for key, value in attributes.items()
    )
    if name in VOID:
        return Markup(f"<{name}{opening}>")
    return Markup(f"<{name}{opening}>{joined(*children)}</{name}>")


def joined(*children: str) -> Markup:
    """Return children one after the other; those that are not markup are escaped."""
    return Markup(
        "".join(
            child if isinstance(child, Markup) else html.escape(child, quote=False)
            for child in children
        )
    )


def folded(title: str, /, *children: str) -> Markup:
    """Return what is open on paper and without scripts, and what the page's scripts fold."""
    return tag("details", tag("summary", title), *children, open="open", data_folded="yes")


def page(
    title: str, style: str, body: Markup, *, scripts: str = "'none'", language: str = "en"
) -> str:
    """Return a whole document that may load nothing, and run nothing but ``scripts``.

    Parameters
    ----------
    title
        of the window; escaped.
    style
        CSS, taken as it is: never from a file.
    body
        the children of the body.
    scripts
        the source expression of its Content-Security-Policy for scripts, such as a digest.
    """
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {scripts}"
    head = joined(
        tag("meta", charset="utf-8"),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("title", title),
        tag("style", Markup(style)),
    )
    whole = tag("html", tag("head", head), tag("body", body), lang=language)
    return f"<!DOCTYPE html>\n{whole}\n"
