"""The page's scripts as one text: modules of this package behind the library that draws curves.

The modules in ``scripts`` are ECMAScript modules, each small and about one thing. A page may not
load files, so they are joined: in the order of :data:`MODULES`, without imports and the word
``export``, inside one function. Two modules must not define the same name; the browser's strict
mode refuses that.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from importlib.resources import files
from typing import Any

from scenarios.views.page.hypertext import Markup, tag

MODULES = (
    "arrays",
    "colours",
    "run",
    "camera",
    "section",
    "pointing",
    "curves",
    "imprint",
    "imprint_difference",
    "pane",
    "timeline",
    "main",
)
"""A module imports from those before it."""

IMPORT = re.compile(r"^import\b[^;]*;\n", re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:async )?function|class|const)", re.MULTILINE)


def page_script() -> str:
    """Return the whole script of a page."""
    modules = [EXPORT.sub("", IMPORT.sub("", _text(f"scripts/{name}.js"))) for name in MODULES]
    own = "\n".join(modules)
    return f'{_text("vendor/uPlot.iife.min.js")}\n(() => {{\n"use strict";\n{own}}})();\n'


def library_style() -> str:
    """Return the style sheet of the library that draws curves."""
    return _text("vendor/uPlot.min.css")


def explorer_style() -> str:
    """Return the looks of the moving part of a page."""
    return _text("styles/explore.css")


def script_policy(script: str) -> str:
    """Return the source expression of a Content-Security-Policy that allows this script alone."""
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    return f"'sha256-{digest}'"


def script_element(script: str) -> Markup:
    """Return the element that runs a script."""
    return tag("script", Markup(script))


def data_element(name: str, value: Any) -> Markup:
    """Return an element that holds ``value`` as JSON and runs nothing; no text of it is markup."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return tag("script", Markup(text), type="application/json", id=name)


def _text(name: str) -> str:
    return files("scenarios.views.page").joinpath(name).read_text(encoding="utf-8")
