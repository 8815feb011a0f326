"""Two separate pieces as one body, and the contact between them."""

import numpy as np

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.self_contact import SelfContact


def joined(lower: Body, upper: Body, materials, element) -> Body:
    """One body of two separate pieces; sides are named lower_top, upper_bottom and so on."""
    first, second = lower.mesh, upper.mesh
    count = first.p.shape[1]
    mesh = type(first)(np.hstack([first.p, second.p]), np.hstack([first.t, second.t + count]))
    facet = {tuple(sorted(f)): i for i, f in enumerate(mesh.facets.T.tolist())}
    named = {}
    for piece, offset, prefix in ((first, 0, "lower"), (second, count, "upper")):
        for side, facets in piece.boundaries.items():
            pairs = np.sort(piece.facets[:, facets].T + offset, axis=1)
            named[f"{prefix}_{side}"] = np.array([facet[tuple(p)] for p in pairs.tolist()])
    cells = first.t.shape[1]
    mesh = mesh.with_boundaries(named).with_subdomains(
        {"lower": np.arange(cells), "upper": np.arange(cells, mesh.t.shape[1])}
    )
    return Body(mesh, materials, plane=Plane.STRAIN, element=element)


def between(body, normal, friction, points=2, reach=0.2):
    """Contact of the lower piece's top with the upper piece's bottom."""
    sides = tuple(
        body.surface(name, points_per_edge=points) for name in ("lower_top", "upper_bottom")
    )
    return SelfContact(sides, normal=normal, friction=friction, reach_mm=reach, name="pieces")
