"""A block of skin, compressed between rollers until its surface wrinkles, creases and folds."""

from __future__ import annotations

from fem2d.body.body import Body
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.contact.self_contact import SelfContact
from fem2d.loads.tie import ElasticTie
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.model import Model
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion

ROLLER_MPA_PER_MM = 50.0


def squeezed(
    body: Body,
    motion: RigidMotion,
    length: float,
    *,
    roller_mpa_per_mm: float = ROLLER_MPA_PER_MM,
    friction: float = 0.0,
) -> Model:
    """Return the block between rollers, the right ones moving; walls stand for mirror images.

    Skin touches skin with ``friction``.
    """
    surface = {name: body.surface(name) for name in ("top", "bottom", "left", "right")}
    normal, smooth = NormalLaw(), FrictionLaw(0.0)
    rollers = (
        ElasticTie(surface["bottom"], roller_mpa_per_mm, only_along=(0.0, 1.0), name="below"),
        ElasticTie(surface["left"], roller_mpa_per_mm, only_along=(1.0, 0.0), name="left"),
        ElasticTie(
            surface["right"],
            roller_mpa_per_mm,
            attached_at=motion.at(0.0),
            only_along=(1.0, 0.0),
            name="right",
        ),
    )
    left = Outline.from_corners([[-5, -20], [0, -20], [0, 60], [-5, 60]], 0.0)
    walls = (
        RigidContact(
            surface["top"], left, normal=normal, friction=smooth, moving=False, name="left"
        ),
        RigidContact(
            surface["top"],
            left.moved(0, (length + 5, 0)),
            normal=normal,
            friction=smooth,
            name="right",
        ),
    )
    fold = SelfContact(
        (surface["top"],),
        normal=normal,
        friction=FrictionLaw(friction),
        reach_mm=0.5,
        same_surface=True,
        name="fold",
    )
    return Model(body, contacts=(*walls, *(fold,)), ties=rollers, inertia=Inertia(1e-9, 0.0, 0.02))
