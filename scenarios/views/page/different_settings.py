"""The table of a report: settings that differ between its runs, with none left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scenarios.results.integrity import read_inputs
from scenarios.results.texts import motion_bytes
from scenarios.settings.layers import values_by_path
from scenarios.settings.named_files import named_files
from scenarios.views.page.hypertext import Markup, joined, tag
from scenarios.views.page.reported import Reported
from scenarios.views.page.tables import ABSENT, plain_cells, scrolled

CHECKSUM_LETTERS = 8
"""Of a file's checksum, to tell it from another one."""

NOT_COMPARED = ("name", "description", "motion.file")
"""What a run is called, and where its motion lies: whether motions differ is seen from them."""


def different_settings(runs: Sequence[Reported]) -> Markup:
    """Return a table of the settings that are not the same in all runs."""
    lines = []
    if len({motion_bytes(run.solution) for run in runs}) > 1:
        cells = plain_cells([_motion_in_words(run) for run in runs])
        lines.append(tag("tr", tag("th", "motion followed", scope="row"), *cells))
    for name, values in _settings_by_run(runs).items():
        if len(set(values)) > 1:
            path = tag("th", tag("code", name), scope="row")
            lines.append(tag("tr", path, *plain_cells(values)))
    if not lines:
        return tag("p", "The runs have the same settings and the same motion.")
    head = [tag("th", text, scope="col") for text in ("setting", *(run.label for run in runs))]
    table = tag("table", tag("thead", tag("tr", *head)), tag("tbody", *lines))
    return joined(
        tag("h3", f"Settings that differ between the runs: {len(lines)}"),
        scrolled("Settings that differ", table, looks="wide low"),
    )


def _motion_in_words(run: Reported) -> str:
    start, end = run.solution.time_s[[0, -1]]
    x, y = np.ptp(run.solution.shift_mm, axis=0)
    turned = math.degrees(np.ptp(run.solution.angle_rad))
    return f"{start:.2f} to {end:.2f} s; the neck moves {x:.1f}, {y:.1f} mm and turns {turned:.1f}°"


def _settings_by_run(runs: Sequence[Reported]) -> dict[str, list[str]]:
    """Return every setting by its path: its value in each run.

    Each run has a copy of its own of every file: files are compared by content, and told by their
    name and the beginning of their checksum.
    """
    settings = [values_by_path(run.scenario) for run in runs]
    checksums = [_checksums(run) for run in runs]
    paths = dict.fromkeys(path for values in settings for path in values)
    same = {
        name for name, value in checksums[0].items() if all(c.get(name) == value for c in checksums)
    }
    return {
        path: [
            _file_in_words(str(values[path]), known[path])
            if path in known and path in values
            else _setting_in_words(values.get(path))
            for values, known in zip(settings, checksums, strict=True)
        ]
        for path in paths
        if path not in NOT_COMPARED and path not in same
    }


def _checksums(run: Reported) -> dict[str, str]:
    """Return checksums of the files that a run's settings name, by setting."""
    folder = run.solution.folder
    known = (read_inputs(folder) or {}) if folder else {}
    return {name: known[name] for name in named_files(run.scenario) if name in known}


def _file_in_words(path: str, checksum: str) -> str:
    """Return the name of a file, and what tells it from another one of that name.

    >>> _file_in_words("runs/A/inputs/recording.video/sip.mp4", "a8b69af7a6ef37b6")
    'sip.mp4 (a8b69af7)'
    """
    return f"{Path(path).name} ({checksum[:CHECKSUM_LETTERS]})"


def _setting_in_words(value: object) -> str:
    """Return a setting as it is read; an empty list, and what a scenario does not have, as none.

    >>> _setting_in_words((1.0, 2.5)), _setting_in_words(()), _setting_in_words(None)
    ('1.0, 2.5', '–', '–')
    """
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value)) or ABSENT
    return ABSENT if value is None else str(value)
