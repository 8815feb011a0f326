"""What an installed wheel must do: run with its Python, from a folder that knows no sources.

    cd SOMEWHERE && ENVIRONMENT/bin/python TREE/.ci/smoke.py TREE

TREE is only read for its examples, which run here as a user would run them.
"""

import importlib
import importlib.metadata
import pkgutil
import subprocess
import sys
from pathlib import Path

PACKAGES = ("geometry2d", "mocap", "fem2d", "scenarios", "drinksim")
BIN = Path(sys.executable).parent


def import_everything() -> None:
    """Import every module, each from the environment and none from a source tree."""
    count = 0
    for package in PACKAGES:
        home = importlib.import_module(package)
        for found in pkgutil.walk_packages(home.__path__, f"{package}."):
            if found.name.endswith("__main__"):
                continue
            module = importlib.import_module(found.name)
            assert Path(str(module.__file__)).is_relative_to(sys.prefix), module.__file__
            count += 1
    print(f"{count} modules import")


def knock_at_the_front_door() -> None:
    """Import what is public, in no time, and load a scenario of the library by it."""
    timed = (
        "import time; begin = time.perf_counter(); import drinksim; "
        "print(time.perf_counter() - begin)"
    )
    seconds = float(run("python", "-c", timed))
    assert seconds < 0.5, f"import drinksim took {seconds:.2f} s"
    import drinksim as ds

    assert ds.__version__ == importlib.metadata.version("drinksim")
    assert ds.load_scenario("A38-F").name == "A38-F"
    missing = [name for name in ds.__all__ if not hasattr(ds, name)]
    assert not missing, missing
    print(f"import drinksim takes {seconds:.3f} s; it has {', '.join(ds.__all__)}")


def solve_a_bar() -> None:
    """Stretch a bar by 1 %: its force is that of Young's modulus, to first order."""
    import numpy as np
    import skfem

    from fem2d.body.body import Body
    from fem2d.loads.load import Load
    from fem2d.materials.neo_hookean import NeoHookean
    from fem2d.solvers.model import Model
    from fem2d.solvers.static import solve_static

    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 8, 9), np.linspace(0, 2, 3))
    sides = {
        "left": lambda x: np.isclose(x[0], 0),
        "right": lambda x: np.isclose(x[0], 8),
        "bottom": lambda x: np.isclose(x[1], 0),
    }
    law = NeoHookean(0.01, poisson=0.3)
    body = Body(mesh.with_boundaries(sides), law, plane="stress")
    left, right, bottom = (body.boundary_nodes(side) for side in sides)
    held = np.concatenate([2 * left, 2 * right, 2 * bottom + 1])
    move = np.concatenate([0.0 * left, np.full(len(right), 0.08), 0.0 * bottom])
    found = solve_static(Model(body, held=held), Load(held_mm=move))
    assert found.converged, found.status
    force = found.balance.forces[2 * right].sum()
    young = 2 * (1 + 0.3) * law.shear_modulus_mpa
    assert abs(force - young * 0.01 * 2) < 0.02 * young * 0.01 * 2, force
    print(f"a bar stretched by 1 % pulls with {force:.6f} N")


def run(*command: str) -> str:
    """Run a program of this environment and return what it prints; it must succeed in silence."""
    done = subprocess.run(
        [str(BIN / command[0]), *command[1:]], capture_output=True, text=True, check=False
    )
    print(f"$ {' '.join(command)[:100]}: exit code {done.returncode}")
    if done.returncode or done.stderr:
        sys.exit(f"{done.stdout}\n{done.stderr}")
    return done.stdout


def use_the_commands() -> None:
    """Ask for version and scenarios, track a bundled recording, and compute a study."""
    assert run("drinksim", "--version").split()[-1] == importlib.metadata.version("drinksim")
    assert "A38-F" in run("drinksim", "scenarios")
    Path("own.toml").write_text(run("drinksim", "scenarios", "A38-F"), encoding="utf-8")
    import scenarios

    recording = Path(str(scenarios.__file__)).parent / "library" / "A38-F"
    run(
        "drinksim", "convert", str(recording / "recording.mp4"),
        "--markers", str(recording / "markers.toml"), "--out", "motion", "--end", "1.0",
    )  # fmt: skip
    run("drinksim", "element", "L2-Ogden/dermis", "--mode", "uniaxial", "--out", "element")
    run("drinksim", "press", "L2-Ogden", "--force", "0.1", "--neck", "A38", "--out", "press")
    assert (Path("motion") / "motion.csv").is_file()


def run_the_examples(tree: Path) -> None:
    """Run each example as a script of its own."""
    for script in sorted((tree / "examples").glob("*.py")):
        run("python", str(script))


if __name__ == "__main__":
    assert not Path("pyproject.toml").exists(), "run this outside the source tree"
    import_everything()
    knock_at_the_front_door()
    solve_a_bar()
    use_the_commands()
    run_the_examples(Path(sys.argv[1]))
