"""The file of a study: what it holds, what it refuses, and how it says so."""

import pytest

from geometry2d.foundation.errors import DrinksimError
from scenarios.campaign.design import design_points
from scenarios.campaign.necks import named_necks
from scenarios.campaign.settings import DesignSettings, read_study, study_from

WHOLE = """
base = "A38-F"
[necks]
list = ["A38", "DC", {name = "thin", neck = "A38", rim_radius_mm = 0.5}]
[people]
count = 24
[vary]
"contact.friction" = [0.5, 1.0]
skin.dermis_stiffness = {mean = 1.0, sd = 0.1, source = "calibration"}
[doubt]
draws = 1
[set.numerics]
resolution = "coarse"
"""


def study(tmp_path, text):
    file = tmp_path / "study.toml"
    file.write_text(text, encoding="utf-8")
    return read_study(file)


def test_a_study_is_read(tmp_path):
    found = study(tmp_path, WHOLE)
    assert (found.base, found.folder, found.name) == ("A38-F", tmp_path, "study")
    assert found.people.count == 24
    assert [each.path for each in found.vary] == ["contact.friction", "skin.dermis_stiffness"]
    assert found.vary[1].about() == "skin.dermis_stiffness 1 ± 0.1 (calibration)"
    assert found.settings == {"numerics": {"resolution": "coarse"}}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "base is missing"),
        ('base = "A38-F"\npeople = 3', "people = 3: write it as a table"),
        ('base = "A38-F"\n[peple]\ncount = 3', "unknown key peple: did you mean 'people'"),
        (
            'base = "A38-F"\n[people]\ncout = 3',
            "unknown key people.cout: did you mean people.count",
        ),
        ('base = "A38-F"\n[people]\ncount = 0', "people.count = 0 is too small: at least 1"),
        ('base = "A38-F"\n[people]\nsex = "male"', "people.count is missing"),
        ('base = "A38-F"\nkeep = "all"', 'keep = "all" is not a choice'),
        ('base = "A38-F"\n[necks]\nnames = ["A38"]', r"\[necks\] holds one key, list"),
        ('base = "A38-F"\n[necks]\nlist = []', "give a list that is not empty"),
        ('base = "A38-F"\n[vary]\n"contact.fricton" = [1.0]', "did you mean contact.friction"),
        ('base = "A38-F"\n[vary]\n"contact.friction" = 1.0', "give a list, {from"),
        ('base = "A38-F"\n[vary]\n"contact.friction" = [1.0, 1.0]', "more than once"),
        ('base = "A38-F"\n[vary]\n"contact.friction" = [9.0]', "too large: at most 3"),
        ('base = "A38-F"\n[vary]\n"contact.friction" = {from = 1.0, to = 0.5}', "not less than"),
        ('base = "A38-F"\n[vary]\n"contact.friction" = {mean = 1.0, sd = 0.0}', "more than 0"),
        ('base = "A38-F"\n[vary]\n"contact.friction" = {mean = 1.0, std = 0.1}', "unknown key std"),
        ('base = "A38-F"\n[vary]\n"contact.friction" = {mean = 1.0, to = 2.0}', "give a list"),
        ('base = "A38-F"\n[vary]\n"hand.mode" = ["same"]', r"decided by \[meeting\]"),
        (
            'base = "A38-F"\n[people]\ncount = 2\n[vary]\n"head.upper_vermilion_mm" = [8.0, 9.0]',
            r"head.upper_vermilion_mm.*\[people\] contradict",
        ),
        (
            'base = "A38-F"\n[set.contact]\nfriction = 0.5\n[vary]\n"contact.friction" = [1.0]',
            r"stands in \[vary\] and in \[set\]",
        ),
        (
            'base = "A38-F"\n[necks]\nlist = ["my.dxf"]\n[vary]\n"package.crests" = [1, 2]',
            "my.dxf, which has none",
        ),
        ('base = "A38-F"\n[design]\nkind = "sobol"', r"needs something in \[vary\]"),
        (
            'base = "A38-F"\n[design]\nkind = "sobol"\nsamples = 100\n'
            '[vary]\n"contact.friction" = {from = 0.5, to = 1.0}',
            "100 is no power of two.*use 128",
        ),
        (
            'base = "A38-F"\n[design]\nkind = "sobol"\n[vary]\n"contact.friction" = [0.5, 1.0]',
            "need a range",
        ),
    ],
)
def test_what_contradicts_itself_is_refused_by_name_and_remedy(tmp_path, text, told):
    with pytest.raises(DrinksimError, match=told) as error:
        study(tmp_path, text)
    assert str(error.value).startswith(str(tmp_path / "study.toml"))
    assert "\n" not in str(error.value)


def test_a_grid_takes_every_value_with_every_other(tmp_path):
    points = design_points(DesignSettings(), study(tmp_path, WHOLE).vary)
    assert len(points) == 2 * 3
    stiffness = sorted({point.values["skin.dermis_stiffness"] for point in points})
    assert stiffness == pytest.approx([1 - 0.128, 1.0, 1 + 0.128], abs=1e-3)


def test_samples_fill_the_ranges_evenly(tmp_path):
    vary = study(
        tmp_path, 'base = "A38-F"\n[vary]\n"contact.friction" = {from = 0.5, to = 1.5}'
    ).vary
    points = design_points(DesignSettings(kind="latin_hypercube", samples=10), vary)
    values = sorted(point.values["contact.friction"] for point in points)
    assert all(0.5 + k / 10 <= value <= 0.6 + k / 10 for k, value in enumerate(values))
    again = design_points(DesignSettings(kind="latin_hypercube", samples=10), vary)
    assert again == points


def test_necks_have_names(tmp_path):
    (tmp_path / "mine.dxf").write_text("")
    entries = ["A38", "mine.dxf", {"neck": "DC", "crests": 2}, {"name": "x", "land_mm": 2.0}]
    found = named_necks(entries, tmp_path, base="A38")
    assert [neck.name for neck in found] == ["A38", "mine", "DC crests=2", "x"]
    assert found[1].package == {"outline": str(tmp_path / "mine.dxf")}
    assert found[3].package == {"land_mm": 2.0}


@pytest.mark.parametrize(
    ("entries", "told"),
    [
        (["A39"], "no neck 'A39': did you mean 'A38'"),
        (["A38", "A38"], "two necks called 'A38'"),
        (["gone.dxf"], "no drawing .*gone.dxf"),
        ([{"name": 3}], "name = 3"),
    ],
)
def test_a_list_that_holds_no_necks_is_refused(tmp_path, entries, told):
    with pytest.raises(DrinksimError, match=told):
        named_necks(entries, tmp_path, base="A38")


def test_without_a_list_the_base_s_neck_is_meant(tmp_path):
    (neck,) = named_necks((), tmp_path, base="A38")
    assert (neck.name, neck.package) == ("A38", {})


def test_a_document_from_a_program_is_a_study(tmp_path):
    found = study_from({"base": "A38-F", "people": {"count": 2}}, folder=tmp_path, name="mine")
    assert (found.name, found.people.count, found.doubt.draws) == ("mine", 2, 0)
