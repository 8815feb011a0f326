"""The page of a study: its sentence is true, and what it shows is there."""

import base64
import html
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry2d.anatomy.population import sampled_people
from scenarios.campaign.engine import InProcess
from scenarios.campaign.measures import HEADLINE, described, felt_measures
from scenarios.campaign.necks import NamedNeck
from scenarios.campaign.plan import planned
from scenarios.campaign.settings import read_study
from scenarios.campaign.sip import STOPPED, WHOLE, SipRow, scenario_in
from scenarios.campaign.study import StudyOutcome, carried_out
from scenarios.decision.comparison import paired
from scenarios.decision.difference_table import runs_of_units
from scenarios.decision.messages import compared_necks, headline, pair_sentence
from scenarios.decision.notes import gathered, mesh_sentence
from scenarios.decision.page import write_page
from scenarios.decision.pair_section import SHOWN, unusual
from scenarios.results.quantities import HISTORY
from tests.support.approach import write_base
from tests.support.browser import driven, grave_faults, laid_out, opened
from tests.support.optional import needed_program

STUDY = """
base = "base.toml"
[meeting]
hand = "recorded"
[necks]
list = ["A38", "DC"]
[people]
count = 6
[vary]
"contact.friction" = [0.5, 1.0]
"""


def quiet(share, text):
    pass


def made_up(task):
    """Return numbers that follow from the neck, the friction and the length of the upper lip."""
    scenario = scenario_in(Path(task.folder), task.scenario_toml)
    narrow = scenario.package.neck == "DC"
    lip = scenario.head.measurements.upper_lip_length_mm
    value = 60 + 8 * narrow + lip + 5 * scenario.contact.friction
    measures = dict.fromkeys(SHOWN, float(value)) | {HEADLINE: float(value)}
    if narrow and scenario.contact.friction == 1.0 and lip > 24:
        return SipRow(STOPPED, "the step became <too> small", 1.0, measures)
    return SipRow(WHOLE, "", 1.0, measures)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    write_base(folder)
    (folder / "study.toml").write_text(STUDY)
    plan = planned(read_study(folder / "study.toml"), folder / "out", quiet)
    for case in plan.cases:
        (folder / "out" / "runs" / case.identity).mkdir(parents=True)
    return carried_out(plan, folder / "out", InProcess(), solver=made_up, progress=quiet)


@pytest.fixture(scope="module")
def page(result):
    return write_page(result, result.folder)


def test_the_sentence_on_top_says_what_was_found(result, page):
    said = headline(result.plan, result.rows)
    assert said.startswith("Where the film has it, A38 is gentler than DC")
    assert "8 kPa" in said
    assert "6 people" in said
    assert html.escape(said, quote=False) in page.read_text(encoding="utf-8")


def test_the_page_loads_nothing_and_links_to_every_run(result, page):
    text = page.read_text(encoding="utf-8")
    assert "default-src 'none'" in html.unescape(text)
    assert not re.search(r'(src|href)="(http|//)', text)
    for row in result.rows:
        assert f'href="{row["run"]}"' in text


def test_every_person_is_a_row_with_both_sips(result, page):
    text = page.read_text(encoding="utf-8")
    table = text[text.index("<caption>highest pressure") : text.index("</table>")]
    for person in result.plan.people:
        (row,) = re.findall(rf'<tr[^>]*><th scope="row">{person.name}</th>.*?</tr>', table)
        for neck in ("A38", "DC"):
            (place,) = re.findall(rf'href="([^"]+)" aria-label="{neck}, {person.name}"', row)
            there = next(r for r in result.rows if r["run"] == place)
            assert (there["neck"], there["person"]) == (neck, person.name)
        assert "−8.0" in row
    assert 'keep = "runs"' in html.unescape(text)


def test_an_exception_is_named_with_what_is_unusual(result):
    people = result.plan.people
    rows = [
        {"neck": neck, "person": who.name, "status": "whole", "run": "", HEADLINE: value}
        for k, who in enumerate(people)
        for neck, value in (("A38", 50.0), ("DC", 49.0 if k == 2 else 60.0 + 0.1 * k))
    ]
    pair = paired(rows, "neck", "A38", "DC", HEADLINE)
    assert pair.exceptions == (people[2].name,)
    said = unusual(people[2])
    name, most = max(people[2].deviations.items(), key=lambda item: abs(item[1]))
    assert said.startswith(
        f"{name.removesuffix('_mm').replace('_', ' ')} {most:+.1f}".replace("-", "−")
    )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ResourceWarning")  # the driver leaves its socket
def test_kept_runs_are_moved_through(result, run_directory, tmp_path):
    """With runs in two sips of one person, the page has its slider, and nothing grave is wrong."""
    chromium = needed_program("chromium", "chromium-browser", "google-chrome", package="chromium")
    folder = tmp_path / "study"
    shutil.copytree(result.folder, folder)
    (pair,) = compared_necks(result.plan, result.rows)
    places = runs_of_units(result.rows, pair)
    usual = pair.units[int(np.abs(pair.differences - pair.mean).argmin())]
    for neck in ("A38", "DC"):
        shutil.copytree(run_directory, folder / places[neck, usual] / "run")
    page = write_page(replace(result, folder=folder), folder)
    with driven(chromium) as running:
        visit = opened(running, page, height_px=800)
        tab = visit.ready()
        titles = tab.locator(".pane h3").all_inner_texts()
        assert titles[:2] == [f"A38, {usual}", f"DC, {usual}"]
        assert grave_faults(tab) == []
        assert visit.messages == []
        dark = opened(running, page, color_scheme="dark")
        assert grave_faults(dark.ready()) == []


def rough(task):
    """Return what `made_up` returns, from a mesh that is too coarse in the wider neck."""
    row = made_up(task)
    if scenario_in(Path(task.folder), task.scenario_toml).package.neck == "DC":
        return replace(row, mesh_doubt=0.02)
    pressed = row.measures[HEADLINE]
    return replace(
        row,
        mesh_doubt=0.2,
        notes=(f"two measures say {pressed:.0f} kPa; give shorter edges", "moved"),
    )


def test_what_sips_say_to_mind_is_told_once_with_how_many_say_it(result, tmp_path):
    noted = carried_out(result.plan, tmp_path, InProcess(), solver=rough, progress=quiet)
    notes = gathered(noted.rows)
    assert [note.count for note in notes] == [12, 12]
    assert notes[0].text == noted.rows[0]["notes"].split(" | ")[0]
    text = html.unescape(write_page(noted, tmp_path).read_text(encoding="utf-8"))
    for note in notes:
        assert f"12 of 24 sips, first {note.first}: {note.text}." in text
    said = mesh_sentence(noted.rows)
    assert "in 12 of 24 sips" in said
    assert "up to 20 %" in said
    assert said in text


def test_a_mesh_that_is_fine_enough_is_not_spoken_of(result, page):
    assert mesh_sentence(result.rows) is None
    assert "What to mind" not in page.read_text(encoding="utf-8")


def test_every_failure_is_told_with_its_reason(result, page):
    text = page.read_text(encoding="utf-8")
    failed = [row for row in result.rows if row["status"] == STOPPED]
    assert failed
    assert f"{len(failed)} of {len(result.rows)} sips failed" in text
    assert "the step became &lt;too&gt; small" in text


def test_the_page_holds_its_table(result, page):
    text = page.read_text(encoding="utf-8")
    (held,) = re.findall(r'href="data:text/csv;base64,([^"]+)"', text)
    assert base64.b64decode(held) == (result.folder / "results.csv").read_bytes()


def test_the_rule_of_meeting_is_told_with_what_it_does(result, page):
    text = page.read_text(encoding="utf-8")
    assert "Each person meets the neck there on his or her own lower lip" in text
    assert re.search(r"That moves it by [+−]\d\.\d to [+−]\d+\.\d mm forward and", text)


def test_every_person_is_drawn(page):
    assert "The sections of 6 people" in page.read_text(encoding="utf-8")


def test_a_sentence_of_a_difference_that_is_not_settled_says_how_many_would():
    second = np.arange(56.0, 64.0)
    first = second + np.array([-7.0, 9.0, -4.0, 8.0, -6.0, 7.0, -3.0, 6.0])
    rows = [
        {"neck": neck, "person": str(k), "status": "whole", HEADLINE: float(v)}
        for neck, values in (("A", first), ("B", second))
        for k, v in enumerate(values)
    ]
    pair = paired(rows, "neck", "A", "B", HEADLINE)
    said = pair_sentence(pair)
    assert not pair.is_settled
    assert said.startswith("8 people do not settle whether A or B presses less")
    assert f"about {pair.needed} would" in said


def test_of_several_necks_the_gentlest_is_named(result):
    necks = tuple(NamedNeck(name, {}) for name in ("A", "B", "C"))
    rows = [
        {"neck": name, "person": str(k), "status": "whole", "reason": "", "run": "", "seconds": 1.0,
         HEADLINE: base + own * (-1) ** k}
        for name, base, own in (("A", 60.0, 0.5), ("B", 50.0, 4.0), ("C", 50.2, -4.0))
        for k in range(10)
    ]  # fmt: skip
    said = headline(replace(result.plan, necks=necks), rows)
    assert "B is the gentlest of 3 necks" in said
    assert "below A on average over 10 people" in said
    assert said.endswith("it is not settled against C.")


def test_a_study_of_which_nothing_worked_says_so(result, tmp_path):
    rows = [{**row, "status": STOPPED} for row in result.rows]
    assert headline(result.plan, rows).startswith("No sip was replayed")
    page = write_page(StudyOutcome(result.plan, tuple(rows), result.folder), tmp_path)
    assert "No sip was replayed" in page.read_text(encoding="utf-8")


def test_measures_of_a_history_are_peaks_and_means_while_touched():
    time = np.array([0.0, 1.0, 2.0, 3.0])
    history = {quantity.name: np.zeros(4) for quantity in HISTORY}
    history["time_s"] = time
    history["upper_lip_contact_mm"] = np.array([0.0, 1.0, 1.0, 0.0])
    history["upper_lip_mean_kpa"] = np.array([9.0, 10.0, 30.0, 9.0])
    history["upper_lip_window_kpa"] = np.array([0.0, 40.0, 50.0, 0.0])
    history["lower_lip_window_kpa"] = np.array([0.0, 70.0, 50.0, 0.0])
    history["upper_lip_force_n"] = np.array([0.0, 0.1, 0.1, 0.0])
    found = felt_measures(history)
    assert found[HEADLINE] == 70.0
    assert found["upper_lip_window_kpa_peak"] == 50.0
    assert found["upper_lip_mean_kpa_mean"] == pytest.approx(20.0)
    assert found["lower_lip_mean_kpa_mean"] == 0.0
    assert found["upper_lip_impulse_ns"] == pytest.approx(0.2)
    assert "upper_lip_seal_margin_kpa" not in found
    history["liquid_kpa"] = np.array([0.0, 0.5, 0.5, 0.0])
    history["upper_lip_seal_kpa"] = np.array([0.0, 3.0, 2.0, 0.0])
    assert felt_measures(history)["upper_lip_seal_margin_kpa"] == 2.0
    assert all(described(name).meaning for name in found)


def test_people_of_the_page_are_the_panel(result):
    base = result.plan.films[0].scenario.head.measurements
    assert result.plan.people == sampled_people(6, base=base)


@pytest.mark.slow
@pytest.mark.parametrize("width_px", [390, 1280])
def test_the_page_fits_a_phone_and_a_desk(page, tmp_path, width_px):
    chromium = needed_program("chromium", "chromium-browser", "google-chrome", package="chromium")
    layout = laid_out(chromium, page, width_px=width_px, scratch=tmp_path)
    assert layout.width_px <= width_px
    assert layout.pictures >= 2
    assert layout.broken == 0
