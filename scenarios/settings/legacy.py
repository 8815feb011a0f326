"""Scenario files of earlier versions, as documents of today's.

Until version 0.2 a table ``[solver]`` held what is in ``[numerics]`` now, and a run's file also
wrote out keys that had no effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from geometry2d.foundation.toml import shown
from geometry2d.neck import NECKS
from scenarios.settings.tables import SettingError, Value

OLD = "solver"
NEW = "numerics"


def upgraded(document: Mapping[str, Value]) -> dict[str, Any]:
    """Return a document with old tables under today's names.

    Raises
    ------
    SettingError
        If a key stands in the old and in the new table.
    """
    new: dict[str, Any] = dict(document)
    if OLD not in document:
        return new
    old = new.pop(OLD)
    if not isinstance(old, Mapping):
        raise SettingError(f"{OLD} = {shown(old)}: write it as a table, [{NEW}]")
    numerics = new.get(NEW, {})
    if isinstance(numerics, Mapping):
        for key in old.keys() & numerics.keys():
            raise SettingError(f"{OLD}.{key} is the old name of {NEW}.{key}: give one of them")
        new[NEW] = {**numerics, **old}
    return _without_ineffective(new)


def _without_ineffective(document: dict[str, Any]) -> dict[str, Any]:
    """Return a document without what a run's file of an earlier version wrote without effect."""
    package, recording = document.get("package"), document.get("recording")
    if isinstance(package, Mapping) and "outline" in package:
        usual = NECKS.get(str(package.get("neck", "A38")))
        document["package"] = {
            key: value
            for key, value in package.items()
            if key != "neck" and (usual is None or value != getattr(usual, key, None))
        }
    if isinstance(recording, Mapping) and "motion" in document:
        document["recording"] = {
            key: value for key, value in recording.items() if key not in ("start_s", "end_s")
        }
    return document
