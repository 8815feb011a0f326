"""The mechanics alone: a block of skin pressed by a circle that sticks to it, and how hard.

    python pressed_block.py

The block is 20 mm wide and 12 mm high, of one Ogden law in plane stress, held at the bottom. The
circle has a radius of 6 mm and is moved down step by step; friction keeps what it touches.
"""

import numpy as np
import skfem

import drinksim as ds

mesh = skfem.MeshTri.init_tensor(np.linspace(0.0, 20.0, 41), np.linspace(0.0, 12.0, 25))
mesh = mesh.with_boundaries({"top": lambda x: x[1] == 12.0, "bottom": lambda x: x[1] == 0.0})
outline = ds.fem.Outline.circle((10.0, 18.0), 6.0)

body = ds.fem.Body(mesh, ds.fem.Ogden(mu_mpa=[0.05], alpha=[10.789], poisson=0.49), plane="stress")
contact = ds.fem.RigidContact(body.surface("top"), outline, friction=1.0)
model = ds.fem.Model(body, contacts=[contact], held=body.dofs("bottom"))

result = None
print("depth, mm   force, N per mm of thickness   largest von Mises stress, kPa")
for depth_mm in (0.25, 0.5, 0.75, 1.0):
    result = ds.fem.solve_static(model, ds.fem.Load(move=(0.0, -depth_mm)), start=result)
    if not result.converged:
        raise SystemExit(f"at {depth_mm} mm: {result.status.value}")
    force_n = result.reaction[body.dofs("bottom", along="y")].sum()
    stress_kpa = 1e3 * body.fields(result.displacement).von_mises.max()
    print(f"{depth_mm:9.2f}   {force_n:28.4f}   {stress_kpa:29.1f}")
