"""What a run depends on, and where its directory keeps it.

A run directory is self-contained: it holds a copy of every file that its scenario names, and the
scenario in it names the copies, relative to itself. It can be moved, and its inputs deleted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fem2d.materials.library import LIBRARY as MATERIALS
from geometry2d.foundation.output import RESULT_MARK
from scenarios.results.integrity import FILMED, KEPT_FOLDER, MOTION, checksum, fingerprint
from scenarios.settings.inputs import REFERENCE, input_files
from scenarios.settings.named_files import with_files
from scenarios.settings.scenario import Scenario, resolved_toml

REFERENCE_FOLDER = "reference"
"""Folder of a run directory with the run whose forces its hand follows."""

MOTION_FOLDER = "motion"

PLACES = {MOTION: f"{MOTION_FOLDER}/motion.csv", REFERENCE: REFERENCE_FOLDER}
"""Where a run directory keeps what a setting names, if not among its other inputs."""


@dataclass(frozen=True)
class RunInputs:
    """What a run depends on.

    Attributes
    ----------
    scenario
        The scenario of the run directory; it names files relative to that.
    sources
        The files to be copied, by setting.
    places
        Where the run directory keeps what the settings name, and the motion.
    checksums
        Of files and materials, and what else a motion depends on, by name.
    """

    scenario: Scenario
    sources: Mapping[str, Path]
    places: Mapping[str, str]
    checksums: Mapping[str, str]

    @classmethod
    def of(cls, scenario: Scenario) -> RunInputs:
        """Return the inputs of a scenario whose motion, if it has one, is in a file.

        Raises
        ------
        ScenarioError
            If a file is missing.
        """
        sources = input_files(scenario)
        places = {MOTION: PLACES[MOTION]}
        for setting, file in sources.items():
            places[setting] = PLACES.get(setting, f"{KEPT_FOLDER}{setting}/{file.name}")
        moved = scenario.with_(motion=PLACES[MOTION], filmed=scenario.filmed)
        kept = with_files(moved, places)
        checksums = {
            setting: checksum(file / RESULT_MARK if setting == REFERENCE else file)
            for setting, file in sources.items()
        }
        skin = scenario.skin.configuration
        checksums["skin.configuration"] = checksum(MATERIALS / f"{skin}.toml")
        if MOTION not in sources:
            assert scenario.recording is not None  # a scenario has a motion or a recording
            used = (scenario.recording.start_s, scenario.recording.end_s)
            checksums |= {name: str(time) for name, time in zip(FILMED, used, strict=True)}
        return cls(kept, sources, places, checksums)

    @property
    def text(self) -> str:
        """The scenario of the run directory as a file."""
        return resolved_toml(self.scenario)

    @property
    def fingerprint(self) -> dict[str, str]:
        """Version, and checksums of settings and inputs, by name."""
        return fingerprint(self.text, self.checksums)

    def within(self, folder: Path) -> Scenario:
        """Return the scenario with the copies in a run directory."""
        copies = {setting: str(folder / place) for setting, place in self.places.items()}
        return with_files(self.scenario, copies)
