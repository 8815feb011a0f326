"""The rules of the house: imports go one way, nothing leans on pickles or on evaluated text."""

import ast
import builtins
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

MAY_IMPORT = {
    "geometry2d": set(),
    "mocap": {"geometry2d"},
    "fem2d": {"geometry2d"},
    "scenarios": {"geometry2d", "mocap", "fem2d"},
    "drinksim": {"geometry2d", "mocap", "fem2d", "scenarios"},
}

FLOORS = (
    "geometry2d.foundation",
    "geometry2d",
    "geometry2d.anatomy",
    "geometry2d.drawings",
    "geometry2d.views",
    "mocap",
    "mocap.video",
    "mocap.stickers",
    "mocap.tracking",
    "mocap.motion",
    "mocap.formats",
    "mocap.synthetic",
    "mocap.measurement",
    "mocap.plausible",
    "mocap.views",
    "mocap.convert",
    "fem2d",
    "fem2d.threads",
    "fem2d.materials",
    "fem2d.body",
    "fem2d.contact",
    "fem2d.loads",
    "fem2d.solvers",
    "fem2d.analyses",
    "fem2d.export",
    "scenarios",
    "scenarios.settings",
    "scenarios.results",
    "scenarios.messages",
    "scenarios.placing",
    "scenarios.sip",
    "scenarios.views",
    "scenarios.views.page",
    "scenarios.studies",
    "scenarios.campaign",
    "scenarios.decision",
    "scenarios.optimum",
    "scenarios.export",
    "scenarios.recordings",
    "scenarios.marking",
    "scenarios.cli",
    "scenarios.cli.commands",
    "drinksim",
)
"""The rooms from the ground up: a module imports from its own room and from those above its line.

A package's own name stands for the files that lie in it beside its rooms.
"""

MOST_MODULES = 20

FILES = [path for package in MAY_IMPORT for path in sorted((ROOT / package).rglob("*.py"))]
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in FILES
}


@cache
def syntax(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of a file."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def imports(path: Path) -> Iterator[str]:
    """Full names of what a file imports, modules and things in them alike."""
    for node in syntax(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: write the package's name, not dots"
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def arrows_from(module: str) -> set[str]:
    """Our modules that a module knows, wherever in it they are imported."""
    return {name for name in imports(MODULES[module]) if name in MODULES and name != module}


def floor_of(module: str) -> int:
    room = max((r for r in FLOORS if f"{module}.".startswith(f"{r}.")), key=len)
    return FLOORS.index(room)


def test_imports_go_one_way():
    for path in FILES:
        package = path.relative_to(ROOT).parts[0]
        named = {name.split(".")[0] for name in imports(path)}
        assert named & MAY_IMPORT.keys() - {package} <= MAY_IMPORT[package], path
        assert not named & {"pickle", "shelve", "marshal", "socket", "urllib", "requests"}, path


def test_no_room_knows_a_room_above_it():
    for module in MODULES:
        higher = {name for name in arrows_from(module) if floor_of(name) > floor_of(module)}
        assert not higher, module


def test_no_imports_run_in_circles():
    arrows = {module: arrows_from(module) for module in MODULES}
    assert len(list(TopologicalSorter(arrows).static_order())) == len(MODULES)


def test_every_room_is_on_a_floor_and_holds_few_modules():
    for folder in {path.parent for path in FILES}:
        modules = list(folder.glob("*.py"))
        assert len(modules) <= MOST_MODULES, folder
        floor_of(".".join(folder.relative_to(ROOT).parts))


def test_no_text_is_evaluated():
    for path in FILES:
        called = {
            node.func.id
            for node in syntax(path)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert not called & {"eval", "exec", "__import__"}, path


def test_no_two_public_classes_share_a_name():
    places: dict[str, list[str]] = {}
    for path in FILES:
        for node in syntax(path):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                place = f"{path.relative_to(ROOT).as_posix()}:{node.lineno}"
                places.setdefault(node.name, []).append(place)
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


def test_every_error_is_a_drinksim_error():
    """Names of classes are unique, so a class's bases are found by their names."""
    bases = {
        node.name: {ast.unparse(base).rpartition(".")[2] for base in node.bases}
        for path in FILES
        for node in syntax(path)
        if isinstance(node, ast.ClassDef)
    }

    def ancestors(name: str) -> set[str]:
        own = bases.get(name, set())
        return own.union(*(ancestors(base) for base in own))

    errors = {
        name
        for name in bases
        if any(is_error(base) for base in ancestors(name)) or is_error_name(name)
    }
    strangers = {name for name in errors if "DrinksimError" not in ancestors(name)}
    assert len(errors) > 40
    assert strangers == {"DrinksimError"}


def is_error(name: str) -> bool:
    """Whether a name is that of one of Python's exceptions, warnings left out."""
    value = getattr(builtins, name, None)
    return (
        isinstance(value, type)
        and issubclass(value, BaseException)
        and not issubclass(value, Warning)
    )


def is_error_name(name: str) -> bool:
    return name.endswith(("Error", "Exception"))
