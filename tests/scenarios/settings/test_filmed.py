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


def test_a_motion_given_beside_a_scenario_is_of_its_filmed_neck():
    for neck in ("package.neck=DC", 'package.outline="mine.svg"'):
        scenario = load_scenario("A38-F", ["motion.file=mine.csv", neck])
        assert scenario.filmed_package.measurements == A38_NECK
    stated = load_scenario("A38-F", ["motion.file=mine.csv", "package.neck=DC", "filmed.neck=DC"])
    assert stated.filmed_package.measurements == DC_NECK


def test_a_file_that_states_the_filmed_neck_keeps_it_beside_another_motion(tmp_path: Path):
    file = tmp_path / "mine.toml"
    file.write_text('base = "A38-F"\n[filmed]\nneck = "DC"\n')
    scenario = load_scenario(file, ["motion.file=mine.csv", "package.crests=1"])
    assert scenario.filmed_package.measurements == DC_NECK


def test_a_file_without_a_film_means_its_own_neck(tmp_path: Path):
    file = tmp_path / "mine.toml"
    file.write_text('name = "mine"\n[package]\nneck = "DC"\n')
    assert load_scenario(file, ["motion.file=mine.csv"]).filmed is None
    changed = load_scenario(file, ["motion.file=mine.csv", "package.crests=0"])
    assert changed.filmed_package.measurements == DC_NECK


@pytest.fixture
def run_of_dc(tmp_path: Path) -> Path:
    """What a run directory of DC-F says of its inputs."""
    run = tmp_path / "run"
    (run / "motion").mkdir(parents=True)
    motion = run / "motion" / "motion.csv"
    motion.write_text("")
    (run / "scenario.toml").write_text(
        resolved_toml(load_scenario("DC-F", [f'motion.file="{motion}"']))
    )
    return run


def test_a_run_says_which_neck_its_motion_is_of(run_of_dc: Path):
    motion = f'motion.file="{run_of_dc}/motion/motion.csv"'
    other = load_scenario("A38-F", [motion])
    assert other.package.measurements == A38_NECK
    assert other.filmed_package.measurements == DC_NECK
    assert load_scenario("DC-F", [motion]).filmed is None
    assert load_scenario("A38-F", [motion, "filmed.neck=A38"]).filmed_package == other.package
    assert load_scenario(run_of_dc / "scenario.toml").filmed is None


def test_a_motion_of_a_run_that_cannot_be_read_is_of_the_scenario(run_of_dc: Path):
    (run_of_dc / "scenario.toml").write_text("[of_another_version]\n")
    motion = f'motion.file="{run_of_dc}/motion/motion.csv"'
    assert load_scenario("A38-F", [motion]).filmed is None


def test_none_means_that_the_package_itself_was_filmed():
    changed = load_scenario("A38-F", ["package.crests=1"])
    as_filmed = changed.with_(package=changed.filmed_package, filmed=None)
    assert as_filmed.filmed is None
    assert as_filmed.package.measurements == A38_NECK


def test_equal_drawings_are_one_neck(tmp_path: Path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "neck.svg").write_text("<svg/>")
    own = load_scenario("A38-F").with_(package={"outline": tmp_path / "a" / "neck.svg"})
    drawn = own.with_(filmed=None)
    assert drawn.with_(package={"outline": tmp_path / "b" / "neck.svg"}).filmed is None
    (tmp_path / "b" / "neck.svg").write_text("<svg> </svg>")
    assert drawn.with_(package={"outline": tmp_path / "b" / "neck.svg"}).filmed is not None
