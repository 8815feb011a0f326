"""The lip press in FElupe 11.3, in plane strain: run it in an environment of its own.

    python -m venv felupe-venv
    felupe-venv/bin/pip install felupe==11.3.0 tensortrax pypardiso
    OMP_NUM_THREADS=1 felupe-venv/bin/python benchmarks/lip_press_felupe.py [coarse|fine]

FElupe (GPL) is no dependency of this project and nothing here imports both. The problem is that of
lip_press.py, with FElupe's own contact with a rigid cylinder, its neo-Hookean law and its automatic
differentiation for the Ogden law.
"""

import sys
import time

import felupe as fem
import numpy as np
import tensortrax.math as tm
from pypardiso import spsolve

COLUMNS, ROWS = {"coarse": (50, 40), "fine": (200, 100)}[(sys.argv[1:] or ["coarse"])[0]]


def compressibility(shear):
    return 3 * (1 - 2 * 0.49) / (shear * (1 + 0.49))


def ogden(C, mu, alpha, D):
    """Abaqus' form: deviatoric stretches and (J − 1)²/D."""
    volume_ratio = tm.sqrt(tm.linalg.det(C))
    squares = tm.linalg.eigvalsh(C) * volume_ratio ** (-2 / 3)
    return 2 * mu / alpha**2 * (tm.sum(squares ** (alpha / 2)) - 3) + (volume_ratio - 1) ** 2 / D


mesh = fem.Rectangle(b=(20, 12), n=(COLUMNS + 1, ROWS + 1))
mesh.add_points([10.0, 16.0])
middle = mesh.points[mesh.cells].mean(axis=1)[:, 1]
field = fem.FieldContainer([fem.FieldPlaneStrain(fem.RegionQuad(mesh), dim=2)])
laws = {
    True: fem.constitution.tensortrax.Hyperelastic(
        ogden, mu=0.05, alpha=10.789, D=compressibility(0.05)
    ),
    False: fem.NeoHooke(mu=0.0083734, bulk=2 / compressibility(0.0083734)),
}
bodies = []
for upper, law in laws.items():
    part = fem.Mesh(mesh.points, mesh.cells[(middle > 10.8) == upper], mesh.cell_type)
    own = fem.FieldContainer([fem.FieldPlaneStrain(fem.RegionQuad(part), dim=2)])
    own.link(field)
    bodies.append(fem.SolidBody(law, own))
top = np.flatnonzero(np.isclose(mesh.points[:, 1], 12))
contact = fem.ContactRigidCylinder(
    field,
    points=top,
    centerpoint=-1,
    radius=4.0,
    friction=1.0,
    multiplier=10.0 * 20 / COLUMNS,
    multiplier_tangential=10.0 * 20 / COLUMNS,
)
u = field[0]
boundaries = {
    "bottom": fem.Boundary(u, fy=0),
    "across": fem.Boundary(u, fy=16.0, skip=(0, 1)),
    "down": fem.Boundary(u, fy=16.0, skip=(1, 0)),
}
iterations = []
forces = []


def note(context, state):
    iterations.append(state.result.iterations)
    forces.append(np.asarray(contact.results.force.toarray()).ravel()[-2:])


down = np.concatenate([np.linspace(0, -3, 31)[1:], np.full(40, -3.0)])
across = np.concatenate([np.zeros(30), np.linspace(0, 4, 41)[1:]])
step = fem.Step(
    items=[*bodies, contact],
    ramp={boundaries["down"]: down, boundaries["across"]: across},
    boundaries=boundaries,
)
wall, cpu = time.perf_counter(), time.process_time()
fem.Job(steps=[step], plugins=[note]).evaluate(
    x0=field, verbose=0, tol=1e-8, solver=spsolve, parallel=False
)
print(
    f"felupe {fem.__version__}: force {forces[29]} then {forces[-1]} N, "
    f"{sum(iterations)} iterations, "
    f"{time.perf_counter() - wall:.1f} s, {time.process_time() - cpu:.1f} s of processor"
)
