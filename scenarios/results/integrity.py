"""What belongs together in a run directory, and whether it still does.

The summary is written last and holds a checksum of every file that a run is read from, and of
itself. A file that was cut, edited, or taken from another run is found before anything is shown.
What a run depends on has a fingerprint too: nothing is resumed, and no finished run is taken for
the wanted one, unless version, settings and files are the same.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from geometry2d.foundation.output import PARTIAL, file_at_once
from scenarios.results.increment import SolutionError
from scenarios.results.summary import SUMMARY_FILE
from scenarios.settings.scenario import SHAPE

FILES, ITSELF = "checksums", "checksum"

READ_ENDINGS = (".toml", ".csv", ".h5", ".json", ".svg", ".dxf", ".stl")
"""Endings of files that a run is read from; logs, pictures and films may change."""

BLOCK_BYTES = 1 << 20

INPUTS_FILE = "inputs.json"
"""Version, and checksums of the settings and of the files that a run depends on."""

VERSION, KEYS, SETTINGS = "version", "keys", "settings"
"""Names of the checksums of what a run depends on beside files: the product's version, the keys
that its settings have, and their values."""

MOTION, CONVERTED = "motion.file", "motion.converted"
"""Names of the checksum of a given motion, and of the one that a run made of its recording."""

FILMED = ("recording.start_s", "recording.end_s")
"""Names of what a motion depends on only while it is to be converted."""

KEPT_FOLDER = "inputs/"
"""Every file below this folder of a run directory belongs to the run, whatever its ending."""


def sealed(summary: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return a summary with the checksums of the files in its folder and of itself."""
    files = {name: checksum(folder / name) for name in _names(folder)}
    content = {**summary, FILES: files}
    return {**content, ITSELF: _of_content(content)}


def checked_summary(folder: Path) -> dict[str, Any]:
    """Return the summary of a run directory whose files are those it was finished with.

    A summary without checksums, from a version that did not write them, is returned as it is.

    Raises
    ------
    SolutionError
        If the summary cannot be read, or a file is missing or not the one that was written.
    """
    summary = _read(folder / SUMMARY_FILE)
    if FILES not in summary:
        return summary
    content = {name: value for name, value in summary.items() if name != ITSELF}
    if summary.get(ITSELF) != _of_content(content):
        raise _changed(folder, SUMMARY_FILE)
    for name, known in summary[FILES].items():
        if not (folder / name).is_file():
            raise SolutionError(f"{folder} is incomplete: {name} is missing; replay it again")
        if checksum(folder / name) != known:
            raise _changed(folder, name)
    return summary


def checksum(file: Path) -> str:
    """Return the SHA-256 of a file's content."""
    digest = hashlib.sha256()
    with file.open("rb") as stream:
        while block := stream.read(BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()


def fingerprint(scenario_toml: str, inputs: Mapping[str, str]) -> dict[str, str]:
    """Return what a run depends on, by name.

    Parameters
    ----------
    scenario_toml
        The resolved scenario.
    inputs
        Checksums of files, by the setting that names them.
    """
    settings = hashlib.sha256(scenario_toml.encode()).hexdigest()
    keys = hashlib.sha256("\n".join(sorted(SHAPE.keys)).encode()).hexdigest()
    return {VERSION: version("drinksim"), KEYS: keys, SETTINGS: settings, **inputs}


def write_inputs(folder: Path, inputs: Mapping[str, str]) -> None:
    """Write a fingerprint into a run directory."""
    text = json.dumps(inputs, indent=2, ensure_ascii=False)
    with file_at_once(folder / INPUTS_FILE) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def read_inputs(folder: Path) -> dict[str, str] | None:
    """Return the fingerprint of a run directory, None if it has none that can be read."""
    try:
        known = json.loads((folder / INPUTS_FILE).read_text(encoding="utf-8"))
        return {str(name): str(value) for name, value in known.items()}
    except (OSError, ValueError, AttributeError, RecursionError):
        return None


def differing_input(folder: Path, inputs: Mapping[str, str]) -> str | None:
    """Return the first thing, in words, that is not as in the folder's fingerprint, or None."""
    earlier = read_inputs(folder)
    if earlier is None:
        return "inputs that are not known any more"
    if MOTION in inputs and CONVERTED in earlier:
        # The run's own motion is given: the recording is not converted again.
        earlier[MOTION] = earlier.pop(CONVERTED)
        earlier = {name: value for name, value in earlier.items() if name not in FILMED}
    earlier.pop(CONVERTED, None)
    for name in (
        VERSION,
        KEYS,
        *sorted((earlier.keys() | inputs.keys()) - {VERSION, KEYS, SETTINGS}),
        SETTINGS,
    ):
        if earlier.get(name) != inputs.get(name):
            if name == VERSION:
                return f"drinksim {earlier.get(name)}, this is {inputs[name]}"
            if name == KEYS:
                return (
                    f"another state of drinksim {inputs[VERSION]}, whose settings have other keys"
                )
            if name in FILMED:
                return f"another {name}"
            return "other settings" if name == SETTINGS else f"another file for {name}"
    return None


def _names(folder: Path) -> Iterator[str]:
    for file in sorted(folder.rglob("*")):
        name = file.relative_to(folder).as_posix()
        read = file.suffix in READ_ENDINGS or name.startswith(KEPT_FOLDER)
        # What a killed process left half written is removed with the next draft of that file.
        draft = file.name.startswith(".") and f"{PARTIAL}-" in file.name
        if file.is_file() and read and not draft and name != SUMMARY_FILE:
            yield name


def _of_content(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, ensure_ascii=True)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _read(file: Path) -> dict[str, Any]:
    try:
        summary = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        raise SolutionError(
            f"{file} is damaged: it holds no summary; replay the run again"
        ) from None
    wanted = ("finished", "sentence", "increments", "version")
    missing = [name for name in wanted if not isinstance(summary, dict) or name not in summary]
    if missing:
        raise SolutionError(f"{file} is damaged: it does not say {missing[0]!r}; replay it again")
    return dict(summary)


def _changed(folder: Path, name: str) -> SolutionError:
    return SolutionError(
        f"{folder / name} was changed after the run was finished, or is another run's: put the "
        "original back, or replay the run again"
    )
