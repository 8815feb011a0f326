"""A body's force and stiffness are derivatives of its energy, in every element and assumption."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fem2d.body.body import Body
from fem2d.body.definition import BodyError
from fem2d.body.elements import ElementError
from fem2d.body.kinematics import Plane
from fem2d.materials.material import Material
from tests.support.section_bodies import CASES, FIBROUS, SOFT, STIFF, body, displacement, distorted

LABELS = [f"{plane.name.lower()}-{element}" for plane, element in CASES]


@pytest.mark.parametrize("laws", [(SOFT, STIFF), (FIBROUS, SOFT)], ids=["powers", "fibres"])
@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_force_and_stiffness_are_derivatives(
    plane: Plane, element: str, laws: tuple[Material, Material]
) -> None:
    it = body(plane, element, left=laws[0], right=laws[1], cells=1)
    u = displacement(it)
    response = it.response(u)
    assert np.isfinite(response.energy)
    stiffness = it.pattern.matrix(response.stiffness).toarray()
    step = 1e-6
    size = np.linalg.norm(response.force)
    slopes = []
    for direction in np.random.default_rng(5).standard_normal((4, *u.shape)):
        plus, minus = it.response(u + step * direction), it.response(u - step * direction)
        d = direction.ravel()
        slope = (plus.energy - minus.energy) / (2 * step)
        slopes.append(slope)
        assert slope == pytest.approx(response.force @ d, rel=1e-6, abs=1e-8 * size)
        bend = (plus.force - minus.force) / (2 * step)
        np.testing.assert_allclose(stiffness @ d, bend, atol=1e-6 * np.abs(bend).max())
    assert np.max(np.abs(slopes)) > 0.1 * size
    np.testing.assert_array_equal(stiffness, stiffness.T)


@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_asking_for_less_changes_nothing(plane: Plane, element: str) -> None:
    it = body(plane, element)
    u = displacement(it)
    full, half, wild = it.response(u), it.energy_and_force(u), it.response(50 * u)
    assert not np.isfinite(wild.energy)
    assert np.isfinite(wild.force).all() and np.isfinite(wild.stiffness).all()
    again = it.response(u)
    assert full.energy == half.energy == again.energy
    np.testing.assert_array_equal(full.force, half.force)
    np.testing.assert_array_equal(full.force, again.force)
    np.testing.assert_array_equal(full.stiffness, again.stiffness)
    assert half.stiffness.size == 0


@pytest.mark.parametrize("laws", [(SOFT, STIFF), (FIBROUS, SOFT)], ids=["powers", "fibres"])
@pytest.mark.parametrize("plane", list(Plane))
@pytest.mark.parametrize("element", ["T6", "T6M", "Q4M"])
def test_projection_clamps_and_leaves_stable_states_alone(
    plane: Plane, element: str, laws: tuple[Material, Material]
) -> None:
    if plane is Plane.STRESS and element.endswith("M"):
        pytest.skip("mean dilatation means nothing in plane stress")
    it = body(plane, element, left=laws[0], right=laws[1], cells=1)
    u = it.nodes * [-0.2, -0.35] + 0.2 * displacement(it)
    plain, clamped = it.response(u), it.response(u, psd=True)
    lowest = np.linalg.eigvalsh(it.pattern.matrix(plain.stiffness).toarray())[0]
    largest = np.abs(plain.stiffness).max()
    assert lowest < -1e-6 * largest
    matrix = it.pattern.matrix(clamped.stiffness).toarray()
    assert np.linalg.eigvalsh(matrix)[0] > -1e-12 * largest
    np.testing.assert_array_equal(plain.force, clamped.force)
    at_rest = np.zeros_like(u)
    if laws[0] is SOFT:
        np.testing.assert_allclose(
            it.response(at_rest).stiffness,
            it.response(at_rest, psd=True).stiffness,
            atol=1e-12 * largest,
        )


@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_rigid_motion_gives_no_force(plane: Plane, element: str) -> None:
    it = body(plane, element)
    if plane is Plane.AXISYMMETRIC:
        u = np.tile([0.0, 3.7], (len(it.nodes), 1))
    else:
        angle = 2.1
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        u = it.nodes @ turn.T + [3.0, -5.0] - it.nodes
    response = it.response(u)
    stiffness = np.abs(it.response(0 * u).stiffness).max()
    assert np.abs(response.force).max() < 1e-13 * stiffness * np.abs(u).max()
    assert abs(response.energy) < 1e-14 * stiffness


@pytest.mark.parametrize("plane", [Plane.STRESS, Plane.STRAIN])
def test_turning_the_deformed_body_turns_its_forces(plane: Plane) -> None:
    it = body(plane, "T6")
    u = displacement(it)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    turned = (it.nodes + u) @ turn.T - it.nodes
    before, after = it.response(u), it.response(turned)
    assert after.energy == pytest.approx(before.energy, rel=1e-12)
    expected = before.force.reshape(-1, 2) @ turn.T
    np.testing.assert_allclose(
        after.force.reshape(-1, 2), expected, atol=1e-12 * np.abs(expected).max()
    )


@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_fields_agree_with_energy_and_with_the_plane(plane: Plane, element: str) -> None:
    it = body(plane, element)
    u = displacement(it)
    fields = it.fields(u)
    assert np.sum(fields.energy_density * fields.volume) == pytest.approx(
        it.response(u).energy, rel=1e-12
    )
    assert np.all(np.diff(fields.log_strain, axis=-1) >= 0)
    J = np.linalg.det(fields.deformation_gradient)
    np.testing.assert_allclose(fields.log_strain.sum(axis=-1), np.log(J), atol=1e-12)
    np.testing.assert_allclose(
        fields.cauchy, np.swapaxes(fields.cauchy, -1, -2), atol=1e-12 * np.abs(fields.cauchy).max()
    )
    if plane is Plane.STRESS:
        assert np.abs(fields.cauchy[..., 2, 2]).max() < 1e-12 * np.abs(fields.cauchy).max()
    if plane is Plane.STRAIN:
        assert np.all(fields.thickness_stretch == 1)
    assert np.all(fields.von_mises >= 0)


def test_von_mises_of_a_plain_pull_is_the_pull() -> None:
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    it = Body(mesh, STIFF, plane=Plane.STRESS)
    side = 1 / np.sqrt(1.2) - 1
    fields = it.fields(it.nodes * [0.2, side])
    stress = fields.cauchy[..., 0, 0] - fields.cauchy[..., 1, 1]
    np.testing.assert_allclose(fields.von_mises, np.abs(stress), rtol=0.02)


def test_thickness_scales_everything_and_axisymmetry_integrates_a_turn() -> None:
    mesh = distorted("T6")
    thin, thick = (
        Body(mesh, SOFT, plane=Plane.STRAIN, thickness_mm=t).response(np.zeros((45, 2)) + 0.0)
        for t in (1.0, 2.5)
    )
    np.testing.assert_allclose(thick.stiffness, 2.5 * thin.stiffness, atol=1e-14)
    ring = Body(mesh, SOFT, plane=Plane.AXISYMMETRIC)
    assert ring.weights.sum() == pytest.approx(np.pi * (3**2 - 1**2) * 1.5, rel=1e-12)


@pytest.mark.parametrize("element", ["T3", "T6", "Q4", "Q8"])
def test_masses(element: str) -> None:
    it = body(Plane.STRAIN, element)
    density = 1.1e-9
    consistent = it.pattern.matrix(it.mass(density))
    total = density * 3.0
    lumped = it.lumped_mass(density)
    assert lumped[::2].sum() == pytest.approx(total, rel=1e-12) and lumped.min() > 0
    x, y = it.nodes.T
    sideways = np.stack([np.ones_like(x), 0 * y], axis=1).ravel()
    assert sideways @ consistent @ sideways == pytest.approx(total, rel=1e-12)
    turning = np.stack([-y, x], axis=1).ravel()
    moment = density * (1.5 * (3**3 - 1) / 3 + 2 * 1.5**3 / 3)
    assert turning @ consistent @ turning == pytest.approx(moment, rel=1e-10)


def test_edges_follow_one_another_with_the_body_on_their_left() -> None:
    mesh = distorted("T6").with_boundaries({"around": lambda x: np.ones_like(x[0], bool)})
    it = Body(mesh, SOFT, plane=Plane.STRAIN)
    edges = it.edges("around")
    assert edges.shape == (12, 3)
    np.testing.assert_array_equal(edges[1:, 0], edges[:-1, 1])
    assert edges[0, 0] == edges[-1, 1]
    start, end, middle = it.nodes[edges[:, 0]], it.nodes[edges[:, 1]], it.nodes[edges[:, 2]]
    np.testing.assert_allclose(middle, (start + end) / 2)
    assert np.sum(start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]) / 2 == pytest.approx(3.0)
    np.testing.assert_array_equal(
        it.boundary_nodes("inner"), np.flatnonzero(it.nodes[:, 0] < 1 + 1e-9)
    )
    assert it.edges("top")[0, 0] == np.argmin(np.abs(it.nodes - [3.0, 1.5]).sum(axis=1))


def test_the_pattern_finds_every_block_and_refuses_strangers() -> None:
    it = body(Plane.STRAIN, "T6")
    nodes = it.tables.connectivity[3]
    dofs = np.stack([2 * nodes, 2 * nodes + 1], axis=1).ravel()[[0, 3, 4, 7, 11]]
    slots = it.pattern.slots(dofs[None])[0]
    matrix = it.pattern.matrix(np.arange(it.pattern.nonzeros, dtype=float))
    np.testing.assert_array_equal(matrix[dofs][:, dofs].toarray(), slots)
    far = np.argmax(it.nodes[:, 0]), np.argmin(it.nodes[:, 0])
    with pytest.raises(ValueError, match="share no element"):
        it.pattern.slots([[2 * far[0], 2 * far[1]]])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"materials": {"left": SOFT}}, ("elements have no material", "right")),
        ({"materials": {"left": SOFT, "rihgt": SOFT}}, ("rihgt", "did you mean 'right'")),
        ({"element": "Q4"}, ("Q4", "quadrilaterals")),
        ({"element": "T7"}, ("T7", "T6")),
        ({"thickness_mm": 0.0}, ("thickness_mm", "0", "1.0")),
        ({"element": "T6M", "plane": Plane.STRESS}, ("T6M", "plane stress", "T6")),
    ],
)
def test_nonsense_is_refused(arguments: dict[str, object], words: tuple[str, ...]) -> None:
    chosen = {"materials": SOFT, "plane": Plane.STRAIN, "element": "T6"} | arguments
    with pytest.raises((BodyError, ElementError)) as error:
        Body(distorted("T6"), chosen.pop("materials"), **chosen)  # type: ignore[arg-type]
    for word in words:
        assert word in str(error.value)


def test_wrong_displacements_and_names_are_refused() -> None:
    it = body(Plane.STRAIN, "T6")
    with pytest.raises(BodyError, match="mid-side nodes"):
        it.response(np.zeros((3, 2)))
    with pytest.raises(BodyError, match="did you mean 'outer'"):
        it.edges("outre")
    with pytest.raises(BodyError, match="did you mean 'left'"):
        it.elements_of("lefft")
    with pytest.raises(BodyError, match="cannot be negative"):
        Body(distorted("T6").translated((-2.0, 0.0)), SOFT, plane=Plane.AXISYMMETRIC)
