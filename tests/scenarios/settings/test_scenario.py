"""Scenarios: what is read, made in memory, resolved and refused."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.drawings.drawn_head import HeadDrawing
from geometry2d.foundation.errors import DrinksimError
from geometry2d.mesh import LEVELS
from geometry2d.neck import NECKS
from scenarios.settings.scenario import (
    LIBRARY,
    Friction,
    MotionFile,
    Scenario,
    ScenarioError,
    library_names,
    load_scenario,
    resolved_toml,
)
from scenarios.settings.tables import SettingError

SMALL = 'name = "mine"\n[motion]\nfile = "motion.csv"\n'
CIRCLES = {"upper_wall": (20, 9), "lower_wall": (40, 9), "upper_mark": (23, 1),
           "lower_mark": (37, 1)}  # fmt: skip


def written(folder: Path, text: str, name: str = "mine.toml") -> str:
    """Write a scenario file and return its name."""
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    return str(folder / name)


def neck_drawing(folder: Path) -> None:
    """Write a drawing of a neck, "neck.svg"."""
    shapes = [f'<circle id="{name}" cx="50" cy="{y}" r="{r}"/>' for name, (y, r) in CIRCLES.items()]
    (folder / "neck.svg").write_text(
        f'<svg width="90mm" height="90mm" viewBox="0 0 90 90">{"".join(shapes)}</svg>'
    )


def test_the_library_can_be_read() -> None:
    assert "A38-F" in library_names()
    for name in library_names():
        assert load_scenario(name).name == name


def test_the_resolved_file_reads_back_to_the_same_scenario(tmp_path: Path) -> None:
    file = tmp_path / "resolved.toml"
    changed = ["contact.friction=0.3", "package.crests=3", "numerics.mesh.contact_mm=0.3"]
    for chosen in (load_scenario("A38-F", changed), *map(load_scenario, library_names())):
        file.write_text(resolved_toml(chosen))
        assert load_scenario(file) == chosen


def test_the_resolved_file_has_every_setting_of_every_table() -> None:
    scenario = replace(load_scenario("A38-F"), motion=MotionFile("motion.csv"))
    document = tomllib.loads(resolved_toml(scenario))
    assert document["contact"] == {"friction": 1.0, "teeth_friction": 0.0, "lip_friction": 0.3}
    assert document["package"]["neck"] == "A38"
    assert document["package"]["thread_diameter_mm"] == 37.2
    assert document["motion"]["file"] == "motion.csv"
    assert len(document["head"]) > 20
    assert document["numerics"]["mesh"]["contact_mm"] == LEVELS["standard"].contact_mm
    assert document["numerics"]["inertia"]["relaxation_s"] == 0.02


def test_every_line_of_a_resolved_file_says_what_it_is() -> None:
    lines = resolved_toml(load_scenario("DC-AE")).splitlines()
    assert all(" # " in line for line in lines if line)
    (pitch,) = (line for line in lines if line.startswith("pitch_mm"))
    assert "PCO 1881" in pitch and "SP 38-400" not in pitch
    (jaw,) = (line for line in lines if line.startswith("jaw_opening_deg"))
    assert jaw.endswith("(changed from 7.0)")


def test_files_are_looked_for_beside_the_file_that_names_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(tmp_path / "far", SMALL)
    scenario = load_scenario(file)
    assert scenario.motion == MotionFile(str(tmp_path / "far" / "motion.csv"))
    assert scenario.recording is None
    recording = load_scenario("A38-F").recording
    assert recording is not None
    assert Path(recording.video).parent == LIBRARY / "A38-F"
    near = written(tmp_path, 'base = "far/mine.toml"\n[package]\noutline = "neck.svg"\n')
    based = load_scenario(near)
    assert based.motion == scenario.motion
    assert based.package.outline == str(tmp_path / "neck.svg")
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    said = load_scenario(near, ["package.outline=mine.svg"])
    assert said.package.outline == str(here / "mine.svg")
    assert said.with_(motion="moved.csv").motion == MotionFile(str(here / "moved.csv"))


def test_another_neck_brings_its_own_measurements() -> None:
    wide, narrow = (load_scenario("A38-F", [f"package.neck={n}"]).package for n in ("A38", "DC"))
    assert narrow.neck == "DC"
    assert narrow.measurements == NECKS["DC"] != wide.measurements
    given = load_scenario("A38-F", ["package.neck=DC", "package.thread_diameter_mm=30"]).package
    assert given.measurements == replace(NECKS["DC"], thread_diameter_mm=30.0)


def test_presets_replace_what_an_earlier_layer_wrote_out(tmp_path: Path) -> None:
    file = written(tmp_path, resolved_toml(load_scenario("A38-F", ["package.crests=3"])))
    changed = load_scenario(file, ["package.neck=DC", "numerics.resolution=coarse"])
    assert changed.package.measurements == NECKS["DC"]
    assert changed.numerics.mesh == LEVELS["coarse"]
    near = load_scenario(file, ["numerics.mesh.contact_mm=0.3"])
    assert near.numerics.mesh == replace(LEVELS["standard"], contact_mm=0.3)
    assert near.with_(numerics={"resolution": "fine"}).numerics.mesh == LEVELS["fine"]


def test_a_base_is_the_rest_of_what_a_file_says(tmp_path: Path) -> None:
    first = written(tmp_path, 'base = "DC-AE"\n[contact]\nfriction = 0.5\n', "first.toml")
    second = written(tmp_path, 'base = "first.toml"\nname = "second"\nmuscle = false\n')
    scenario, original = load_scenario(second), load_scenario("DC-AE")
    assert scenario.name == "second"
    assert scenario.contact == replace(original.contact, friction=0.5)
    assert scenario.muscle is None and load_scenario(first).muscle == original.muscle
    assert replace(
        scenario, name="DC-AE", contact=original.contact, muscle=original.muscle
    ) == replace(original)


def test_a_base_that_cannot_be_is_named(tmp_path: Path) -> None:
    written(tmp_path, 'base = "b.toml"\n', "a.toml")
    with pytest.raises(ScenarioError, match=r"b.toml is based on a.toml is based on b.toml"):
        load_scenario(written(tmp_path, 'base = "a.toml"\n', "b.toml"))
    with pytest.raises(ScenarioError, match=r"no scenario 'A38-X': did you mean 'A38-"):
        load_scenario(written(tmp_path, 'base = "A38-X"\n'))
    with pytest.raises(ScenarioError, match=r"mine.toml: base = 3: give a name or a file"):
        load_scenario(written(tmp_path, "base = 3\n"))
    with pytest.raises(SettingError, match="a base belongs into a file"):
        load_scenario("A38-F", ["base=DC-F"])
    written(tmp_path, 'base = "A38-F"\n[contact]\nfriction = 9\n', "wrong.toml")
    with pytest.raises(SettingError, match=r"wrong\.toml: contact\.friction = 9 is too large"):
        load_scenario(written(tmp_path, 'base = "wrong.toml"\n'))


def test_a_drawing_replaces_the_measured_neck(tmp_path: Path) -> None:
    neck_drawing(tmp_path)
    file = written(tmp_path, SMALL + '[package]\noutline = "neck.svg"\npackage_width_mm = 60.0\n')
    scenario = load_scenario(file)
    package = scenario.package
    assert package.outline == str(tmp_path / "neck.svg")
    assert package.measurements == replace(NECKS["A38"], package_width_mm=60.0)
    neck = package.section()
    assert neck.upper_mark == pytest.approx([0, 14])
    assert neck.upper_wall.project([[0, 17]]).distance == pytest.approx([-9])
    again = tomllib.loads(resolved_toml(scenario))
    assert again["package"].keys() == {
        "outline", "package_width_mm", "package_height_mm", "shoulder_mm"
    }  # fmt: skip
    assert load_scenario(written(tmp_path, resolved_toml(scenario), "again.toml")) == scenario
    with pytest.raises(SettingError, match=r"package\.outline = 3"):
        load_scenario("A38-F", ["package.outline=3"])


def test_a_neck_is_measured_or_drawn_and_the_last_word_counts(tmp_path: Path) -> None:
    neck_drawing(tmp_path)
    drawn = written(tmp_path, SMALL + '[package]\noutline = "neck.svg"\n')
    measured = written(tmp_path, resolved_toml(load_scenario("A38-F")), "measured.toml")
    assert load_scenario(measured, [f"package.outline={tmp_path}/neck.svg"]).package.outline
    assert load_scenario(drawn, ["package.neck=DC"]).package.measurements == NECKS["DC"]
    assert load_scenario(drawn).with_(package={"neck": "DC"}).package.outline is None
    for key, value in (("thread_diameter_mm", 40.0), ("crests", 2)):
        message = rf"package\.{key} says nothing beside package\.outline"
        with pytest.raises(SettingError, match=message):
            load_scenario(drawn, [f"package.{key}={value}"])
        both = written(tmp_path, Path(drawn).read_text() + f"{key} = {value}\n", "both.toml")
        with pytest.raises(SettingError, match=message):
            load_scenario(both)


def test_a_drawing_replaces_the_measured_head(tmp_path: Path) -> None:
    (tmp_path / "head.svg").write_text(HeadDrawing.of(head_section()).svg())
    file = written(tmp_path, SMALL + '[head]\noutline = "head.svg"\ntie_fade_mm = 3.0\n')
    scenario = load_scenario(file)
    head = scenario.head.section()
    assert head.tie_fade_mm == 3.0
    assert head.landmarks["nose"] == pytest.approx(head_section().landmarks["nose"])
    again = tomllib.loads(resolved_toml(scenario))
    assert again["head"] == {
        "outline": str(tmp_path / "head.svg"), "dermis_thickness_mm": 1.0, "tie_fade_mm": 3.0
    }  # fmt: skip
    assert load_scenario(written(tmp_path, resolved_toml(scenario), "again.toml")) == scenario
    for wrong, message in (
        ("outline = 3", r"head\.outline = 3: give a text in quotes, e.g. outline = \"head.svg\""),
        ('outline = "head.svg"\njaw_opening_deg = 5.0', "head.jaw_opening_deg says nothing beside"),
        ('outline = "head.svg"\ntie_fade = 5.0', "unknown key head.tie_fade: did you mean"),
    ):
        with pytest.raises(SettingError, match=message):
            load_scenario(written(tmp_path, SMALL + f"[head]\n{wrong}\n"))


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("contact.fricton=1", "unknown key contact.fricton: did you mean contact.friction?"),
        ("friction=0.5", "unknown key friction: did you mean contact.friction?"),
        ("placement.friction=0.5", "unknown key placement.friction: did you mean contact.friction"),
        ("longest_s=0.1", "unknown key longest_s: did you mean numerics.steps.longest_s?"),
        ("skin.friction=0.5", "unknown key skin.friction: did you mean contact.friction?"),
        ("contact.friction=-1", "contact.friction = -1 is too small: at least 0"),
        ("numerics.plane=strian", 'numerics.plane = "strian" is not a choice: did you mean'),
        ("package.neck=B38", 'package.neck = "B38" is not a choice: did you mean .A38'),
        ("skins.configuration=L1", r"unknown key skins: did you mean the table \[skin\]?"),
        ("numerics.resolution.x=1", "numerics.resolution = {x = 1} is not a choice"),
        ("name.x=1", "name = {x = 1}: give a text"),
        ("contact=1", r"contact = 1: write it as a table, \[contact\]"),
        ("contact=false", r"contact = false: write it as a table, \[contact\]"),
        ("recording.end_s=-1", "recording.end_s = -1 s is too small"),
        ('name=""', 'name = "": give a text'),
        ("skin.configuration=L3", '"L3" is not a choice: known: L1, L2-GOH, L2-Ogden'),
        ("numerics.steps.longest_s=0", "numerics.steps.longest_s = 0 s is too small: more than 0"),
        ("numerics.steps.shortest_s=1", "numerics.steps.shortest_s = 1 s is more than longest_s"),
        ("numerics.mesh.contact_mm=2", "numerics.mesh.contact_mm = 2 mm, .*: none may be smaller"),
        ("package.crests=8", "package.crests = 8: package.length_mm is 28.0 but"),
        ("package.thread_diameter_mm=30", "package.thread_diameter_mm is 30.0, not more than"),
        ("placement.shift_x_mm=auto", "first_contact.lower_time_s"),
        ("contact.friction=1e400", "contact.friction = inf is not a finite number"),
    ],
)
def test_wrong_settings_are_refused_in_words(setting: str, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        load_scenario("A38-F", [setting])


def test_a_key_that_is_given_twice_is_refused() -> None:
    with pytest.raises(SettingError, match=r"contact\.friction is given twice, 1 and 2"):
        load_scenario("A38-F", ["contact.friction=1", "contact.friction=2"])
    with pytest.raises(SettingError, match=r"contact\.friction is given beside contact = 1"):
        load_scenario("A38-F", ["contact=1", "contact.friction=2"])


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("A38-F", ["placement.at_most_mm=5"], "placement.at_most_mm = 5.0 has no effect, as no"),
        ("A38-F", ["placement.at_most_deg=5"], "placement.at_most_deg = 5.0 has no effect, as tur"),
        ("A38-F", ["first_contact.time_sigma_s=1"], "time_sigma_s = 1.0 has no effect, as no firs"),
        ("A38-F", ["first_contact.upper_time_s=2", "first_contact.place_sigma_mm=1"],
         "place_sigma_mm = 1.0 has no effect, as no place"),
        ("DC-AE", ["muscle.traction_kpa=2", "muscle.direction_deg=50", "muscle.clearance_mm=1"],
         "muscle.clearance_mm = 1.0 has no effect, as traction_kpa and"),
        ("A38-F", ["motion.file=x.csv", "recording.start_s=1"], "start_s = 1.0 has no effect, as"),
        ("A38-F", ["head.dermis_thickness_mm=1.2",
                   *(f"head.{p}_dermis_mm=1" for p in ("nose", "philtrum", "fold", "chin")),
                   "head.submental_dermis_mm=1"], "dermis_thickness_mm = 1.2 has no effect"),
        ("A38-F", ["numerics.inertia.density_tonne_per_mm3=0", "numerics.inertia.relaxation_s=0",
                   "numerics.inertia.spectral_radius=1"], "spectral_radius = 1.0 has no effect"),
        ("A38-F", ["numerics.pull_search.most_kpa=7"], "most_kpa = 7.0 has no effect, as there is"),
        ("A38-F", ["numerics.shift_search.same=1"], "same = 1.0 has no effect, as nothing in"),
        ("A38-F", ["numerics.shift_search.instants=9"], "instants = 9 has no effect, as no"),
    ],
)  # fmt: skip
def test_a_key_without_effect_is_refused(name: str, settings: list[str], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        load_scenario(name, settings)


def test_a_key_that_a_later_layer_makes_ineffective_gives_way(tmp_path: Path) -> None:
    file = written(tmp_path, 'base = "A38-F"\n[recording]\nstart_s = 0.5\n')
    assert load_scenario(file, ["motion.file=x.csv"]).recording == load_scenario("A38-F").recording
    text = 'base = "A38-AE"\n[placement]\nshift_x_mm = "auto"\nat_most_mm = 5.0\n'
    automatic = load_scenario(written(tmp_path, text))
    assert automatic.placement.at_most_mm == 5.0
    assert automatic.with_(placement={"shift_x_mm": 1.0}).placement.at_most_mm == 10.0
    pulled = load_scenario("DC-AE", ["numerics.pull_search.most_kpa=7"])
    assert pulled.with_(muscle=None).numerics == load_scenario("DC-AE").numerics


def test_files_of_earlier_versions_are_read(tmp_path: Path) -> None:
    old = SMALL + '[solver]\nplane = "strain"\nresolution = "coarse"\nthickness_mm = 2.0\n'
    new = SMALL + '[numerics]\nplane = "strain"\nresolution = "coarse"\nthickness_mm = 2.0\n'
    read = load_scenario(written(tmp_path, old))
    assert read == load_scenario(written(tmp_path, new))
    assert read.numerics.plane == "strain" and read.numerics.mesh == LEVELS["coarse"]
    assert load_scenario("A38-F", ["solver.plane=strain"]).numerics.plane == "strain"
    both = old + '[numerics]\nplane = "stress"\n'
    with pytest.raises(SettingError, match=r"solver\.plane is the old name of numerics\.plane"):
        load_scenario(written(tmp_path, both))
    neck_drawing(tmp_path)
    unused = '[package]\nneck = "DC"\noutline = "neck.svg"\ncrests = 1\n'
    assert load_scenario(written(tmp_path, old + unused)).package.outline is not None
    with pytest.raises(SettingError, match=r"package\.crests says nothing"):
        load_scenario(written(tmp_path, old + unused.replace("= 1", "= 3")))


def test_a_scenario_needs_a_recording_or_a_motion() -> None:
    for make in (lambda: Scenario("nothing"), lambda: load_scenario("A38-F").with_(recording=None)):
        with pytest.raises(ScenarioError, match=r"neither a \[recording\] nor a \[motion\]"):
            make()


def test_a_scenario_is_made_changed_and_compared_in_memory() -> None:
    made = Scenario("mine", motion=MotionFile("/m.csv"), contact=Friction(friction=0.5))
    assert made == Scenario("mine", motion=MotionFile("/m.csv")).with_(contact={"friction": 0.5})
    assert made.with_(**{"contact.friction": 1.0}) == Scenario("mine", motion=MotionFile("/m.csv"))
    assert made.with_(contact=Friction(lip_friction=0.1)).contact == Friction(lip_friction=0.1)
    assert made.with_(contact=None).contact == Friction()
    assert made.with_(motion=Path("/n.csv")).motion == MotionFile("/n.csv")
    assert made.with_() == made and hash(made.with_()) == hash(made)
    assert load_scenario("DC-AE").with_(muscle=None).muscle is None
    for wrong, message in (
        ({"contact": {"friction": -1}}, "contact.friction = -1 is too small"),
        (
            {"contacts": {"friction": 1}},
            r"unknown key contacts: did you mean the table",
        ),
        ({"contact.fricton": 1}, "unknown key contact.fricton: did you mean contact.friction?"),
        ({"contact": Friction(friction=-1.0)}, "contact.friction = -1 is too small"),
    ):
        with pytest.raises(SettingError, match=message):
            made.with_(**wrong)
    with pytest.raises(SettingError, match=r"contact.friction = -1 is too small"):
        Scenario("mine", motion=MotionFile("/m.csv"), contact=Friction(friction=-1.0))


def test_a_recording_that_ends_before_it_starts_is_refused() -> None:
    with pytest.raises(SettingError, match=r"start_s = 3 s is not before end_s = 2 s"):
        load_scenario("A38-F", ["recording.start_s=3", "recording.end_s=2"])


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"no scenario 'A38-G': did you mean 'A38-"):
        load_scenario("A38-G")
    with pytest.raises(ScenarioError, match=r"no scenario file nowhere/mine\.toml .*check the"):
        load_scenario("nowhere/mine.toml")
    for content, reason in (
        (b"name = \n", "not valid TOML"),
        ("# \u00e4\n".encode("latin-1") + SMALL.encode(), "UTF-8"),
        (b"x = " + 100_000 * b"[", "nested more than 32 deep"),
        (b"x = " + 10_000 * b"1", "too many digits"),
        (5_000_000 * b"#", ""),
    ):
        (tmp_path / "broken.toml").write_bytes(content)
        with pytest.raises(ScenarioError, match=rf"broken\.toml.*{reason}"):
            load_scenario(tmp_path / "broken.toml")
    (tmp_path / "marked.toml").write_bytes(b"\xef\xbb\xbf" + SMALL.encode())
    assert load_scenario(tmp_path / "marked.toml").name == "mine"


@pytest.mark.parametrize(
    ("settings", "key", "works"),
    [
        (["head.upper_lip_thickness_mm=1.48"], "head.upper_lip_thickness_mm = 1.48 mm", 2.0),
        (["head.hinge_incisor_mm=50"], "head.hinge_incisor_mm = 50 mm", 74.0),
        (["head.lower_vermilion_mm=30"], "head.lower_vermilion_mm = 30 mm", None),
        (["head.nose_dermis_mm=10"], "head.nose_dermis_mm = 10 mm", None),
        (["head.jaw_opening_deg=8", "head.sulcus_below_lip_mm=40"],
         "head.sulcus_below_lip_mm = 40 mm", None),
        (["package.thread_diameter_mm=40.9"], "package.thread_diameter_mm = 40.9 mm", 39.0),
        (["package.pitch_mm=2"], "package.pitch_mm = 2 mm", None),
    ],
)  # fmt: skip
def test_measurements_that_make_no_section_are_named_with_what_would(
    settings: list[str], key: str, works: float | None
) -> None:
    scenario = load_scenario("A38-F", settings)
    part = "head" if key.startswith("head") else "package"
    with pytest.raises(SettingError) as refused:
        getattr(scenario, part).section()
    message = str(refused.value)
    assert message.startswith(f"{key} makes no ")
    remedy, value = message.rsplit("use at ", 1)[1].split(" ")[:2]
    assert remedy in ("least", "most")
    assert works is None or float(value) == works
    name = key.split(" ", maxsplit=1)[0].split(".")[1]
    getattr(scenario.with_(**{part: {name: float(value)}}), part).section()


def test_the_default_head_and_necks_are_not_to_blame() -> None:
    def never(_: object) -> None:
        raise DrinksimError("a fault of the program")

    from scenarios.settings.culprit import built

    with pytest.raises(DrinksimError, match="a fault of the program"):
        built(never, NECKS["DC"], NECKS["DC"], where="package")


def test_the_instants_of_a_muscle_must_come_in_order_and_in_fours() -> None:
    with pytest.raises(SettingError, match=r"muscle\.tense_from_s.*later than the one before"):
        load_scenario("DC-AE", ["muscle.relax_to_s=[7.3, 9.5]"])
    with pytest.raises(SettingError, match=r"hold \[1, 2, 2, 2\] times: give one in each"):
        load_scenario("DC-AE", ["muscle.tense_from_s=[0.3]"])
    with pytest.raises(SettingError, match=r"fade_mm = 9 does not fit twice"):
        load_scenario("DC-AE", ["muscle.fade_mm=9"])
    assert load_scenario("A38-F").muscle is None


def test_a_place_of_first_contact_needs_its_time() -> None:
    with pytest.raises(SettingError, match="upper_place_mm has no upper_time_s"):
        load_scenario("A38-F", ["first_contact.upper_place_mm=3"])
