"""Which neck was filmed: the one beside the film, unless it is said otherwise."""

from pathlib import Path

import pytest

from geometry2d.neck import A38_NECK, DC_NECK
from scenarios.settings.scenario import load_scenario, resolved_toml


def test_a_changed_neck_takes_the_place_of_the_filmed_one():
    changed = load_scenario("A38-F", ["package.crests=1"])
    assert changed.package.measurements.crests == 1
    assert changed.filmed is not None
    assert changed.filmed_package.measurements == A38_NECK
    assert load_scenario("A38-F", ["package.neck=DC"]).filmed_package.measurements == A38_NECK


def test_the_neck_beside_the_film_is_the_filmed_one():
    scenario = load_scenario("DC-F", ["contact.friction=0.5"])
    assert scenario.filmed is None
    assert scenario.filmed_package.measurements == DC_NECK


def test_the_filmed_neck_stays_when_its_motion_becomes_known(tmp_path: Path):
    changed = load_scenario("A38-F").with_(package={"neck": "DC"})
    with_motion = changed.with_motion(tmp_path / "motion.csv")
    assert with_motion.filmed_package.measurements == A38_NECK
    assert with_motion.package.measurements == DC_NECK


def test_another_motion_is_of_the_package_it_comes_with(tmp_path: Path):
    mine = load_scenario("A38-F").with_(motion=tmp_path / "mine.csv", package={"neck": "DC"})
    assert mine.filmed is None
    assert mine.package.measurements == DC_NECK


def test_a_file_with_a_base_changes_the_neck_and_not_the_film(tmp_path: Path):
    file = tmp_path / "mine.toml"
    file.write_text('base = "A38-F"\n[package]\nland_mm = 2.0\n')
    scenario = load_scenario(file)
    assert scenario.package.measurements.land_mm == 2.0
    assert scenario.filmed_package.measurements == A38_NECK


def test_what_is_written_out_reads_back(tmp_path: Path):
    changed = load_scenario("A38-F", ["package.crests=1"])
    file = tmp_path / "out.toml"
    file.write_text(resolved_toml(changed))
    assert load_scenario(file) == changed


def test_the_filmed_neck_can_be_stated():
    scenario = load_scenario("A38-F", ["filmed.neck=DC"])
    assert scenario.filmed_package.measurements == DC_NECK
    assert scenario.package.measurements == A38_NECK


@pytest.mark.parametrize("anchor", ["lower_rim", "rim_centre", "marks"])
def test_anchors(anchor):
    scenario = load_scenario("A38-F", ["package.crests=1", f'placement.anchor="{anchor}"'])
    assert scenario.placement.anchor == anchor
