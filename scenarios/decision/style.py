"""The looks of what only a study's page has: rows of people with bars."""

STUDY_STYLE = """
caption { text-align: left; padding: .2rem .7rem .5rem; color: var(--quiet); }
.differences { margin: .6rem 0 1rem; }
.differences td.spread { min-width: 14rem; width: 50%; padding: 0 .4rem; }
.differences th.spread { text-align: center; }
.differences th[scope=row] { min-width: 7rem; }
.spot { position: relative; height: 1.75rem; }
.spot > span { position: absolute; top: 0; bottom: 0; }
.spot .interval { background: var(--track); }
.spot .zero { width: 1px; background: var(--quiet); }
.spot .mean { width: 2px; background: var(--ink); }
.spot .dot { top: 50%; bottom: auto; width: .8rem; height: .8rem; margin: -.4rem 0 0 -.4rem;
  border-radius: 50%; }
.spot .below { background: var(--upper); }
.spot .above { background: var(--lower); border-radius: 2px; }
.against td, .against th { font-weight: 600; }
.answer { font-size: 1.15rem; }
@media print { .spot > span { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""
