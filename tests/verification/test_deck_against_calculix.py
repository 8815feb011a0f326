"""The lips' tissue, drawn out of shape, computed by CalculiX from our deck: a second opinion.

Both push the skin of both lips by up to 3 mm. In plane strain the same element (three integration
points) and lumped ties leave nothing between the programs but digits: those that CalculiX prints,
and two of its own. It takes residual forces below 1e-6 for none, whatever their unit. Its Ogden law
loses half of the digits where principal stretches are nearly equal: neo-Hookean residuals vanish
with each iteration, Ogden ones stay above 1e-7 N. So neo-Hookean tissue whose forces are large is
compared to the last digit, and Ogden tissue to `OGDEN_MM`. In plane stress CalculiX gives each node
one thickness, where ours lets each integration point relax by itself.
"""

import subprocess

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.export.deck import displaced_tissue_deck
from fem2d.loads.tie import ElasticTie
from fem2d.materials.library import configuration
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.model import Model
from geometry2d.anatomy.head import head_section
from geometry2d.mesh import LEVELS, section_mesh
from tests.support.optional import needed_program

pytestmark = pytest.mark.slow
PUSH_MM = {"upper": (-3.0, 0.9), "lower": (-1.5, -1.5)}
LIPS = tuple(PUSH_MM)
PRINTED = 6
"""Digits that CalculiX prints after the first."""
OGDEN_MM = 1e-6
"""One unit of the last digit printed of displacements above 1 mm; rounding takes half of it."""
STIFFER = 1000.0
"""Displacements under prescribed ones do not depend on it; forces do."""


@pytest.fixture(scope="module")
def calculix():
    return needed_program("ccx", package="calculix-ccx")


@pytest.fixture(scope="module")
def head():
    return head_section()


def neo_hookean(stiffer):
    """Both layers by the neo-Hookean law, as many times as stiff as the library has them."""
    return {
        name: NeoHookean(0.5 * stiffer * law.shear_modulus_mpa, poisson=0.49)
        for name, law in configuration("L2-Ogden").items()
    }


def lips(head, plane, element, layers=None, bone_mpa_per_mm=1.0):
    mesh = section_mesh([head.upper, head.lower], LEVELS["coarse"])
    layers = layers or configuration("L2-Ogden")
    materials = {f"{lip}_{part}": layers[part] for lip in LIPS for part in ("dermis", "bulk")}
    body = Body(mesh, materials, plane=plane, element=element)
    ties = tuple(
        ElasticTie(body.surface(f"{lip}_{part}"), bone_mpa_per_mm, fade_mm=fade, name=part)
        for lip in LIPS
        for part, fade in (("bone", 4.0), ("cut", 0.0))
    )
    return Model(body, ties=ties)


def pushed(head, body):
    """Displacements of the skin within 5 mm of the foremost point of each lip."""
    moved = {}
    for lip, push in PUSH_MM.items():
        nodes = body.boundary_nodes(f"{lip}_skin")
        away = np.hypot(*(body.nodes[nodes] - head.landmarks[f"{lip}_lip"]).T)
        for node, distance in zip(nodes[away < 5.0], away[away < 5.0], strict=True):
            moved[int(node)] = np.array(push) * np.cos(0.1 * np.pi * distance) ** 2
    return moved


def equilibrium(body, ties, moved, *, steps=10):
    """Newton's method in equal steps of the prescribed displacements."""
    held = np.array([2 * node + axis for node in moved for axis in (0, 1)])
    target = np.concatenate(list(moved.values()))
    free = np.setdiff1d(np.arange(2 * len(body.nodes)), held)
    u = np.zeros(2 * len(body.nodes))
    for share in np.arange(1, steps + 1) / steps:
        for _ in range(25):
            response = body.response(u.reshape(-1, 2))
            stiffness = (body.pattern.matrix(response.stiffness) + ties).tocsr()
            step = np.zeros_like(u)
            step[held] = share * target - u[held]
            residual = response.force + ties @ u + stiffness @ step
            step[free] = -spsolve(stiffness[free][:, free].tocsc(), residual[free])
            u += step
            if np.abs(step).max() < 1e-9:
                break
        else:
            raise AssertionError("no equilibrium")
    return u.reshape(-1, 2)


def of_calculix(program, folder, system, moved):
    deck = displaced_tissue_deck(system.body, system.ties, moved, title="lips pushed")
    (folder / "lips.inp").write_text(deck)
    done = subprocess.run(
        [program, "lips"], cwd=folder, capture_output=True, text=True, check=True, timeout=600
    )
    assert "Job finished" in done.stdout
    rows = [line.split() for line in (folder / "lips.dat").read_text().splitlines()]
    table = np.array(
        [[float(x) for x in row] for row in rows if len(row) == 4 and row[0].isdigit()]
    )
    table = table[-len(system.body.nodes) :]
    np.testing.assert_array_equal(table[:, 0], np.arange(1, len(table) + 1))
    return table[:, 1:3]


def relative(one, other):
    return np.sqrt(np.mean((one - other) ** 2) / np.mean(other**2))


def lumped(system):
    return sp.diags(np.maximum(system.tie_stiffness.sum(axis=1).A1, 0.0)).tocsr()


def test_neo_hookean_plane_strain_is_the_same_to_the_last_digit(calculix, head, tmp_path):
    system = lips(head, Plane.STRAIN, "T6R", neo_hookean(STIFFER), bone_mpa_per_mm=STIFFER)
    moved = pushed(head, system.body)
    theirs = of_calculix(calculix, tmp_path, system, moved)
    assert np.abs(theirs).max() > 2.9
    ours = equilibrium(system.body, lumped(system), moved)
    last_digit = 10.0 ** (np.floor(np.log10(np.abs(theirs))) - PRINTED)
    # The deck itself holds twelve digits of coordinates of some 100 mm.
    assert np.all(np.abs(ours - theirs) <= 0.5 * last_digit + 1e-9)


def test_ogden_plane_strain_is_the_same_to_rounding(calculix, head, tmp_path):
    system = lips(head, Plane.STRAIN, "T6R")
    moved = pushed(head, system.body)
    theirs = of_calculix(calculix, tmp_path, system, moved)
    ours = equilibrium(system.body, lumped(system), moved)
    assert np.abs(ours - theirs).max() < OGDEN_MM
    # What lumping the ties, and the integration rule of the replays, make of it.
    assert relative(equilibrium(system.body, system.tie_stiffness, moved), theirs) < 2e-3
    model = lips(head, Plane.STRAIN, "T6")
    assert relative(equilibrium(model.body, model.tie_stiffness, moved), theirs) < 1e-2


def test_plane_stress_differs_by_the_thickness_only(calculix, head, tmp_path):
    model = lips(head, Plane.STRESS, "T6")
    moved = pushed(head, model.body)
    theirs = of_calculix(calculix, tmp_path, model, moved)
    ours = equilibrium(model.body, model.tie_stiffness, moved)
    assert relative(ours, theirs) < 0.015
