"""When skins crease: half-spaces by energy, and compressed blocks until a valley touches itself.

    python -m benchmarks.creasing [L1 L2-GOH L2-Ogden L3] [--sectors 8 16] [--sizes 0.6 0.3]

*Half-spaces.* A crease is local, so the outermost layer decides, under the compression along its
surface. `fem2d.analyses.creasing` finds the compression at which a fold of any size costs as much
energy as staying flat; beside it stands Biot's, at which the flat surface becomes unstable
(`fem2d.analyses.wrinkling`). Two meshes. The first rows check the method: in a neo-Hookean
half-space in plane strain, incompressible, a crease is favourable from 35 % on (Hong, Zhao and Suo
2009).

*Blocks.* A block of the skin, 12 mm deep and two wavelengths of its linear stability long (24 mm
for L1, whose waves have no length), is compressed between rollers by half in 300 s, with tissue's
density, a relaxation time of 0.02 s (not felt at that rate), and contact of its free surface with
itself and, at both ends, with its mirror image. Nothing disturbs it but rollers that give a little
and rounding. Columns, all nominal compressions: the first state whose tangent is not positive
definite; the first at which a valley's bottom is compressed along the surface as far as creases a
half-space of the outermost layer; the first at which the surface touches itself or its mirror image
anywhere, with the largest compression that it had until then; the first at which parts touch that
lay more than 1.2 mm apart along it; the largest compression along the surface of all; the smallest
volume over undeformed volume; and where and how the run ended.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence

import numpy as np
import skfem
from numpy.typing import NDArray

from fem2d.analyses.creasing import CreasingError, CreasingSettings, creasing
from fem2d.analyses.wrinkling import Layer, StabilityError, wrinkling
from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.self_contact import SelfContactResponse
from fem2d.loads.load import Load
from fem2d.materials.library import configuration
from fem2d.materials.material import Material
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.commit import Commit
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import march
from fem2d.solvers.model import Model
from fem2d.solvers.step_control import StepSettings
from geometry2d.rigid import RigidMotion
from tests.support.squeezed_block import squeezed

DEPTH_MM = 12.0
THICKNESS_MM = {"dermis": 1.195, "hypodermis": 2.87}
"""Of the layers above the last, which fills the depth."""
SHORTENING, DURATION_S = 0.5, 300.0
LENGTH_WITHOUT_WAVES_MM = 24.0
APART_MM = 1.2
"""Parts of the surface nearer than this along it touch in one sharp valley, others in a fold."""
PLANES = (Plane.STRESS, Plane.STRAIN)


def layers_of(skin: str) -> dict[str, Layer]:
    """Return the layers of a skin, outermost first."""
    laws = configuration(skin)
    thickness = [THICKNESS_MM[name] for name in list(laws)[:-1]]
    thickness.append(DEPTH_MM - sum(thickness))
    return {
        name: Layer(law, depth) for (name, law), depth in zip(laws.items(), thickness, strict=True)
    }


def half_space(name: str, material: Material, plane: Plane, sectors: int) -> float:
    """Print the row of a half-space and return its creasing strain, nan if it was not found."""
    started = time.process_time()
    try:
        biot = f"{wrinkling([Layer(material, 12.0)], plane=plane, wavelengths_mm=[1.0]).strain:.1%}"
    except StabilityError:
        biot = "none"
    row, strain = [name, plane.name.lower(), biot, str(sectors)], math.nan
    try:
        found = creasing(material, plane=plane, settings=CreasingSettings(sectors=sectors))
    except CreasingError as error:
        row += [str(error), "", "", "", ""]
    else:
        strain = found.strain
        row += [
            f"{found.strain:.2%}",
            f"{found.folded:.2f}",
            f"{found.flat_volume_ratio:.2f}, {found.least_volume_ratio:.3f}",
            f"{found.least_log_strain:.2f} … {found.largest_log_strain:.2f}",
            f"{found.force:.4f}",
        ]
    print(f"| {' | '.join([*row, f'{time.process_time() - started:.0f}'])} |", flush=True)
    return strain


def block(layers: dict[str, Layer], plane: Plane, length: float, size: float) -> Body:
    """Return a block of elements of about ``size``, twice as high below the outermost layer."""
    levels, top = [np.array([DEPTH_MM])], DEPTH_MM
    for number, layer in enumerate(layers.values()):
        high = size if number == 0 else 2 * size
        count = max(2, round(layer.thickness_mm / high))
        levels.append(np.linspace(top, top - layer.thickness_mm, count + 1)[1:])
        top -= layer.thickness_mm
    y = np.concatenate(levels)[::-1]
    y[0] = 0.0
    squares = skfem.MeshQuad.init_tensor(np.linspace(0, length, round(length / size) + 1), y)
    # Four triangles a square: the mesh is its own mirror image, as the wave should be.
    mesh = squares.to_meshtri(style="x")
    mesh = mesh.with_boundaries(
        {
            "top": lambda x: np.isclose(x[1], DEPTH_MM),
            "bottom": lambda x: np.isclose(x[1], 0),
            "left": lambda x: np.isclose(x[0], 0),
            "right": lambda x: np.isclose(x[0], length),
        }
    )
    middle = mesh.p[1, mesh.t].mean(axis=0)
    below = DEPTH_MM - np.cumsum([layer.thickness_mm for layer in layers.values()])
    layer_of = np.searchsorted(-below, -middle)
    mesh = mesh.with_subdomains(
        {name: np.flatnonzero(layer_of == number) for number, name in enumerate(layers)}
    )
    return Body(mesh, {name: layer.material for name, layer in layers.items()}, plane=plane)


class Seen:
    """What happened first at which nominal compression; nan if it did not."""

    def __init__(self, system: Model, length: float, creases_at: float) -> None:
        self._surface = system.contacts[-1].surfaces[0]
        still = self._surface.positions(np.zeros_like(system.body.nodes))[..., 0]
        self._beside_plane = np.minimum(still, length - still) < APART_MM / 2
        self._length, self._creases_at = length, creases_at
        self.unstable = self.valley_creases = math.nan
        self.touching = self.valley_until_touching = self.folded = math.nan
        self.valley_most, self.least_volume_ratio = 0.0, 1.0
        self._body = system.body

    def watch(self, commit: Commit) -> None:
        """Look at a committed increment."""
        strain = -commit.state.placement.shift_mm[0] / self._length
        valley = 1 - float(self._surface.stretch(commit.state.displacement).min())
        self.valley_most = max(self.valley_most, valley)
        gradient = self._body.fields(commit.state.displacement).deformation_gradient
        self.least_volume_ratio = min(self.least_volume_ratio, float(np.linalg.det(gradient).min()))
        if math.isnan(self.unstable) and commit.instability is not None:
            self.unstable = strain
        if math.isnan(self.valley_creases) and valley >= self._creases_at:
            self.valley_creases = strain
        fold, walls = commit.contacts[-1], commit.contacts
        touching = fold.touching.size > 0 or any(np.any(w.points.pressure > 0) for w in walls)
        if math.isnan(self.touching) and touching:
            self.touching, self.valley_until_touching = strain, self.valley_most
        folded = bool(np.any(_apart(fold) > APART_MM)) or any(
            np.any((wall.points.pressure > 0) & ~self._beside_plane) for wall in walls
        )
        if math.isnan(self.folded) and folded:
            self.folded = strain


def _apart(fold: SelfContactResponse) -> NDArray[np.float64]:
    """Return how far apart (j,) along the undeformed surface touching parts lay, mm."""
    pair, points, touching = fold.pair, fold.points, fold.touching
    here = pair.arc_length(fold.before.edge[touching], fold.before.local[touching])
    there = pair.arc_length(points.met_edge[touching], points.met_local[touching])
    return np.abs(there - here)


def compressed(skin: str, plane: Plane, size: float, creases_at: float) -> None:
    """Compress a block of a skin and print its row."""
    layers = layers_of(skin)
    first = wrinkling(list(layers.values()), plane=plane)
    length = 2 * first.wavelength_mm if len(layers) > 1 else LENGTH_WITHOUT_WAVES_MM
    body = block(layers, plane, length, size)
    times = np.linspace(0, DURATION_S, 61)
    shift = np.column_stack([-SHORTENING * length * times / DURATION_S, 0 * times])
    motion = RigidMotion(times, 0 * times, shift)
    system = squeezed(body, motion, length)
    seen = Seen(system, length, creases_at)
    started = time.process_time()
    step = 0.005 * DURATION_S
    result = march(
        system,
        motion,
        system.at_rest(Load.at(motion.at(0.0), 0.0), next_step_s=0.5 * step),
        solver=fastest_solver(),
        steps=StepSettings(
            longest_s=step, travel_mm=0.2, accuracy_mm=math.inf, watch_stability=True
        ),
        on_commit=seen.watch,
    )
    end = -result.state.placement.shift_mm[0] / length
    row = [
        skin, plane.name.lower(), f"{first.strain:.1%}", f"{length:.1f}", f"{size:g}",
        *(
            "–" if math.isnan(strain) else f"{strain:.1%}"
            for strain in (
                seen.unstable, seen.valley_creases, seen.touching, seen.valley_until_touching,
                seen.folded,
            )
        ),
        f"{seen.valley_most:.1%}", f"{seen.least_volume_ratio:.2f}",
        f"{end:.1%}: {result.status.value}", f"{result.increments}, {result.iterations}",
        f"{time.process_time() - started:.0f}",
    ]  # fmt: skip
    print(f"| {' | '.join(row)} |", flush=True)


def headed(columns: Sequence[str]) -> None:
    """Print the head of a table."""
    print(f"\n| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("skins", nargs="*", default=["L1", "L2-GOH", "L2-Ogden", "L3"])
    parser.add_argument("--sectors", type=int, nargs="*", default=[8, 16])
    parser.add_argument("--sizes", type=float, nargs="*", default=[0.6, 0.3])
    options = parser.parse_args()
    headed(
        [
            "half-space", "plane", "Biot", "sectors", "creases at", "folded, depths",
            "J flat, least", "log strain", "force", "s",
        ]
    )  # fmt: skip
    for poisson in (0.49, 0.499):
        for sectors in options.sectors:
            law = NeoHookean(0.005, poisson=poisson)
            half_space(f"neo-Hookean, ν = {poisson}", law, Plane.STRAIN, sectors)
    outermost: dict[tuple[str, Plane], float] = {}
    for skin in options.skins:
        name, layer = next(iter(layers_of(skin).items()))
        for plane in PLANES:
            for sectors in options.sectors:
                strain = half_space(f"{skin}/{name}", layer.material, plane, sectors)
                outermost[skin, plane] = strain
    headed(
        [
            "block", "plane", "linear stability", "length, mm", "element, mm", "unstable at",
            "valley creases at", "touches at", "valley until then", "folds at", "valley at most",
            "least J", "ended", "increments, iterations", "s",
        ]
    )  # fmt: skip
    for skin in options.skins:
        for plane in PLANES:
            for size in options.sizes:
                compressed(skin, plane, size, outermost[skin, plane])


if __name__ == "__main__":
    main()
