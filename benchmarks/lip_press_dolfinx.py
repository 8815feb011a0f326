"""The lip press in DOLFINx 0.5, in plane strain: run it with the system's Python.

    apt-get install python3-dolfinx-real
    OMP_NUM_THREADS=1 /usr/bin/python3 benchmarks/lip_press_dolfinx.py [coarse|fine]

DOLFINx (LGPL) is no dependency of this project and nothing here imports both. The problem is that
of lip_press.py. DOLFINx has no contact with friction: penalty and return mapping are written into
the weak form, with the same law, sampled at the nodes; forms are compiled, MUMPS factorises. A step
starts from the last shape moved along with the circle in proportion to height, without which
Newton's method gets nowhere in the drag; a step that fails is halved.
"""

import sys
import time

import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

COLUMNS, ROWS = {"coarse": (50, 40), "fine": (200, 100)}[(sys.argv[1:] or ["coarse"])[0]]
PENALTY, STICKING, FRICTION, RADIUS = 10.0, 10.0, 1.0, 4.0
TOLERANCE, ITERATIONS = 1e-8, 25

block = mesh.create_rectangle(
    MPI.COMM_SELF, [[0.0, 0.0], [20.0, 12.0]], [COLUMNS, ROWS], mesh.CellType.quadrilateral
)
space = fem.VectorFunctionSpace(block, ("CG", 1))
scalars = fem.FunctionSpace(block, ("CG", 1))
u, before = fem.Function(space), fem.Function(space)
shear_before = fem.Function(scalars)
centre = fem.Constant(block, np.array([10.0, 16.0]))
centre_before = fem.Constant(block, np.array([10.0, 16.0]))

cells = np.arange(COLUMNS * ROWS, dtype=np.int32)
upper = mesh.locate_entities(block, 2, lambda x: x[1] > 12 - 1.2 - 1e-9)
layers = np.zeros(len(cells), np.int32)
layers[upper] = 1
dx = ufl.Measure(
    "dx",
    domain=block,
    subdomain_data=mesh.meshtags(block, 2, cells, layers),
    metadata={"quadrature_degree": 3},
)
top = mesh.locate_entities_boundary(block, 1, lambda x: np.isclose(x[1], 12))
ds = ufl.Measure(
    "ds",
    domain=block,
    subdomain_data=mesh.meshtags(block, 1, np.sort(top), np.ones(len(top), np.int32)),
    metadata={"quadrature_rule": "gll", "quadrature_degree": 1},  # the two ends
)


def compressibility(shear):
    return 3 * (1 - 2 * 0.49) / (shear * (1 + 0.49))


def bulk_energy(C, J):
    shear = 0.0083734
    return 0.5 * shear * (J ** (-2 / 3) * (ufl.tr(C) + 1) - 3) + (J - 1) ** 2 / compressibility(
        shear
    )


def dermis_energy(C, J):
    shear, alpha = 0.05, 10.789
    half = 0.5 * ufl.tr(C)
    apart = ufl.sqrt(0.25 * (C[0, 0] - C[1, 1]) ** 2 + C[0, 1] ** 2 + 1e-14)
    powers = (half + apart) ** (alpha / 2) + (half - apart) ** (alpha / 2) + 1
    return 2 * shear / alpha**2 * (J ** (-alpha / 3) * powers - 3) + (J - 1) ** 2 / compressibility(
        shear
    )


F = ufl.Identity(2) + ufl.grad(u)
C, J = F.T * F, ufl.det(F)
energy = bulk_energy(C, J) * dx(0) + dermis_energy(C, J) * dx(1)
position = ufl.SpatialCoordinate(block) + u
away = position - centre
distance = ufl.sqrt(ufl.dot(away, away))
normal = away / distance
tangent = ufl.as_vector([-normal[1], normal[0]])
depth = RADIUS - distance
pressure = ufl.conditional(ufl.gt(depth, 0), PENALTY * depth, 0)
travel = away - (ufl.SpatialCoordinate(block) + before - centre_before)
trial = shear_before - STICKING * ufl.dot(tangent, travel)
bound = FRICTION * pressure
shear = ufl.max_value(-bound, ufl.min_value(bound, trial))
contact = pressure * normal + shear * tangent
v = ufl.TestFunction(space)
residual = ufl.derivative(energy, u, v) - ufl.dot(contact, v) * ds(1)
tangent_form = fem.form(ufl.derivative(residual, u, ufl.TrialFunction(space)))
residual_form = fem.form(residual)
push = [fem.form(contact[i] * ds(1)) for i in range(2)]
bottom = fem.locate_dofs_geometrical(space, lambda x: np.isclose(x[1], 0))
held = fem.dirichletbc(np.zeros(2), bottom, space)

matrix, vector = petsc.create_matrix(tangent_form), petsc.create_vector(residual_form)
solver = PETSc.KSP().create(MPI.COMM_SELF)
solver.setOperators(matrix)
solver.setType("preonly")
solver.getPC().setType("lu")
solver.getPC().setFactorSolverType("mumps")
height = space.tabulate_dof_coordinates()[:, 1] / 12
surface = fem.locate_dofs_geometrical(scalars, lambda x: np.isclose(x[1], 12))
places = scalars.tabulate_dof_coordinates()[surface, :2]
free = np.setdiff1d(
    np.arange(len(u.x.array)), (2 * np.asarray(bottom)[:, None] + np.arange(2)).ravel()
)


def unbalanced():
    """Return the largest unbalanced force and the largest force that acts."""
    with vector.localForm() as local:
        local.set(0)
    petsc.assemble_vector(vector, residual_form)
    forces = vector.array
    return np.abs(forces[free]).max(), np.abs(forces).max()


def newton():
    """Return the iterations used, None if the forces did not balance."""
    norm, scale = unbalanced()
    for iteration in range(1, ITERATIONS + 1):
        petsc.set_bc(vector, [held], u.vector, -1.0)
        matrix.zeroEntries()
        petsc.assemble_matrix(matrix, tangent_form, bcs=[held])
        matrix.assemble()
        step = vector.duplicate()
        solver.solve(vector, step)
        start, share = u.x.array.copy(), 1.0
        for _ in range(8):
            u.x.array[:] = start - share * step.array
            there, scale = unbalanced()
            if np.isfinite(there) and (there < norm or iteration < 3):
                break
            share *= 0.5
        else:
            return None
        norm = there
        if norm <= TOLERANCE * max(scale, 1e-6):
            return iteration
    return None


def commit():
    """Take over the friction of this step, by the same law as in the weak form."""
    x = places + u.x.array.reshape(-1, 2)[surface]
    old = places + before.x.array.reshape(-1, 2)[surface] - centre_before.value
    out = x - centre.value
    far = np.linalg.norm(out, axis=1)
    n = out / far[:, None]
    p = PENALTY * np.maximum(RADIUS - far, 0)
    slip = -n[:, 1] * (out - old)[:, 0] + n[:, 0] * (out - old)[:, 1]
    shear_before.x.array[surface] = np.clip(
        shear_before.x.array[surface] - STICKING * slip, -FRICTION * p, FRICTION * p
    )
    before.x.array[:] = u.x.array


def move(target):
    """Bring the circle to its next place, in halves where that fails; return iterations, cuts."""
    iterations = cuts = 0
    share = 1.0
    start = centre_before.value.copy()
    done = 0.0
    while done < 1 - 1e-12:
        share = min(share, 1 - done)
        centre.value[:] = start + (done + share) * (target - start)
        shift = centre.value - centre_before.value
        u.x.array[:] = before.x.array
        u.x.array.reshape(-1, 2)[:] += height[:, None] * shift
        used = newton()
        iterations += used or ITERATIONS
        if used is None:
            cuts += 1
            share *= 0.5
            if share < 1e-3:
                raise RuntimeError(f"stopped at centre {centre_before.value}")
            continue
        commit()
        centre_before.value[:] = centre.value
        done += share
    return iterations, cuts


def run():
    for function in (u, before, shear_before):
        function.x.array[:] = 0
    centre.value[:] = centre_before.value[:] = (10.0, 16.0)
    wall, processor = time.perf_counter(), time.process_time()
    path = [(10.0, 16 - 3 * k / 30) for k in range(1, 31)]
    path += [(10 + 4 * k / 40, 13.0) for k in range(1, 41)]
    costs, forces = [], []
    for target in path:
        costs.append(move(np.array(target)))
        forces.append([fem.assemble_scalar(form) for form in push])
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    iterations, cuts = np.sum(costs, axis=0)
    print(
        f"dolfinx {COLUMNS}x{ROWS}: Fn {-forces[29][1]:.6f}  Fn {-forces[-1][1]:.6f} "
        f"Ft {forces[-1][0]:.6f} N  {iterations} iterations, {cuts} cutbacks, {wall:.1f} s, "
        f"processor {processor:.1f} s",
        flush=True,
    )


run()
