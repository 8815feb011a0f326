"""The looks of a report: readable on a phone, on a wide screen, on paper, and in a dim room."""

from __future__ import annotations

from collections.abc import Mapping

from scenarios.views.themes import THEMES, Theme

FURTHER: Mapping[str, Mapping[str, str]] = {
    "light": {
        "track": "#eceae4",
        "above": "rgb(178 44 44 / .28)",
        "below": "rgb(33 94 168 / .28)",
    },
    "dark": {
        "track": "#2c323a",
        "above": "rgb(255 120 110 / .45)",
        "below": "rgb(110 170 255 / .45)",
    },
}
"""Colours that only pages have: what lies in rails, and between two curves."""


def _variables(name: str, theme: Theme) -> str:
    """Return a theme as variables of a style sheet."""
    shown = ("paper", "panel", "ink", "quiet", "line", "package", "upper", "lower", "warning")
    values = {**{key: getattr(theme, key) for key in shown}, **FURTHER[name]}
    return f"color-scheme: {name}; " + " ".join(f"--{k}: {v};" for k, v in values.items())


COLOURS = f"""
:root {{ {_variables("light", THEMES["light"])} }}
@media screen and (prefers-color-scheme: dark) {{
  :root {{ {_variables("dark", THEMES["dark"])} }}
}}
"""

STYLE = (
    COLOURS
    + """
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; max-width: 74rem; padding: 1.5rem clamp(1rem, 3vw, 2.5rem) 4rem;
  background: var(--paper); color: var(--ink);
  font: 1.0625rem/1.55 system-ui, -apple-system, "Segoe UI", "Noto Sans", sans-serif; }
h1 { font-size: clamp(1.6rem, 4vw, 2.3rem); line-height: 1.15; margin: 0 0 .4rem; }
h2 { font-size: 1.4rem; line-height: 1.25; margin: 2.2rem 0 .6rem; padding-top: .9rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1.1rem; margin: 1.8rem 0 .4rem; }
h1, h2, h3, code, summary, td, th, figcaption { overflow-wrap: anywhere; }
p { max-width: 46rem; margin: .5rem 0 .9rem; }
a { color: var(--upper); }
nav ul { display: flex; flex-wrap: wrap; gap: .2rem 1.3rem; list-style: none; padding: 0;
  margin: 1rem 0 0; }
.quiet, figcaption, .lead { color: var(--quiet); }
.lead { font-size: 1.1rem; }
.warning { color: var(--warning); font-weight: 600; }
figure { margin: 0; min-width: 0; }
figcaption { font-size: .92rem; margin: .3rem 0 0; }
img { display: block; max-width: 100%; height: auto; }
figure img { width: 100%; border-radius: 4px; }
/* A card holds a picture that was drawn on light paper: it stays light in a dim room. */
.curves figure, .imprint figure, .sequence li { LIGHT color: var(--ink); }
.sequence li { background: var(--panel); border: 1px solid var(--line); border-radius: 8px;
  padding: .4rem .4rem .5rem; }
.verdicts { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(min(26rem,
  100%), 1fr)); margin: 1.2rem 0; }
.verdicts.many { grid-template-columns: repeat(auto-fit, minmax(min(15rem, 100%), 1fr));
  font-size: .92rem; gap: .8rem; }
.verdict { background: var(--panel); border: 1px solid var(--line); border-radius: 8px;
  padding: .9rem 1.1rem 1.1rem; }
.verdict h3 { margin: 0 0 .2rem; }
.verdict p { margin: .2rem 0 .7rem; }
.many .verdict { padding: .5rem .8rem .6rem; }
.many .gauge { margin-top: .2rem; }
.many .gauge .title { font-size: .8rem; gap: .4rem; line-height: 1.3; }
.gauge { margin-top: .7rem; font-size: .86rem; }
.gauge .title { display: flex; justify-content: space-between; gap: 1rem; }
.track { position: relative; height: 14px; margin: .25rem 0 .15rem; background: var(--track);
  border-radius: 3px; overflow: hidden; }
.track > span { position: absolute; top: 0; bottom: 0; }
.track .range { background: repeating-linear-gradient(135deg, #d98f86 0 4px, #efc9c3 4px 8px);
  border-left: 2px solid var(--warning); }
.track .value { left: 0; background: var(--upper); border-radius: 3px 0 0 3px; top: 3px;
  bottom: 3px; }
.key { display: flex; flex-wrap: wrap; gap: .3rem 1.6rem; list-style: none; padding: 0;
  margin: .8rem 0; }
.key li { display: flex; align-items: center; gap: .5rem; }
.key svg { flex: none; }
.curves { display: grid; gap: 1.1rem 1.4rem; grid-template-columns: repeat(auto-fill, minmax(min(
  21rem, 100%), 1fr)); }
.curves figure, .imprint figure { background: var(--panel); border: 1px solid var(--line);
  border-radius: 8px; padding: .6rem .8rem .8rem; }
.curves figcaption, .imprint figcaption { color: var(--ink); margin: 0 0 .4rem; }
.imprint { display: grid; gap: 1.1rem 1.4rem; grid-template-columns: repeat(auto-fit, minmax(min(
  24rem, 100%), 1fr)); align-items: start; }
.sequence { display: grid; gap: 1rem; grid-template-columns: repeat(3, 1fr); list-style: none;
  padding: 0; margin: 1rem 0; }
.sequence img { border: 1px solid var(--line); }
.sequence img + img { margin-top: .35rem; }
.bars { display: flex; flex-wrap: wrap; gap: .8rem 2.5rem; margin: .6rem 0 1rem;
  font-size: .9rem; }
.bars div { flex: 1 1 15rem; max-width: 24rem; }
.bars .colours { display: block; height: 12px; border-radius: 3px; margin: .2rem 0; }
.bars .ticks { display: flex; justify-content: space-between; color: var(--quiet); }
.wide { overflow-x: auto; }
.wide.low { max-height: 16rem; overflow-y: auto; }
.wide:focus-visible { outline: 2px solid var(--upper); outline-offset: 2px; }
table { border-collapse: collapse; font-size: .95rem; font-variant-numeric: tabular-nums;
  background: var(--panel); min-width: 100%; }
th, td { padding: .24rem .7rem; border-bottom: 1px solid var(--line); text-align: right;
  vertical-align: top; min-width: 5.5rem; }
th[scope=row] { text-align: left; font-weight: 400; min-width: 12rem; position: sticky; left: 0;
  background: var(--panel); }
td { white-space: nowrap; }
.low td { white-space: normal; }
td small { color: var(--quiet); }
td.unit { text-align: left; white-space: nowrap; color: var(--quiet); min-width: 3.5rem; }
thead th { border-bottom: 2px solid var(--ink); overflow-wrap: break-word; }
thead th:first-child, thead th.unit { text-align: left; }
tbody th[scope=rowgroup] { text-align: left; padding-top: 1rem; }
pre { overflow-x: auto; background: var(--panel); border: 1px solid var(--line); border-radius: 6px;
  padding: .8rem 1rem; font-size: .8rem; line-height: 1.45; }
code { font-family: ui-monospace, "SF Mono", "DejaVu Sans Mono", monospace; font-size: .92em; }
pre code { overflow-wrap: normal; font-size: 1em; }
details { margin: .3rem 0; }
summary { cursor: pointer; padding: .3rem 0; font-weight: 600; }
@media (min-width: 60rem) { th[scope=row] { white-space: nowrap; } }
.many + p { max-width: none; }
@media (min-width: 100rem) { body { max-width: 96rem; } }
@media (max-width: 40rem) {
  .sequence { grid-template-columns: repeat(2, 1fr); gap: .7rem; }
  th[scope=row] { min-width: 9.5rem; }
  th, td { min-width: 4.8rem; padding: .32rem .5rem; }
}
@media print {
  @page { margin: 14mm; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  html { font-size: 11.5px; }
  body { background: white; max-width: none; padding: 0; }
  nav, .downloads { display: none; }
  h2, h3 { break-after: avoid; }
  .run + .run { break-before: page; }
  .run { break-inside: avoid; }
  .sequence { grid-template-columns: repeat(6, 1fr); gap: .5rem; }
  figure, .verdict, tr, .sequence li { break-inside: avoid; }
  .verdicts { grid-template-columns: repeat(auto-fit, minmax(22rem, 1fr)); }
  .curves { grid-template-columns: repeat(3, 1fr); }
  h2 { margin-top: 1.6rem; }
  .imprint { grid-template-columns: 1.25fr 1fr; }
  .wide, pre { overflow: visible; }
  .wide.low { max-height: none; }
  pre { white-space: pre-wrap; }
}
""".replace("LIGHT", _variables("light", THEMES["light"]))
)
