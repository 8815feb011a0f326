"""Skins sampled from what a calibration leaves open.

A calibration states the logarithms of its parameters with standard errors and correlations
(linearised fit, :mod:`scenarios.studies.identifiability`). Samples are normal with these, cut off
at the limits between which the calibration searched: what lies beyond them was not asked for.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.materials.library import MaterialCard, configuration_cards
from scenarios.campaign.variation import StudyError
from scenarios.settings.person import Skin
from scenarios.settings.writing import toml_value

Array = NDArray[np.float64]

MOST_TRIES = 10_000
"""Draws beyond the limits in a row, after which a region is said to lie outside them."""


@dataclass(frozen=True)
class SkinRegion:
    """A skin whose parameters are known with errors.

    Attributes
    ----------
    cards
        Its layers, outermost first, as they are written.
    names
        ``layer.key`` of the parameters that were fitted.
    logarithms
        (p,) of their values.
    covariance
        (p, p) of the logarithms.
    """

    cards: Mapping[str, MaterialCard]
    names: tuple[str, ...]
    logarithms: Array
    covariance: Array

    @classmethod
    def read(cls, file: Path, skin: Skin) -> SkinRegion:
        """Return the region that a ``calibration.json`` states about the skin of a scenario.

        Raises
        ------
        StudyError
            If it is no calibration, or one of another skin.
        MaterialError
            If the skin's own file is wrong.
        """
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
            names, values = zip(*found["parameters"].items(), strict=True)
            known = found["identifiability"]
            errors = np.array([known["relative_standard_error"][name] for name in names], float)
            rows = [[known["correlation"][name][other] for other in names] for name in names]
            region = cls(
                configuration_cards(skin.file or skin.configuration),
                names,
                np.log(np.array(values, float)),
                np.array(rows, float) * np.outer(errors, errors),
            )
        except (OSError, KeyError, TypeError, ValueError, AttributeError) as error:
            raise StudyError(
                f"doubt.skin = {str(file)!r} is no calibration.json: make one with drinksim "
                "calibrate"
            ) from error
        region._refuse_strange(file)
        return region

    def _refuse_strange(self, file: Path) -> None:
        for name in self.names:
            layer, _, key = name.partition(".")
            if layer not in self.cards or key not in self.cards[layer].parameters:
                raise StudyError(
                    f"doubt.skin = {str(file)!r} fitted {name}, which the skin of the study does "
                    "not have: set [set.skin] to the skin that was calibrated"
                )
        if not (np.all(np.isfinite(self.logarithms)) and np.all(np.isfinite(self.covariance))):
            raise StudyError(
                f"doubt.skin = {str(file)!r}: a parameter has no finite error: the curve does not "
                "measure it; calibrate fewer parameters"
            )

    @property
    def limits(self) -> Array:
        """(p, 2) logarithms between which the parameters lie; infinite where none are written."""
        ends = [self.cards[layer].ranges.get(key) for layer, key in self._keys]
        return np.array(
            [(-np.inf, np.inf) if end is None else (np.log(end[0]), np.log(end[2])) for end in ends]
        )

    def sampled(self, random: np.random.Generator) -> dict[str, float]:
        """Return sampled parameters, by ``layer.key``.

        Raises
        ------
        StudyError
            If hardly any lie within the limits.
        """
        low, high = self.limits.T
        for _ in range(MOST_TRIES):
            drawn = random.multivariate_normal(self.logarithms, self.covariance, method="eigh")
            if np.all((low <= drawn) & (drawn <= high)):
                return dict(zip(self.names, np.exp(drawn).tolist(), strict=True))
        raise StudyError(
            f"doubt.skin: of {MOST_TRIES} sampled skins none lies within the limits of "
            f"{', '.join(self.names)}: calibrate fewer parameters"
        )

    def text(self, parameters: Mapping[str, float]) -> str:
        """Return the file of a skin with these parameters."""
        tables: dict[str, dict[str, Any]] = {
            layer: dict(card.parameters) for layer, card in self.cards.items()
        }
        for name, value in parameters.items():
            layer, _, key = name.partition(".")
            old = tables[layer][key]
            tables[layer][key] = [value] if isinstance(old, Sequence) else value
        return "\n".join(
            "\n".join([f"[{layer}]", *(f"{k} = {toml_value(v)}" for k, v in table.items()), ""])
            for layer, table in tables.items()
        )

    @property
    def _keys(self) -> list[tuple[str, str]]:
        split = (name.partition(".") for name in self.names)
        return [(layer, key) for layer, _, key in split]
