"""The input deck read back: everything that the model has is there, in Abaqus' conventions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.laws import FrictionLaw, NormalLaw, pressure_of_gap
from fem2d.contact.rigid import RigidContact
from fem2d.contact.self_contact import SelfContact
from fem2d.export.deck import abaqus_deck
from fem2d.export.tissue_cards import DeckError
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.dead import DeadLoad
from fem2d.loads.tie import ElasticTie
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from fem2d.materials.prony import PronySeries
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.model import Model
from geometry2d.neck import neck_section
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion, RigidPlacement
from tests.support.section_bodies import distorted

SOFT = NeoHookean(0.004, poisson=0.49)
OGDEN = Ogden((0.05, 0.01), (10.789, -2.0), (0.8,))
FIBROUS = HolzapfelGasserOgden(
    0.1, 2.4, 0.13, 0.14, fibres=((1, 0, 0), (0.6, 0.8, 0)), poisson=0.49
)
NECK = neck_section()
BALL = Outline.from_corners([(-3, -3), (3, -3), (3, 3), (-3, 3)], [3.0] * 4)
MOTION = RigidMotion(
    np.linspace(0.0, 2.0, 9), np.sin(np.linspace(0, 2, 9)), np.column_stack(
        [5.0 + np.linspace(0, 2, 9) ** 2, np.cos(np.linspace(0, 2, 9))]
    )
)  # fmt: skip
RAMP_MM = 0.003
START, END = 0.3, 1.7


@dataclass(frozen=True)
class Card:
    keyword: str
    options: dict[str, str]
    rows: list[list[str]]

    def numbers(self) -> np.ndarray:
        return np.array([float(x) for row in self.rows for x in row])


def cards(deck: str) -> list[Card]:
    found: list[Card] = []
    for line in deck.splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            keyword, *options = [part.strip() for part in line[1:].split(",")]
            pairs = dict((*option.split("="), "")[:2] for option in options)
            found.append(Card(keyword, pairs, []))
        else:
            found[-1].rows.append([part.strip() for part in line.split(",")])
    return found


def named(deck: list[Card], keyword: str, **options: str) -> list[Card]:
    wanted = {name.replace("_", " "): value for name, value in options.items()}
    return [
        card for card in deck if card.keyword == keyword and wanted.items() <= card.options.items()
    ]


def system(plane: Plane = Plane.STRESS, *, left=SOFT, right=OGDEN, **tie) -> Model:
    mesh = distorted("T6", cells=3)
    body = Body(mesh, {"left": left, "right": right}, plane=plane, thickness_mm=2.0)
    top, bottom, side = (body.surface(name) for name in ("top", "bottom", "outer"))
    normal = NormalLaw(stiffness_mpa_per_mm=25.0, ramp_mm=RAMP_MM)
    return Model(
        body,
        contacts=(
            *(
                RigidContact(
                    top,
                    NECK.upper_wall,
                    normal=normal,
                    friction=FrictionLaw(1.0),
                    name="skin on upper_wall",
                ),
                RigidContact(
                    side,
                    NECK.upper_wall,
                    normal=normal,
                    friction=FrictionLaw(0.5),
                    name="side on upper_wall",
                ),
                RigidContact(
                    side,
                    BALL,
                    normal=normal,
                    friction=FrictionLaw(0.0),
                    moving=False,
                    name="side on tooth",
                ),
            ),
            *(
                SelfContact(
                    (top, side),
                    normal=normal,
                    friction=FrictionLaw(0.3),
                    reach_mm=0.2,
                    same_surface=True,
                    name="folds",
                ),
            ),
        ),
        ties=(ElasticTie(bottom, 1.5, **tie, name="bone"),),
        inertia=Inertia(1e-9, relaxation_s=0.02),
    )


def deck_of(model: Model) -> list[Card]:
    return cards(abaqus_deck(model, MOTION, start_s=START, end_s=END, title="test"))


@pytest.fixture(scope="module")
def model() -> Model:
    return system()


@pytest.fixture(scope="module")
def deck(model: Model) -> list[Card]:
    return deck_of(model)


def test_nodes_and_elements_are_those_of_the_body(model: Model, deck: list[Card]) -> None:
    (nodes,) = named(deck, "NODE", NSET="TISSUE")
    table = nodes.numbers().reshape(-1, 3)
    np.testing.assert_array_equal(table[:, 0], np.arange(1, len(model.body.nodes) + 1))
    np.testing.assert_allclose(table[:, 1:], model.body.nodes, atol=1e-10)
    elements = {e.options["ELSET"]: e for e in named(deck, "ELEMENT", TYPE="CPS6")}
    assert set(elements) == {"LEFT", "RIGHT"}
    for name, card in elements.items():
        numbers = card.numbers().astype(int).reshape(-1, 7)
        of = model.body.elements_of(name.lower())
        np.testing.assert_array_equal(np.sort(numbers[:, 0]) - 1, of)
        for number, *corners in numbers:
            points = model.body.nodes[np.array(corners) - 1]
            assert set(corners) == set(model.body.tables.connectivity[number - 1] + 1)
            a, b, c = points[:3]
            assert (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0] > 0  # counter-clockwise
            middles = 0.5 * (points[:3] + np.roll(points[:3], -1, axis=0))
            np.testing.assert_allclose(points[3:], middles, atol=1e-10)


def test_plane_strain_has_its_own_element(model: Model) -> None:
    deck = deck_of(system(Plane.STRAIN))
    assert len(named(deck, "ELEMENT", TYPE="CPE6")) == 2
    assert not named(deck, "ELEMENT", TYPE="CPS6")


def test_boundaries_are_node_sets(model: Model, deck: list[Card]) -> None:
    sets = {card.options["NSET"]: card for card in named(deck, "NSET")}
    for name in ("inner", "outer", "bottom", "top"):
        np.testing.assert_array_equal(
            sets[name.upper()].numbers().astype(int) - 1, model.body.boundary_nodes(name)
        )


def test_materials_and_sections(deck: list[Card]) -> None:
    after = {
        card.options["NAME"]: deck[k + 1 : k + 4]
        for k, card in enumerate(deck)
        if card.keyword == "MATERIAL"
    }
    for density, damping, _ in after.values():
        assert (density.keyword, density.rows) == ("DENSITY", [["1e-09"]])
        assert damping.options == {"BETA": "0.02"}
    neo_hookean, ogden = after["LEFT"][2], after["RIGHT"][2]
    assert neo_hookean.options == {"NEO HOOKE": ""}
    np.testing.assert_allclose(neo_hookean.numbers(), [SOFT.C10_mpa, SOFT.D1_per_mpa], rtol=1e-11)
    assert ogden.options == {"OGDEN": "", "N": "2"}
    np.testing.assert_allclose(ogden.numbers(), [0.05, 10.789, 0.01, -2.0, 0.8, 0.0])
    for section in named(deck, "SOLID SECTION"):
        assert section.options["MATERIAL"] == section.options["ELSET"]
        assert section.rows == [["2"]]


def test_fibres_are_local_directions() -> None:
    deck = deck_of(system(right=FIBROUS))
    (law,) = named(deck, "ANISOTROPIC HYPERELASTIC")
    assert law.options == {"HOLZAPFEL": "", "LOCAL DIRECTIONS": "2"}
    wanted = [FIBROUS.C10_mpa, FIBROUS.D_per_mpa, FIBROUS.k1_mpa, FIBROUS.k2, FIBROUS.kappa]
    np.testing.assert_allclose(law.numbers(), wanted, rtol=1e-11)
    (axes,) = named(deck, "ORIENTATION", LOCAL_DIRECTIONS="2")
    np.testing.assert_allclose([[float(x) for x in row] for row in axes.rows[2:]], FIBROUS.fibres)
    (section,) = named(deck, "SOLID SECTION", ELSET="RIGHT")
    assert section.options["ORIENTATION"] == axes.options["NAME"]


def test_springs_hold_as_much_as_the_ties(model: Model, deck: list[Card]) -> None:
    springs = {card.options["ELSET"]: card for card in named(deck, "SPRING")}
    held = {}
    for element in named(deck, "ELEMENT", TYPE="SPRING1"):
        ((number, node),) = element.rows
        (axis,), (stiffness,) = springs[element.options["ELSET"]].rows
        assert int(number) > len(model.body.tables.connectivity)
        held[int(node) - 1, int(axis) - 1] = float(stiffness)
    bottom = model.body.boundary_nodes("bottom")
    assert {node for node, _ in held} == set(bottom.tolist())
    for axis in (0, 1):
        total = sum(value for (_, a), value in held.items() if a == axis)
        assert total == pytest.approx(1.5 * 2.0 * 2.0)  # stiffness, length, thickness


def test_surfaces_are_the_faces_on_the_boundary(model: Model, deck: list[Card]) -> None:
    elements = {
        int(row[0]): [int(n) - 1 for n in row[1:]]
        for card in named(deck, "ELEMENT", TYPE="CPS6")
        for row in card.rows
    }
    for name in ("top", "outer"):
        (surface,) = named(deck, "SURFACE", NAME=f"{name.upper()}_FACES")
        assert surface.options["TYPE"] == "ELEMENT"
        nodes = []
        for element, face in surface.rows:
            side = int(face[1]) - 1
            corners = elements[int(element)]
            nodes.append((corners[side], corners[(side + 1) % 3], corners[3 + side]))
        np.testing.assert_array_equal(np.array(nodes), model.body.edges(name))


@pytest.mark.parametrize("name", ["UPPER_WALL", "TOOTH"])
def test_rigid_surfaces_are_the_outlines_with_their_outside_on_the_left(
    deck: list[Card], name: str
) -> None:
    placement = MOTION.at(START) if name == "UPPER_WALL" else RigidPlacement(0.0, (0.0, 0.0))
    original = NECK.upper_wall if name == "UPPER_WALL" else BALL
    outline = original.moved(placement.angle_rad, placement.shift_mm)
    (surface,) = named(deck, "SURFACE", NAME=name)
    assert surface.options["TYPE"] == "SEGMENTS"
    assert surface.rows[0][0] == "START"
    here = np.array([float(x) for x in surface.rows[0][1:]])
    first, length = here, 0.0
    for kind, *numbers in surface.rows[1:]:
        end, *centre = np.array([float(x) for x in numbers]).reshape(-1, 2)
        if kind == "LINE":
            points = here + np.linspace(0, 1, 9)[:, None] * (end - here)
        else:
            assert kind == "CIRCL"
            a, b = here - centre[0], end - centre[0]
            assert np.hypot(*a) == pytest.approx(np.hypot(*b), rel=1e-9)
            turn = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)  # less than half a circle
            assert 0 < abs(turn) < np.deg2rad(151)
            angle = np.arctan2(a[1], a[0]) + turn * np.linspace(0, 1, 9)
            points = centre[0] + np.hypot(*a) * np.column_stack([np.cos(angle), np.sin(angle)])
        assert np.abs(outline.project(points).distance).max() < 1e-8
        step = points[1:] - points[:-1]
        left = np.column_stack([-step[:, 1], step[:, 0]]) / np.hypot(*step.T)[:, None]
        middle = 0.5 * (points[1:] + points[:-1])
        assert np.all(np.sum(left * outline.project(middle).normal, axis=1) > 0.9)
        length += float(np.sum(np.hypot(*step.T)))
        here = end
    np.testing.assert_allclose(here, first, atol=1e-9)
    assert length == pytest.approx(outline.length, rel=2e-2)
    (body,) = named(deck, "RIGID BODY", ANALYTICAL_SURFACE=name)
    (reference,) = named(deck, "NODE", NSET=f"{name}_REF")
    assert reference.rows[0][0] == body.options["REF NODE"]
    if name == "UPPER_WALL":
        np.testing.assert_allclose(reference.numbers()[1:], placement.shift_mm)


def test_contact_pairs_have_their_friction(deck: list[Card]) -> None:
    friction = {}
    for k, card in enumerate(deck):
        if card.keyword == "SURFACE INTERACTION":
            thickness, coefficient, pressures, pair = deck[k : k + 4]
            assert pair.options["INTERACTION"] == card.options["NAME"]
            assert thickness.rows[0] == ["2"]
            assert pressures.options["PRESSURE-OVERCLOSURE"] == "TABULAR"
            table = pressures.numbers().reshape(-1, 2)
            assert table[0].tolist() == [0, 0]
            np.testing.assert_allclose(np.diff(table[-2:], axis=0)[0] @ [1, -25], 0, atol=1e-12)
            law = [pressure_of_gap(-overclosure, 25.0, RAMP_MM)[1] for _, overclosure in table]
            np.testing.assert_allclose(table[:, 0], law, rtol=1e-12)
            friction[tuple(pair.rows[0])] = float(coefficient.numbers()[0])
    assert friction == {
        ("TOP_FACES", "UPPER_WALL"): 1.0,
        ("OUTER_FACES", "UPPER_WALL"): 0.5,
        ("OUTER_FACES", "TOOTH"): 0.0,
        ("TOP_FACES", "OUTER_FACES"): 0.3,
        ("TOP_FACES", ""): 0.3,
        ("OUTER_FACES", ""): 0.3,
    }


def test_amplitudes_carry_every_point_of_the_neck_where_the_motion_does(deck: list[Card]) -> None:
    tables = {
        card.options["NAME"]: card.numbers().reshape(-1, 2) for card in named(deck, "AMPLITUDE")
    }
    u1, u2, ur3 = (tables[f"MOVE_{name}"] for name in ("U1", "U2", "UR3"))
    assert u1[0].tolist() == u2[0].tolist() == ur3[0].tolist() == [0.0, 0.0]
    assert u1[-1, 0] == pytest.approx(END - START)
    start, points = MOTION.at(START), np.array([[0.0, 0.0], [10.0, -3.0]])
    for time in np.linspace(0.0, END - START, 23):
        shift, turn = [np.interp(time, *table.T) for table in (u1, u2)], np.interp(time, *ur3.T)
        there = RigidPlacement(start.angle_rad + turn, tuple(np.add(start.shift_mm, shift)))
        wanted = MOTION.at(START + time).apply(points)
        np.testing.assert_allclose(there.apply(points), wanted, atol=2e-4)


def test_step_moves_the_neck_and_holds_the_teeth(deck: list[Card]) -> None:
    (step,), (dynamic,) = named(deck, "STEP"), named(deck, "DYNAMIC")
    assert step.options["NLGEOM"] == "YES"
    assert dynamic.options == {"APPLICATION": "QUASI-STATIC"}
    assert dynamic.numbers()[1] == pytest.approx(END - START)
    node = {
        name: named(deck, "NODE", NSET=f"{name}_REF")[0].rows[0][0]
        for name in ("UPPER_WALL", "TOOTH")
    }
    held = [card for card in named(deck, "BOUNDARY") if not card.options]
    assert [card.rows for card in held] == [[[node["TOOTH"], d, d] for d in "126"]]
    moved = {
        card.options["AMPLITUDE"]: card.rows for card in named(deck, "BOUNDARY") if card.options
    }
    wanted = zip(("MOVE_U1", "MOVE_U2", "MOVE_UR3"), "126", strict=True)
    assert moved == {name: [[node["UPPER_WALL"], d, d, "1."]] for name, d in wanted}


def test_what_a_deck_cannot_say_is_refused() -> None:
    with pytest.raises(DeckError, match="one direction only"):
        deck_of(system(only_along=(1.0, 0.0)))
    with pytest.raises(DeckError, match="moves with the package"):
        deck_of(system(attached_at=RigidPlacement(0.0, (0.0, 0.0))))
    with pytest.raises(DeckError, match="the tissue is viscous"):
        deck_of(replace(system(), prony=PronySeries((0.5,), (1.0,))))
    model = system()
    tense = np.broadcast_to([1.1, 0.0, 0.0, 1.0, 1.0], (*model.body.weights.shape, 5))
    with pytest.raises(DeckError, match="under stress as it is drawn"):
        deck_of(replace(model, body=model.body.with_prestretch(tense)))
    body = Body(distorted("Q8"), SOFT, plane=Plane.STRAIN, element="Q8")
    with pytest.raises(DeckError, match="not Q8"):
        deck_of(Model(body))
    pair = system().contacts[0]
    clash = RigidContact(
        pair.surface, BALL, normal=pair.normal, friction=pair.friction, name="again on upper_wall"
    )
    model = system()
    with pytest.raises(DeckError, match="called UPPER_WALL: rename"):
        deck_of(Model(model.body, contacts=(*model.contacts, clash)))


def test_a_dead_load_is_nodal_forces_with_its_smooth_step(model):
    top = model.contacts[0].surface
    amplitude = Amplitude((START + 0.1, START + 0.2), (0.0, 1.0))
    load = DeadLoad(
        top,
        from_mm=1.2,
        to_mm=1.8,
        fade_mm=0.2,
        traction_mpa=(2e-3, -1e-3),
        amplitude=amplitude,
        name="pull",
    )
    deck = deck_of(replace(model, loads=(load,)))
    (steps,) = named(deck, "AMPLITUDE", NAME="PULL_1", DEFINITION="SMOOTH STEP")
    assert np.array(steps.rows, float) == pytest.approx(np.array([[0.1, 0.0], [0.2, 1.0]]))
    (forces,) = named(deck, "CLOAD", AMPLITUDE="PULL_1")
    total = np.zeros(2)
    for _, axis, force in np.array(forces.rows, float):
        total[int(axis) - 1] += force
    assert total == pytest.approx(load.full_force.reshape(-1, 2).sum(axis=0))
    assert abs(total).min() > 1e-4
    assert not named(deck_of(model), "CLOAD")
