"""Equations as SVG drawn at build: a page needs neither scripts nor fonts from elsewhere."""

import html
import xml.etree.ElementTree as ET

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata
from sphinx.writers.html5 import HTML5Translator

PX_PER_EM = 16.0
SIZE_PX = 17.0
"""Size of the letters where text has 16 px: as high as those of the text beside them."""


def svg(latex: str, *, inline: bool) -> tuple[str, float]:
    """Return the drawing of one equation and how far it reaches below the line of text, em."""
    drawing = ziamath.Latex(latex, size=SIZE_PX, inline=inline, color="currentColor").svgxml()
    _, top, width, height = (float(number) for number in drawing.attrib["viewBox"].split())
    drawing.set("width", f"{width / PX_PER_EM:.3f}em")
    drawing.set("height", f"{height / PX_PER_EM:.3f}em")
    drawing.set("role", "img")
    drawing.set("aria-label", latex)
    return ET.tostring(drawing, encoding="unicode"), (top + height) / PX_PER_EM


def inline_equation(self: HTML5Translator, node: nodes.math) -> None:
    """Write an equation that stands in a line of text."""
    drawing, below = svg(node.astext(), inline=True)
    style = f"vertical-align:{-below:.3f}em"
    self.body.append(f'<span class="equation" style="{style}">{drawing}</span>')
    raise nodes.SkipNode


def displayed_equation(self: HTML5Translator, node: nodes.math_block) -> None:
    """Write an equation that stands alone; a wide one scrolls by itself."""
    drawing, _ = svg(node.astext(), inline=False)
    label = node.get("label")
    place = f' id="equation-{html.escape(label, quote=True)}"' if label else ""
    self.body.append(f'<div class="equation"{place}>{drawing}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> ExtensionMetadata:
    """Offer the renderer ``svg`` to ``html_math_renderer``."""
    app.add_html_math_renderer("svg", (inline_equation, None), (displayed_equation, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
