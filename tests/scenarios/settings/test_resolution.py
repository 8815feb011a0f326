"""Resolutions: what they stand for, and what is left of it when single keys are given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from geometry2d.mesh import LEVELS
from scenarios.settings.numerics import QUICK, RESOLUTIONS, Numerics
from scenarios.settings.scenario import SHAPE, load_scenario, resolved_toml

RESOLUTION = "numerics.resolution"


@pytest.mark.parametrize("name", RESOLUTIONS)
def test_a_resolution_sets_all_that_it_stands_for(name: str) -> None:
    numerics = load_scenario("A38-F", [f"{RESOLUTION}={name}"]).numerics
    chosen = RESOLUTIONS[name]
    for table in ("mesh", "steps", "newton", "penalty", "stick", "lips"):
        assert getattr(numerics, table) == getattr(chosen, table)


@pytest.mark.parametrize("name", LEVELS)
def test_the_resolutions_of_a_mesh_change_nothing_else(name: str) -> None:
    numerics = load_scenario("A38-F", [f"{RESOLUTION}={name}"]).numerics
    assert numerics == replace(Numerics(), resolution=name, mesh=LEVELS[name])


def test_quick_is_coarser_in_time_and_contact_too() -> None:
    usual = Numerics()
    assert QUICK.mesh.far_mm > LEVELS["coarse"].far_mm
    assert QUICK.steps.accuracy_mm > usual.steps.accuracy_mm
    assert QUICK.newton.tolerance > usual.newton.tolerance
    assert QUICK.penalty.stiffness_mpa_per_mm < usual.penalty.stiffness_mpa_per_mm


def test_each_key_of_a_resolution_can_be_changed_by_itself() -> None:
    settings = [f"{RESOLUTION}=quick", "numerics.steps.accuracy_mm=0.02"]
    numerics = load_scenario("A38-F", settings).numerics
    assert numerics.steps == replace(QUICK.steps, accuracy_mm=0.02)
    assert numerics.mesh == QUICK.mesh and numerics.penalty == QUICK.penalty


def test_a_resolution_replaces_what_it_stands_for_in_a_written_file_and_nothing_more(
    tmp_path: Path,
) -> None:
    settings = [f"{RESOLUTION}=quick", "numerics.steps.cutback=0.4", "numerics.mesh.far_mm=9"]
    (tmp_path / "sip.toml").write_text(
        resolved_toml(load_scenario("A38-F", settings)), encoding="utf-8"
    )
    again = load_scenario(tmp_path / "sip.toml").numerics
    assert again.mesh == replace(QUICK.mesh, far_mm=9.0)
    changed = load_scenario(tmp_path / "sip.toml", [f"{RESOLUTION}=coarse"]).numerics
    usual = Numerics(resolution="coarse", mesh=LEVELS["coarse"])
    assert changed == replace(usual, steps=replace(usual.steps, cutback=0.4))


def test_a_resolution_stands_for_the_keys_in_which_resolutions_differ() -> None:
    keys = SHAPE.presets[RESOLUTION]
    assert "numerics.mesh.contact_mm" in keys and "numerics.newton.tolerance" in keys
    assert "numerics.newton.patience" not in keys
    assert SHAPE.presets["package.neck"] >= {"package.land_mm", "package.pitch_mm"}
