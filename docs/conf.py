"""Settings of the documentation site: ``make docs`` builds it, offline, with warnings as errors."""

import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE / "_extensions")]

BARS = re.compile(r"(?<!`)\|(?!`)(?=(?:[^`]*``[^`]*``)*[^`]*$)")
"""Bars outside of literals."""
NAMES = re.compile(r"\w+(, \w+)+")
ALIAS = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")

project = "drinksim"
author = "The drinksim developers"
project_copyright = author
version = release = installed_version("drinksim")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "equations",
]
templates_path = ["_templates"]
exclude_patterns = ["_*"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

add_module_names = False
autodoc_member_order = "bysource"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "Indices", "Integers")}
napoleon_attr_annotations = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True
# Classes of different modules may share a name that a docstring says without its module.
suppress_warnings = ["ref.python"]

html_theme = "furo"
html_title = f"drinksim {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "svg"


def plain_text(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Let bars be absolute values, not substitutions, and attributes share a description."""
    lines[:] = [BARS.sub(r"\\|", line) for line in lines]
    if "Attributes" in lines:
        begin = lines.index("Attributes")
        lines[begin:] = [
            line.replace(", ", ",\N{NO-BREAK SPACE}") if NAMES.fullmatch(line) else line
            for line in lines[begin:]
        ]


def signature(
    app: Sphinx,
    what: str,
    name: str,
    thing: object,
    options: object,
    arguments: str | None,
    returns: str | None,
) -> tuple[str | None, str | None]:
    """Show names of types as they are written in the source."""
    shown = (text and ALIAS.sub(r"\1", text) for text in (arguments, returns))
    return next(shown), next(shown)


def setup(app: Sphinx) -> None:
    """Read docstrings as plain text first."""
    app.connect("autodoc-process-docstring", plain_text, priority=400)
    app.connect("autodoc-process-signature", signature)
