"""The lip press in DOLFINx 0.5: run it with the system's Python.

    apt-get install python3-dolfinx-real
    OMP_NUM_THREADS=1 /usr/bin/python3 benchmarks/lip_press_dolfinx.py [coarse|fine]
        [--plane strain|stress]

DOLFINx (LGPL) is no dependency of this project and nothing here imports both. The problem is that
of lip_press.py. DOLFINx has no contact with friction: penalty and return mapping are written into
the weak form, with the same law, sampled at the nodes; forms are compiled, MUMPS factorises. A step
starts from the last shape moved along with the circle in proportion to height, without which
Newton's method gets nowhere in the drag; a step that fails is halved. Plane stress: the thickness
stretch of every integration point is solved from P33 = 0 by a local Newton at each trial
displacement and condensed out of the tangent.
"""

import argparse
import time

import basix
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("mesh", nargs="?", choices=["coarse", "fine"], default="coarse")
parser.add_argument("--plane", choices=["strain", "stress"], default="strain")
options = parser.parse_args()
COLUMNS, ROWS = {"coarse": (50, 40), "fine": (200, 100)}[options.mesh]
PLANE_STRESS = options.plane == "stress"
PENALTY, STICKING, FRICTION, RADIUS = 10.0, 10.0, 1.0, 4.0
TOLERANCE, ITERATIONS = 1e-8, 25
THICKNESS_TOLERANCE, THICKNESS_ITERATIONS = 1e-12, 20
QUADRATURE_DEGREE = 3  # two points by two

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
    metadata={"quadrature_degree": QUADRATURE_DEGREE},
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


def bulk_energy(C, J, thickness):
    shear = 0.0083734
    isochoric = J ** (-2 / 3) * (ufl.tr(C) + thickness**2)
    return 0.5 * shear * (isochoric - 3) + (J - 1) ** 2 / compressibility(shear)


def dermis_energy(C, J, thickness):
    shear, alpha = 0.05, 10.789
    half = 0.5 * ufl.tr(C)
    apart = ufl.sqrt(0.25 * (C[0, 0] - C[1, 1]) ** 2 + C[0, 1] ** 2 + 1e-14)
    powers = (half + apart) ** (alpha / 2) + (half - apart) ** (alpha / 2) + thickness**alpha
    return 2 * shear / alpha**2 * (J ** (-alpha / 3) * powers - 3) + (J - 1) ** 2 / compressibility(
        shear
    )


points = ufl.FiniteElement(
    "Quadrature", block.ufl_cell(), degree=QUADRATURE_DEGREE, quad_scheme="default"
)
stretch = fem.Function(fem.FunctionSpace(block, points))
stretch_before = fem.Function(stretch.function_space)
thickness = ufl.variable(stretch) if PLANE_STRESS else 1
F = ufl.Identity(2) + ufl.grad(u)
C, J = F.T * F, ufl.det(F) * thickness
laws = [law(C, J, thickness) for law in (bulk_energy, dermis_energy)]
energy = sum(law * dx(layer) for layer, law in enumerate(laws))
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
du = ufl.TrialFunction(space)
residual = ufl.derivative(energy, u, v) - ufl.dot(contact, v) * ds(1)
tangent = ufl.derivative(residual, u, du)
across = []  # cells of a layer, their points, P33 there and its derivative
if PLANE_STRESS:
    places_in_cell = basix.make_quadrature(basix.CellType.quadrilateral, QUADRATURE_DEGREE)[0]
    points_of = stretch.function_space.dofmap.list.array.reshape(len(cells), -1)
    for layer, law in enumerate(laws):
        P33 = ufl.diff(law, thickness)
        slope = ufl.diff(P33, thickness)
        condensed = ufl.derivative(P33, u, du) * ufl.derivative(P33, u, v) / slope
        tangent -= condensed * dx(layer)
        here = np.flatnonzero(layers == layer).astype(np.int32)
        both = fem.Expression(ufl.as_vector([P33, slope]), places_in_cell)
        across.append((here, points_of[here], both))
tangent_form = fem.form(tangent)
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


def free_thickness():
    """Solve P33 = 0 for the thickness stretch of every point; return the largest |P33| left."""
    left = 0.0
    for here, points, both in across:
        for _ in range(THICKNESS_ITERATIONS):
            P33, slope = np.moveaxis(both.eval(here).reshape(*points.shape, 2), -1, 0)
            change = P33 / slope
            stretch.x.array[points] -= change
            if not np.abs(change).max() > THICKNESS_TOLERANCE:
                break
        left = max(left, np.abs(P33).max())
    return left


def unbalanced():
    """Return the largest unbalanced force and the largest force that acts."""
    free_thickness()
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
        stretch_start = stretch.x.array.copy()
        for _ in range(8):
            u.x.array[:] = start - share * step.array
            stretch.x.array[:] = stretch_start
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
    stretch_before.x.array[:] = stretch.x.array


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
        stretch.x.array[:] = stretch_before.x.array
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
    stretch.x.array[:] = stretch_before.x.array[:] = 1
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
    across_mpa = f", |P33| {free_thickness():.0e} MPa" if PLANE_STRESS else ""
    print(
        f"dolfinx {COLUMNS}x{ROWS} plane {options.plane}: Fn {-forces[29][1]:.6f}  "
        f"Fn {-forces[-1][1]:.6f} Ft {forces[-1][0]:.6f} N  {iterations} iterations, "
        f"{cuts} cutbacks, {wall:.2f} s, processor {processor:.2f} s{across_mpa}",
        flush=True,
    )


run()
