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
        "--markers", str(recording / "markers.toml"), "--out", "motion", "--end", "1.8",
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
    use_the_commands()
    run_the_examples(Path(sys.argv[1]))
