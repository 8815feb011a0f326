import dataclasses
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
import shapely
import skfem
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.anatomy.head import HeadMeasurements, head_section
from geometry2d.curves import arc_lengths, nearest_arc_length
from geometry2d.mesh import LEVELS, MeshSize, block_mesh, polygon_mesh, section_mesh
from geometry2d.mesh_quality import mesh_quality
from geometry2d.meshing import MeshError

EXPECTED_TRIANGLES = {"coarse": 1450, "standard": 2900, "fine": 5900, "thesis": 10100}


@cache
def head():
    return head_section()


@cache
def lips(level):
    return section_mesh([head().upper, head().lower], LEVELS[level])


def triangle_areas(mesh):
    a, b, c = mesh.p.T[mesh.t]
    return 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


@pytest.mark.slow
@pytest.mark.parametrize("level", LEVELS)
def test_head_meshes_are_as_good_and_as_large_as_promised(level):
    mesh = lips(level)
    quality = mesh_quality(mesh)
    assert quality.smallest_angle_deg >= 22.0
    assert quality.largest_angle_deg <= 120.0
    assert mesh.t.shape[1] == pytest.approx(EXPECTED_TRIANGLES[level], rel=0.15)


def test_dermis_has_more_layers_near_contact_the_finer_the_level():
    for level, layers in (("coarse", 1.5), ("standard", 2.5), ("fine", 3.5), ("thesis", 5.0)):
        mesh = lips(level)
        facets = mesh.boundaries["upper_skin"]
        points = mesh.p.T[mesh.facets[:, facets]]
        margin = head().landmarks["stomion_upper"]
        near = np.hypot(*(points.mean(axis=0) - margin).T) < 8.0
        length = np.hypot(*(points[1] - points[0]).T)[near]
        row_height = np.sqrt(3) / 2 * length.mean()
        assert 1.0 / row_height > layers, level


@pytest.mark.parametrize("level", ["coarse", "fine"])
def test_subdomains_fill_the_regions_they_are_named_after(level):
    mesh = lips(level)
    areas = triangle_areas(mesh)
    names = []
    for lip in (head().upper, head().lower):
        for region, polygon in lip.regions.items():
            name = f"{lip.name}_{region}"
            names.append(name)
            assert areas[mesh.subdomains[name]].sum() == pytest.approx(
                shapely.Polygon(polygon).area, rel=0.02 if level == "coarse" else 0.004
            )
    together = np.sort(np.concatenate([mesh.subdomains[name] for name in names]))
    assert np.array_equal(together, np.arange(mesh.t.shape[1]))


def test_boundaries_follow_their_curves_without_gap_or_overlap():
    mesh = lips("standard")
    outer = {"skin", "inner", "bone", "cut"}
    found = []
    for lip in (head().upper, head().lower):
        for boundary, curves in lip.boundaries.items():
            facets = mesh.boundaries[f"{lip.name}_{boundary}"]
            found.append(facets)
            points = mesh.p.T[np.unique(mesh.facets[:, facets])]
            line = shapely.MultiLineString([c.tolist() for c in curves])
            assert shapely.distance(shapely.points(points), line).max() < 1e-9
            length = np.hypot(*np.diff(mesh.p.T[mesh.facets[:, facets]], axis=0)[0].T).sum()
            assert length == pytest.approx(line.length, rel=0.005)
            assert boundary in outer
    together = np.sort(np.concatenate(found))
    assert np.array_equal(together, mesh.boundary_facets())


def test_dermis_and_bulk_share_the_nodes_of_their_interface():
    mesh = lips("standard")
    for lip in ("upper", "lower"):
        dermis, bulk = (
            set(mesh.t[:, mesh.subdomains[f"{lip}_{r}"]].ravel()) for r in ("dermis", "bulk")
        )
        interface = np.unique(mesh.facets[:, mesh.boundaries[f"{lip}_interface"]])
        assert set(interface) <= dermis & bulk


def test_lips_are_two_bodies_in_one_mesh():
    mesh = lips("coarse")
    upper = np.concatenate([mesh.subdomains[f"upper_{r}"] for r in ("dermis", "bulk")])
    lower = np.concatenate([mesh.subdomains[f"lower_{r}"] for r in ("dermis", "bulk")])
    assert not set(mesh.t[:, upper].ravel()) & set(mesh.t[:, lower].ravel())


@pytest.mark.parametrize(("lip", "reach_mm"), [("upper", 20.0), ("lower", 9.0)])
def test_edges_are_as_long_as_the_size_field_asks_near_contact(lip, reach_mm):
    mesh = lips("fine")
    size = LEVELS["fine"]
    facets = mesh.boundaries[f"{lip}_skin"]
    points = mesh.p.T[mesh.facets[:, facets]]
    margin = head().landmarks[f"stomion_{lip}"]
    skin = getattr(head(), lip).curves["skin"]
    at = nearest_arc_length(skin, margin)
    along = np.array([nearest_arc_length(skin, p) for p in points.mean(axis=0)])
    near = np.abs(along - at) < reach_mm
    length = np.hypot(*(points[1] - points[0]).T)
    np.testing.assert_allclose(length[near], size.contact_mm, rtol=0.06)
    assert length.max() <= size.layer_mm * 1.06
    assert arc_lengths(skin)[-1] > at


@pytest.mark.slow
def test_same_input_gives_the_same_bits_in_another_process():
    code = (
        "import hashlib; from geometry2d.anatomy.head import head_section;"
        "from geometry2d.mesh import LEVELS, section_mesh; h = head_section();"
        "m = section_mesh([h.upper, h.lower], LEVELS['coarse']);"
        "print(hashlib.sha256(m.p.tobytes() + m.t.tobytes()).hexdigest())"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", code], check=True, capture_output=True, text=True
        ).stdout
        for _ in range(2)
    }
    assert len(digests) == 1


@pytest.mark.slow
@given(
    lip=st.floats(-1.3, 1.3), thick=st.floats(-1.3, 1.3), dermis=st.floats(0.8, 1.5),
    projection=st.floats(-1.3, 1.3),
)  # fmt: skip
@settings(max_examples=8, deadline=None)
def test_other_heads_mesh_as_well(lip, thick, dermis, projection):
    mean = HeadMeasurements()
    other = head_section(
        dataclasses.replace(
            mean,
            upper_lip_length_mm=mean.upper_lip_length_mm + 2.5 * lip,
            lower_lip_thickness_mm=mean.lower_lip_thickness_mm + 1.2 * thick,
            upper_lip_projection_mm=mean.upper_lip_projection_mm + 1.7 * projection,
            dermis_thickness_mm=dermis,
        )
    )
    mesh = section_mesh([other.upper, other.lower], LEVELS["coarse"])
    assert mesh_quality(mesh).smallest_angle_deg > 17.0


def test_quality_of_known_triangles():
    right = skfem.MeshTri(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([[0], [1], [2]]))
    quality = mesh_quality(right)
    assert quality.smallest_angle_deg == pytest.approx(45.0)
    assert quality.largest_angle_deg == pytest.approx(90.0)
    assert quality.worst_radius_ratio == pytest.approx(2 * (np.sqrt(2) - 1))
    assert quality.worst_aspect == pytest.approx(np.sqrt(2))


def test_polygons_that_share_a_side_share_its_nodes():
    mesh = polygon_mesh(
        {
            "bulk": [(0, 0), (10, 0), (10, 4), (0, 4)],
            "dermis": [(0, 4), (10, 4), (10, 5), (0, 5)],
        },
        lambda points: 0.3 + 0.2 * np.abs(points[:, 1] - 5.0),
        boundaries={"top": lambda p: p[:, 1] > 5 - 1e-9, "bottom": lambda p: p[:, 1] < 1e-9},
    )
    areas = triangle_areas(mesh)
    assert areas[mesh.subdomains["dermis"]].sum() == pytest.approx(10.0)
    assert areas[mesh.subdomains["bulk"]].sum() == pytest.approx(40.0)
    shared = set(mesh.t[:, mesh.subdomains["dermis"]].ravel()) & set(
        mesh.t[:, mesh.subdomains["bulk"]].ravel()
    )
    np.testing.assert_allclose(mesh.p[1, sorted(shared)], 4.0)
    assert len(shared) > 20
    assert len(mesh.boundaries["top"]) == pytest.approx(10 / 0.3, abs=1)
    assert mesh_quality(mesh).smallest_angle_deg > 25.0


def test_circle_is_meshed_evenly():
    angle = 2 * np.pi * np.arange(40) / 40
    mesh = polygon_mesh({"disc": np.column_stack([np.cos(angle), np.sin(angle)])}, 0.16)
    assert triangle_areas(mesh).sum() == pytest.approx(np.pi, rel=0.01)
    assert mesh_quality(mesh).smallest_angle_deg > 30.0


@given(
    nx=st.integers(1, 12), ny=st.integers(3, 12), skin=st.floats(0.05, 0.3), fat=st.floats(0.1, 0.4)
)
def test_block_is_filled_by_its_layers(nx, ny, skin, fat):
    mesh = block_mesh(8.0, 5.0, nx, ny, layers={"dermis": skin, "fat": fat})

    assert mesh.t.shape[1] == nx * ny
    lower, upper = mesh.p[1, mesh.t].min(axis=0), mesh.p[1, mesh.t].max(axis=0)
    for name, bottom, top in (
        ("dermis", 1 - skin, 1.0),
        ("fat", 1 - skin - fat, 1 - skin),
        ("bulk", 0.0, 1 - skin - fat),
    ):
        elements = mesh.subdomains[name]
        assert lower[elements].min() == pytest.approx(5.0 * bottom, abs=1e-9)
        assert upper[elements].max() == pytest.approx(5.0 * top)
    assert {n: len(f) for n, f in mesh.boundaries.items()} == {
        "left": ny, "right": ny, "bottom": nx, "top": nx,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: MeshSize(0.5, 0.4, 2.0), "none may be smaller"),
        (lambda: MeshSize(0.5, 0.6, 2.0, 0.0), "gradation"),
        (lambda: polygon_mesh({"a": [(0, 0), (1, 1), (1, 0), (0, 1)]}, 0.2), "'a' crosses itself"),
        (lambda: polygon_mesh({"a": [(0, 0), (1, 0), (1, 1)]}, -1.0), "-1.0 mm"),
        (lambda: section_mesh([head().upper, head().upper], LEVELS["coarse"]), "different names"),
        (lambda: block_mesh(1.0, 1.0, 2, 1, layers={"dermis": 0.2}), "2 by 1 elements"),
        (lambda: block_mesh(1.0, 1.0, 2, 4, layers={"dermis": 1.2}), "leave something"),
    ],
)
def test_impossible_meshes_are_refused(make, named):
    with pytest.raises(MeshError, match=named):
        make()


def test_ctrl_c_is_an_exception_after_meshing():
    script = """
import signal
from geometry2d.mesh import polygon_mesh
both = (signal.SIGINT, signal.SIGTERM)
handlers = [signal.getsignal(number) for number in both]
polygon_mesh({"square": [(0, 0), (1, 0), (1, 1), (0, 1)]}, 0.3)
assert [signal.getsignal(number) for number in both] == handlers
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    print("interrupted")
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.stdout == "interrupted\n", (done.returncode, done.stderr)
