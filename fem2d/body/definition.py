"""What defines a body beside its mesh: plane, depth of the section, material of each element."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from fem2d.body.elements import Tables
from fem2d.body.kinematics import Plane
from fem2d.materials.material import Material
from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class BodyError(DrinksimError):
    """A body is described, or evaluated, in a way that makes no sense."""


def plane_named(plane: Plane | str) -> Plane:
    """Return the plane assumption of a name."""
    if isinstance(plane, Plane):
        return plane
    names = {known.name.lower(): known for known in Plane}
    if plane not in names:
        raise BodyError(unknown_name("body", "plane", plane, names))
    return names[plane]


def section_depth(tables: Tables, plane: Plane, thickness_mm: float) -> Array | float:
    """Return the length that the section stands for at its points (e, q), or everywhere, mm."""
    if plane is not Plane.AXISYMMETRIC:
        return thickness_mm
    radius = tables.points[..., 0]
    if not np.all(radius > 0):
        raise BodyError(
            f"an axisymmetric mesh reaches x = {radius.min():g} mm: x is the distance from the "
            "axis and cannot be negative"
        )
    depth: Array = 2 * np.pi * radius
    return depth


def materials_by_element(
    mesh: skfem.Mesh, materials: Material | Mapping[str, Material]
) -> tuple[tuple[Material, ...], Index]:
    """Return the materials and which one each element has."""
    elements = mesh.t.shape[1]
    if not isinstance(materials, Mapping):
        return (materials,), np.zeros(elements, np.int64)
    subdomains: Mapping[str, Any] = mesh.subdomains or {}
    which = np.full(elements, -1, np.int64)
    for number, name in enumerate(materials):
        if name not in subdomains:
            raise BodyError(unknown_name("mesh", "subdomain", name, subdomains))
        inside = np.asarray(subdomains[name], np.int64)
        if np.any(which[inside] >= 0):
            other = list(materials)[which[inside].max()]
            raise BodyError(
                f"subdomains {other!r} and {name!r} overlap: give each element one material"
            )
        which[inside] = number
    if np.any(which < 0):
        bare = [n for n in subdomains if n not in materials]
        raise BodyError(
            f"{np.count_nonzero(which < 0)} elements have no material: name one for "
            + (", ".join(bare) if bare else "every element, the mesh has cells in no subdomain")
        )
    return tuple(materials.values()), which


def unknown_name(owner: str, kind: str, name: str, known: Mapping[str, Any]) -> str:
    """Return what is to be said of a name that an owner, mesh or body, does not know."""
    near = difflib.get_close_matches(name, known, n=1)
    listed = ", ".join(sorted(known)) if known else "none"
    return (
        f"the {owner} has no {kind} called {name!r}"
        + (f": did you mean {near[0]!r}?" if near else "")
        + f" (it has {listed})"
    )
