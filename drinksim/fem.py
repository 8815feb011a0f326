"""Plane finite elements: bodies of hyperelastic laws, contact, loads, statics and marches.

>>> import skfem
>>> from drinksim import fem
>>> square = skfem.MeshTri().refined(2).with_boundaries(
...     {"bottom": lambda x: x[1] == 0, "top": lambda x: x[1] == 1}
... )
>>> body = fem.Body(square, fem.NeoHookean(0.005, poisson=0.49), plane="strain")
>>> circle = fem.Outline.circle((0.5, 1.5), 0.5)
>>> contact = fem.RigidContact(body.surface("top"), circle, friction=0.5)
>>> model = fem.Model(body, contacts=[contact], held=body.dofs("bottom"))
>>> fem.solve_static(model, fem.Load(move=(0.0, -0.05))).converged
True
"""

from fem2d.body.body import Body, Response
from fem2d.body.fields import Fields
from fem2d.body.kinematics import Plane
from fem2d.body.surface import Surface
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.contact.self_contact import SelfContact
from fem2d.export.deck import abaqus_deck
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.dead import DeadLoad
from fem2d.loads.liquid import LiquidLoad, LiquidPressure
from fem2d.loads.load import Load
from fem2d.loads.muscle import FibresAcross, FibresInPlane, MuscleLoad
from fem2d.loads.muscle_law import MuscleFibre
from fem2d.loads.pressure import Exposure, FollowerPressure
from fem2d.loads.tie import ElasticTie
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.library import configuration, library_materials, material_named
from fem2d.materials.material import Material
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from fem2d.solvers.commit import Commit
from fem2d.solvers.hand import Hand
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.march import MarchResult, MarchStatus, march
from fem2d.solvers.model import Model
from fem2d.solvers.newton import NewtonStatus
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.state import State
from fem2d.solvers.static import (
    StaticResult,
    StaticSettings,
    StaticStatus,
    solve_static,
    static_path,
)
from fem2d.solvers.step_control import StepSettings
from fem2d.threads import Threads
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion, RigidPlacement

__all__ = [
    "Amplitude",
    "Body",
    "Commit",
    "DeadLoad",
    "ElasticTie",
    "Exposure",
    "FibresAcross",
    "FibresInPlane",
    "Fields",
    "FollowerPressure",
    "FrictionLaw",
    "Hand",
    "HolzapfelGasserOgden",
    "Inertia",
    "LiquidLoad",
    "LiquidPressure",
    "Load",
    "MarchResult",
    "MarchStatus",
    "Material",
    "Model",
    "MuscleFibre",
    "MuscleLoad",
    "NeoHookean",
    "NewtonSettings",
    "NewtonStatus",
    "NormalLaw",
    "Ogden",
    "Outline",
    "Plane",
    "Response",
    "RigidContact",
    "RigidMotion",
    "RigidPlacement",
    "SelfContact",
    "State",
    "StaticResult",
    "StaticSettings",
    "StaticStatus",
    "StepSettings",
    "Surface",
    "Threads",
    "abaqus_deck",
    "configuration",
    "library_materials",
    "march",
    "material_named",
    "solve_static",
    "static_path",
]
