"""A meshed body as a function of its nodal displacements: energy, forces, stiffness, fields."""
