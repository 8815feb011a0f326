"""From a study's file to its cases: who meets which neck where, and what a case depends on."""

from pathlib import Path

import numpy as np
import pytest

from geometry2d.curves import at_arc_lengths, nearest_arc_length
from geometry2d.drawings.neck_file import write_neck
from geometry2d.foundation.errors import DrinksimError
from geometry2d.neck import DC_NECK, neck_section
from scenarios.campaign.meeting import Meeting
from scenarios.campaign.plan import FILMED, planned
from scenarios.campaign.settings import read_study
from scenarios.campaign.sip import scenario_in
from scenarios.placing.lip_skin import LipSkin
from scenarios.placing.placement import place
from scenarios.placing.recorded_motion import recorded_motion
from scenarios.settings.scenario import load_scenario
from tests.support.approach import write_base

HEAD = 'base = "base.toml"\n[meeting]\nhand = "recorded"\n'


def quiet(share, text):
    pass


@pytest.fixture
def folder(tmp_path):
    write_base(tmp_path)
    return tmp_path


def plan(folder, text, head=HEAD):
    (folder / "study.toml").write_text(head + text)
    return planned(read_study(folder / "study.toml"), folder / "out", quiet)


def scenarios(folder, found):
    made = []
    for case in found.cases:
        run = folder / "out" / "runs" / case.identity
        run.mkdir(parents=True)
        made.append(scenario_in(run, case.scenario_toml))
    return made


def placed_in(scenario):
    neck, head = scenario.package.section(), scenario.head.section()
    return place(scenario, neck, head, recorded_motion(scenario, neck, head))


def rim_on_the_lip(scenario, time_s):
    """Return where the rim's lower edge is on the lower lip at a time: place, distance, mm."""
    placed = placed_in(scenario)
    rim = placed.motion.at(time_s).apply(scenario.package.section().rim_edge("lower"))
    skin = LipSkin.of(placed.head, "lower")
    arc = nearest_arc_length(skin.points, rim)
    return skin.place_mm(arc), float(np.hypot(*(at_arc_lengths(skin.points, arc) - rim)))


def test_every_neck_meets_every_person_and_setting(folder):
    found = plan(
        folder,
        '[necks]\nlist = ["A38", "DC"]\n[people]\ncount = 2\n'
        '[vary]\n"contact.friction" = [0.5, 1.0]',
    )
    factors = [dict(case.factors) for case in found.cases]
    assert len(factors) == 8
    assert factors[0] == {"neck": "A38", "person": "P01-female", "contact.friction": 0.5}
    assert len({case.identity for case in found.cases}) == 8
    made = scenarios(folder, found)
    assert {scenario.contact.friction for scenario in made} == {0.5, 1.0}
    assert {scenario.package.neck for scenario in made} == {"A38", "DC"}


def test_a_person_meets_the_rim_at_the_filmed_place_on_his_or_her_own_lower_lip(folder):
    found = plan(folder, "[people]\ncount = 4")
    met = Meeting.of(load_scenario(folder / "base.toml"))
    assert met.place_mm == pytest.approx(found.films[0].meeting.place_mm)
    for scenario in scenarios(folder, found):
        place, distance = rim_on_the_lip(scenario, met.time_s)
        assert place == pytest.approx(met.place_mm, abs=0.35)
        assert distance < 0.35


def test_as_filmed_the_rim_stays_in_the_head(folder):
    head = 'base = "base.toml"\n[meeting]\nhand = "recorded"\nat = "as_filmed"\n'
    found = plan(folder, "[people]\ncount = 3", head)
    made = scenarios(folder, found)
    assert {(s.placement.shift_x_mm, s.placement.shift_y_mm) for s in made} == {(0.0, 0.0)}
    met = Meeting.of(load_scenario(folder / "base.toml"))
    places = [rim_on_the_lip(scenario, met.time_s)[0] for scenario in made]
    assert np.ptp(places) > 1.0


def test_heads_that_are_held_alike_see_the_neck_from_the_same_side(folder):
    found = plan(folder, "[people]\ncount = 3")
    angles = {round(placed_in(s).head_angle_rad, 6) for s in scenarios(folder, found)}
    assert angles == {0.0}


def test_without_people_the_filmed_person_drinks(folder):
    (case,) = plan(folder, "").cases
    assert case.factors == {"neck": "A38", "person": FILMED}


def test_every_neck_meets_the_same_draws_of_the_motion(folder):
    found = plan(folder, '[necks]\nlist = ["A38", "DC"]\n[doubt]\ndraws = 2')
    motions = {}
    for case, scenario in zip(found.cases, scenarios(folder, found), strict=True):
        motions[case.factors["neck"], case.factors["draw"]] = (
            scenario.known_motion().relative_mm,
            scenario.placement.shift_x_mm,
        )
    assert np.array_equal(motions["A38", 1][0], motions["DC", 1][0])
    assert motions["A38", 1][1] == motions["DC", 1][1]
    assert not np.array_equal(motions["A38", 1][0], motions["A38", 2][0])


def test_a_placement_that_is_found_is_kept_for_every_draw(folder):
    text = (folder / "base.toml").read_text()
    (folder / "base.toml").write_text(
        text + '[placement]\nshift_x_mm = "auto"\n[first_contact]\nlower_time_s = 0.5\n'
    )
    found = plan(folder, "[doubt]\ndraws = 2\nplacement_sigma_mm = 0.0\n")
    shifts = [scenario.placement.shift_x_mm for scenario in scenarios(folder, found)]
    assert shifts == [found.films[0].meeting.shift.shift_x_mm] * 2
    assert shifts[0] != 0.0


@pytest.mark.slow
def test_a_case_is_its_content_and_not_its_names(folder):
    first = plan(folder, "")
    text = (folder / "base.toml").read_text()
    (folder / "base.toml").write_text(text.replace('name = "base"', 'name = "same sip"'))
    assert plan(folder, "").cases[0].identity == first.cases[0].identity
    (folder / "base.toml").write_text(text + "\n[contact]\nfriction = 0.9\n")
    assert plan(folder, "").cases[0].identity != first.cases[0].identity
    (folder / "base.toml").write_text(text)
    csv = (folder / "motion.csv").read_text().splitlines()
    (folder / "motion.csv").write_text("\n".join(csv[:-1]) + "\n")
    assert plan(folder, "").cases[0].identity != first.cases[0].identity


def test_equal_force_names_the_filmed_run_that_is_followed(folder):
    found = plan(folder, "[people]\ncount = 1", 'base = "base.toml"\n')
    (scenario,) = scenarios(folder, found)
    assert scenario.hand.mode == "force"
    followed = (folder / "out").resolve() / "references" / found.films[0].reference.name
    assert Path(scenario.hand.reference).resolve() == followed


def test_every_motion_meets_every_neck(folder):
    (folder / "second.csv").write_text((folder / "motion.csv").read_text())
    necks, motions = '["A38", "DC"]', '["base.toml", "second.csv"]'
    found = plan(folder, f"[necks]\nlist = {necks}\n[motions]\nlist = {motions}\n")
    assert [(c.factors["motion"], c.factors["neck"]) for c in found.cases] == [
        ("base", "A38"), ("base", "DC"), ("second", "A38"), ("second", "DC"),
    ]  # fmt: skip
    # The second motion is a copy of the first: the same sips are not computed twice.
    assert [case.identity for case in found.cases[:2]] == [c.identity for c in found.cases[2:]]


def test_a_drawing_is_kept_with_the_study(folder):
    write_neck(neck_section(DC_NECK), folder / "mine.svg")
    found = plan(folder, '[necks]\nlist = ["A38", "mine.svg"]\n')
    (folder / "mine.svg").unlink()
    _, drawn = scenarios(folder, found)
    assert found.cases[1].factors["neck"] == "mine"
    assert drawn.package.section().upper_wall.length > 0
    assert drawn.filmed is not None


def test_a_study_may_be_planned_in_a_relative_place(folder, monkeypatch):
    monkeypatch.chdir(folder)
    (folder / "study.toml").write_text('base = "base.toml"\n')
    found = planned(read_study(Path("study.toml")), Path("out"), quiet)
    again = planned(read_study(folder / "study.toml"), folder / "out", quiet)
    assert found.cases == again.cases


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[necks]\nlist = [{neck = "A38", rim_radius_mm = 0.9}]', "neck A38 rim_radius_mm=0.9"),
        (
            '[necks]\nlist = [{neck = "A38", rim_radios_mm = 0.9}]',
            "did you mean package.rim_radius",
        ),
        ('[motions]\nlist = ["gone.csv"]', "gone.csv"),
        ('[motions]\nlist = ["A38-X"]', "no scenario 'A38-X'"),
        ("[set.contact]\nfricton = 0.5", "did you mean contact.friction"),
    ],
)
def test_a_study_that_cannot_be_built_is_refused_before_anything_runs(folder, text, told):
    with pytest.raises(DrinksimError, match=told):
        plan(folder, text)
    assert not (folder / "out" / "runs").exists()


def test_people_need_a_head_of_measurements(folder):
    (folder / "head.svg").write_text("<svg/>")
    text = (folder / "base.toml").read_text()
    (folder / "base.toml").write_text(text + '\n[head]\noutline = "head.svg"\n')
    with pytest.raises(DrinksimError):
        plan(folder, "[people]\ncount = 2")
