"""Imports run one way: a package imports only packages above it in the table, top to bottom."""

import ast
from pathlib import Path

import pytest

import pneumorph

PACKAGES = [
    "units",
    "problem",
    "geometry",
    "make",
    "mesh",
    "mechanics",
    "objective",
    "sensitivity",
    "constraint",
    "optimize",
    "run",
    "output",
    "study",
    "verify",
    "cli",
]
# What a package must not know although it stands above.
KEPT_APART = {"mechanics": {"geometry"}, "objective": {"mesh"}, "constraint": {"mesh", "mechanics"}}

SOURCE = Path(pneumorph.__file__).parent
MODULES = sorted(SOURCE.rglob("*.py"))


def packages_imported(path: Path) -> set[str]:
    """The pneumorph packages that a module imports, at its top or inside a function."""
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
        found |= {name.split(".")[1] for name in names if name.startswith("pneumorph.")}
    return found - {"errors", "__version__"}


@pytest.mark.parametrize("path", MODULES, ids=[str(path.relative_to(SOURCE)) for path in MODULES])
def test_imports_run_one_way(path):
    package = path.relative_to(SOURCE).parts[0].removesuffix(".py")
    imported = packages_imported(path) - {package}
    if package in ("__init__", "errors"):
        assert not imported, f"{package} stands above every package"
        return
    above = set(PACKAGES[: PACKAGES.index(package)]) - KEPT_APART.get(package, set())
    assert imported <= above, f"{package} must not import {', '.join(sorted(imported - above))}"
