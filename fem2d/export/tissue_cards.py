"""Cards of a deck for the tissue: nodes, elements, materials, and the springs of elastic ties."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.tie import ElasticTie
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.material import Material
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from geometry2d.foundation.errors import DrinksimError

Index = NDArray[np.int64]


CARD_WIDTH = 8
"""Most numbers in one line of material constants."""


class DeckError(DrinksimError):
    """The model has a member without counterpart in a deck."""


def tissue_cards(body: Body, *, density: float, beta: float) -> Iterator[str]:
    """Yield nodes, elements, sets, materials and sections."""
    if body.element.name not in ("T6", "T6R") or body.plane is Plane.AXISYMMETRIC:
        raise DeckError(
            f"a deck holds quadratic triangles in plane stress or strain, not {body.element.name} "
            f"in plane {body.plane.name.lower()}"
        )
    if body.prestretch is not None:
        raise DeckError("the tissue is under stress as it is drawn: a deck starts free of stress")
    kind = "CPS6" if body.plane is Plane.STRESS else "CPE6"
    yield "*NODE, NSET=TISSUE"
    for number, (x, y) in enumerate(body.nodes, start=1):
        yield f"{number}, {x:.12g}, {y:.12g}"
    triangles = corners_first(body)
    named = _names(body)
    for name, elements in named.items():
        yield f"*ELEMENT, TYPE={kind}, ELSET={name}"
        for element in elements:
            yield ", ".join(str(n) for n in (element + 1, *(triangles[element] + 1)))
    for name in sorted(body.mesh.boundaries or {}):
        yield f"*NSET, NSET={name.upper()}"
        yield from _rows(body.boundary_nodes(name) + 1)
    for name, elements in named.items():
        material = body.materials[int(body.material_of[elements[0]])]
        yield from _material(name, material, density, beta)
        oriented = f", ORIENTATION={name}_FIBRES" if _fibres(material) else ""
        yield f"*SOLID SECTION, ELSET={name}, MATERIAL={name}{oriented}"
        yield f"{body.thickness_mm:.12g}"


def _names(body: Body) -> dict[str, Index]:
    """Elements of every subdomain, by the set's name."""
    return {name.upper(): body.elements_of(name) for name in sorted(body.mesh.subdomains or {})}


def corners_first(body: Body) -> Index:
    """Return nodes (e, 6): corners counter-clockwise, then middles of sides 1-2, 2-3, 3-1."""
    triangles = body.tables.connectivity
    a, b, c = (body.nodes[triangles[:, k]] for k in range(3))
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    turned: Index = np.where(clockwise[:, None], triangles[:, [0, 2, 1, 5, 4, 3]], triangles)
    return turned


def _rows(numbers: Iterable[int]) -> Iterator[str]:
    listed = [str(number) for number in numbers]
    for first in range(0, len(listed), 16):
        yield ", ".join(listed[first : first + 16])


def _material(name: str, material: Material, density: float, beta: float) -> Iterator[str]:
    directions = _fibres(material)
    if directions:
        yield f"*ORIENTATION, NAME={name}_FIBRES, LOCAL DIRECTIONS={len(directions)}"
        yield "1., 0., 0., 0., 1., 0."
        yield "3, 0."
        for direction in directions:
            yield ", ".join(f"{x:.12g}" for x in direction)
    yield f"*MATERIAL, NAME={name}"
    if density > 0:
        yield "*DENSITY"
        yield f"{density:.12g}"
    if beta > 0:
        yield f"*DAMPING, BETA={beta:.12g}"
    match material:
        case NeoHookean():
            yield "*HYPERELASTIC, NEO HOOKE"
            yield from _constants([material.C10_mpa, material.D1_per_mpa])
        case Ogden():
            terms = [x for pair in zip(material.mu_mpa, material.alpha, strict=True) for x in pair]
            missing = len(material.mu_mpa) - len(material.D_per_mpa)
            yield f"*HYPERELASTIC, OGDEN, N={len(material.mu_mpa)}"
            yield from _constants([*terms, *material.D_per_mpa, *[0.0] * missing])
        case HolzapfelGasserOgden():
            yield f"*ANISOTROPIC HYPERELASTIC, HOLZAPFEL, LOCAL DIRECTIONS={len(directions)}"
            yield from _constants(
                [material.C10_mpa, material.D_per_mpa, material.k1_mpa, material.k2, material.kappa]
            )
        case _:
            raise DeckError(f"{name} is of {type(material).__name__}, which no deck can say")


def _fibres(material: Material) -> tuple[tuple[float, float, float], ...]:
    return material.fibres if isinstance(material, HolzapfelGasserOgden) else ()


def _constants(numbers: list[float]) -> Iterator[str]:
    for first in range(0, len(numbers), CARD_WIDTH):
        yield ", ".join(f"{x:.12g}" for x in numbers[first : first + CARD_WIDTH])


def spring_cards(body: Body, ties: Iterable[ElasticTie]) -> Iterator[str]:
    """Yield a grounded spring for each node and direction that ties hold."""
    stiffness = np.zeros(2 * len(body.nodes))
    for tie in ties:
        dofs, blocks = tie.blocks()
        rows = blocks.sum(axis=2)  # lumped; a tie along one direction only is refused
        np.add.at(stiffness, dofs, rows)
    number = len(body.tables.connectivity)
    for dof in np.flatnonzero(stiffness > 0):
        number += 1
        name = f"TIE_{dof // 2 + 1}_{dof % 2 + 1}"
        yield f"*ELEMENT, TYPE=SPRING1, ELSET={name}"
        yield f"{number}, {dof // 2 + 1}"
        yield f"*SPRING, ELSET={name}"
        yield f"{dof % 2 + 1}"
        yield f"{stiffness[dof]:.12g}"
