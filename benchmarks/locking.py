"""How much elements lock on a coarse wall as the material becomes incompressible.

    python -m benchmarks.locking

Errors of the pressure that inflates a wall of 4 × 6 cells to one and a half times its inner radius,
against the closed form of an incompressible material; at ν = 0.49 one to two percent are the
material's own compressibility.
"""

from __future__ import annotations

from fem2d.body.kinematics import Plane
from tests.support.section_problems import locking_error

ELEMENTS = ("T6", "T6M", "Q4", "Q4M", "Q8", "Q8R")
WALLS = {"cylinder": Plane.STRAIN, "sphere": Plane.AXISYMMETRIC}


def main() -> None:
    print("ν       wall      ", "".join(f"{element:>10}" for element in ELEMENTS))
    for poisson in (0.49, 0.499, 0.4999):
        for wall, plane in WALLS.items():
            errors = [100 * locking_error(element, plane, poisson) for element in ELEMENTS]
            print(f"{poisson:<8}{wall:<11}", "".join(f"{error:+9.1f}%" for error in errors))


if __name__ == "__main__":
    main()
