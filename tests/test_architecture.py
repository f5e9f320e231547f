"""Imports run one way: a package imports only packages above it in the table, top to bottom."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import pneumorph

PACKAGES = [
    "extras",
    "units",
    "doing",
    "interrupts",
    "processes",
    "atomic",
    "compiling",
    "kept",
    "numerics",
    "threads",
    "symmetry",
    "cad",
    "problem",
    "bodies",
    "geometry",
    "make",
    "mesh",
    "mechanics",
    "objective",
    "sensitivity",
    "results",
    "analysis",
    "surrogate",
    "validation",
    "limits",
    "optimize",
    "run",
    "output",
    "study",
    "proposals",
    "verify",
    "interface",
    "serve",
    "cli",
    "__main__",
]
# The rooms of packages that have some, top to bottom like the packages.
ROOMS = {
    "symmetry": ["__init__", "operations", "images", "part", "basis"],
    "geometry": ["bspline", "regions", "surface", "body", "design_space", "__init__", "tube", "lattice", "starting"],
    "mechanics": ["material", "elements", "contact", "assembly", "solve", "setup", "constants", "__init__"],
    "limits": [
        *("__init__", "limit", "certify", "rows", "kinds", "tube", "lattice", "obstacles"),
        *("table", "report", "linearised", "shares", "of_shape"),
    ],
}
# What a package must not know although it stands above.
KEPT_APART = {
    "symmetry": {"numerics"},
    "cad": {"numerics", "symmetry"},
    "problem": {"numerics"},
    "bodies": {"numerics"},
    "geometry": {"numerics"},
    "mesh": {"numerics"},
    "mechanics": {"geometry"},
    "objective": {"mesh"},
    "limits": {"mesh", "mechanics", "objective", "sensitivity", "results", "analysis"},
    "results": {"objective", "sensitivity"},
    "run": {"analysis", "optimize"},
    "output": {"optimize"},
    "serve": {"optimize"},
    "verify": {"optimize"},
}

# Who may know that surfaces are tubes: a second kind of surface is a room beside these.
KNOW_TUBES = (
    "geometry/tube",
    "geometry/starting.py",
    "mesh/tube",
    "analysis/bodies.py",
    "limits/tube",
    "limits/table.py",
    "limits/of_shape.py",
    "make",
    "output/tube",
    "verify",
)

SOURCE = Path(pneumorph.__file__).parent
# The one module of `run` that knows the loop; who reads runs does not load it.
DRIVER = SOURCE / "run" / "complete.py"
MODULES = sorted(SOURCE.rglob("*.py"))


def modules_imported(path: Path) -> set[str]:
    """The pneumorph modules, by full name, that a module imports, at its top or inside a function."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: import by the full name, so that this test can follow it"
            names = [node.module or ""]
            if node.module == "pneumorph":
                names = [f"pneumorph.{alias.name}" for alias in node.names]
        found |= {name for name in names if name.startswith("pneumorph.")}
    return found


def packages_imported(path: Path) -> set[str]:
    return {name.split(".")[1] for name in modules_imported(path)} - {"errors", "__version__"}


def rooms_imported(path: Path, package: str) -> set[str]:
    """The rooms of a package that a module imports; "__init__" where it imports the package itself."""
    return {[*name.split("."), "__init__"][2] for name in modules_imported(path) if name.split(".")[1] == package}


@pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(SOURCE)) for path in MODULES])
def test_imports_run_one_way(path):
    package = path.relative_to(SOURCE).parts[0].removesuffix(".py")
    imported = packages_imported(path) - {package}
    if package == "__init__":
        named = {"analysis", "bodies", "interface", "limits", "problem", "proposals", "results"}
        assert imported <= named, "the face names types, and loads nothing"
        return
    if package == "errors":
        assert not imported, f"{package} stands above every package"
        return
    apart = set() if path == DRIVER else KEPT_APART.get(package, set())
    above = set(PACKAGES[: PACKAGES.index(package)]) - apart
    assert imported <= above, f"{package} must not import {', '.join(sorted(imported - above))}"


ROOMED = [path for path in MODULES if path.relative_to(SOURCE).parts[0] in ROOMS]


@pytest.mark.parametrize("path", ROOMED, ids=[str(path.relative_to(SOURCE)) for path in ROOMED])
def test_rooms_import_one_way(path):
    package, room = path.relative_to(SOURCE).parts[:2]
    room = room.removesuffix(".py")
    above = set(ROOMS[package][: ROOMS[package].index(room)])
    imported = rooms_imported(path, package) - {room}
    assert imported <= above, f"{package}/{room} must not import {', '.join(sorted(imported - above))}"


NAMES = {
    ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts).removesuffix(".__init__"): path for path in MODULES
}


def modules_needed(path: Path) -> set[str]:
    """The modules that a module imports, at its top, inside a function or for types: a name of a package is its own."""
    needed = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            needed |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            named = {f"{node.module}.{alias.name}" for alias in node.names}
            needed |= {name if name in NAMES else str(node.module) for name in named}
    return needed & NAMES.keys()


DIRECTORIES = sorted({path.parts[len(SOURCE.parts)] for path in MODULES if path.parent != SOURCE})


@pytest.mark.parametrize("package", DIRECTORIES)
def test_packages_have_no_circles_inside(package):
    inside = {name: path for name, path in NAMES.items() if name.split(".")[1:2] == [package]}
    try:
        TopologicalSorter({name: modules_needed(path) & inside.keys() for name, path in inside.items()}).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


OTHERS = [path for path in MODULES if not path.relative_to(SOURCE).as_posix().startswith(KNOW_TUBES)]


@pytest.mark.parametrize("path", OTHERS, ids=[str(path.relative_to(SOURCE)) for path in OTHERS])
def test_surfaces_are_of_any_kind(path):
    tubes = ("pneumorph.geometry.tube", "pneumorph.mesh.tube", "pneumorph.limits.tube")
    known = sorted(name for name in modules_imported(path) if name.startswith(tubes))
    assert not known, f"{path.name} must not import {', '.join(known)}"
