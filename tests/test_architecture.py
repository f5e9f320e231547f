"""Imports run one way: a package imports only packages above it in the table, top to bottom."""

import ast
from pathlib import Path

import pytest

import pneumorph

PACKAGES = [
    "units",
    "interrupts",
    "processes",
    "compiling",
    "numerics",
    "threads",
    "problem",
    "geometry",
    "make",
    "mesh",
    "mechanics",
    "objective",
    "sensitivity",
    "analysis",
    "constraint",
    "optimize",
    "run",
    "output",
    "drive",
    "study",
    "verify",
    "interface",
    "serve",
    "cli",
    "__main__",
]
# The subpackages of mechanics, top to bottom like the packages.
SUBPACKAGES = ["material", "elements", "contact", "assembly", "solve", "setup", "__init__"]
# What a package must not know although it stands above.
KEPT_APART = {
    "problem": {"numerics"},
    "geometry": {"numerics"},
    "mesh": {"numerics"},
    "mechanics": {"geometry"},
    "objective": {"mesh"},
    "constraint": {"mesh", "mechanics", "objective", "sensitivity", "analysis"},
    "run": {"optimize"},
    "output": {"optimize"},
    "serve": {"optimize"},
    "verify": {"optimize"},
}

SOURCE = Path(pneumorph.__file__).parent
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


def subpackages_imported(path: Path) -> set[str]:
    """The subpackages of mechanics that a module imports; "__init__" where it imports the package itself."""
    return {[*name.split("."), "__init__"][2] for name in modules_imported(path) if name.split(".")[1] == "mechanics"}


@pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(SOURCE)) for path in MODULES])
def test_imports_run_one_way(path):
    package = path.relative_to(SOURCE).parts[0].removesuffix(".py")
    imported = packages_imported(path) - {package}
    if package == "__init__":
        assert imported <= {"analysis", "constraint", "interface", "problem"}, "the face names types, and loads nothing"
        return
    if package == "errors":
        assert not imported, f"{package} stands above every package"
        return
    above = set(PACKAGES[: PACKAGES.index(package)]) - KEPT_APART.get(package, set())
    assert imported <= above, f"{package} must not import {', '.join(sorted(imported - above))}"


MECHANICS = sorted((SOURCE / "mechanics").rglob("*.py"))


@pytest.mark.parametrize("path", MECHANICS, ids=[str(path.relative_to(SOURCE)) for path in MECHANICS])
def test_rooms_of_mechanics_import_one_way(path):
    subpackage = path.relative_to(SOURCE / "mechanics").parts[0].removesuffix(".py")
    above = set(SUBPACKAGES[: SUBPACKAGES.index(subpackage)])
    imported = subpackages_imported(path) - {subpackage}
    assert imported <= above, f"{subpackage} must not import {', '.join(sorted(imported - above))}"
