"""Without the extras designs, checks, simulations, exports and pages work; one line says how to install the rest."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from tiny import tiny

from pneumorph import extras

ROOT = Path(__file__).parents[1]

HIDDEN = ("vtk", "vtkmodules", "pyvista", "pypardiso", "mkl", "pymetis")

RUN = """
import json, sys
from contextlib import suppress

class Hiding:
    def __init__(self, finder): self.finder = finder
    def find_spec(self, name, *more):
        return None if name.split(".")[0] in {hidden!r} else self.finder.find_spec(name, *more)

sys.meta_path[:] = [Hiding(finder) for finder in sys.meta_path]
from typer.testing import CliRunner
from pneumorph.cli import app
import pneumorph as pm

commands = [line.split() for line in {commands!r}]
for command in commands:
    result = CliRunner().invoke(app, command)
    print(json.dumps([result.exit_code, result.output + str(result.exception or "")]), flush=True)
with suppress(ModuleNotFoundError):
    pm.open_run("run").best.mesh
    raise AssertionError("there is a grid")
assert not set({hidden!r}) & {{name.split(".")[0] for name in sys.modules}}
"""

COMMANDS = (
    "check tiny.toml --quick",
    "design tiny.toml --out run --iterations 1",
    "simulate run --pressure A=20kPa --json steps.json",
    "export run --out run.vtu",
    "export run --out run.inp",
    "report run",
    "draw run history",
    "draw run body",
    "draw run all",
)


@pytest.fixture(scope="module")
def ends(tmp_path_factory):
    """Exit status and output of each of `COMMANDS`, and the folder of the run."""
    folder = tmp_path_factory.mktemp("bare")
    (folder / "tiny.toml").write_text(tiny())
    code = RUN.format(hidden=HIDDEN, commands=COMMANDS)
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stdout + done.stderr
    return dict(zip(COMMANDS, map(json.loads, done.stdout.splitlines()), strict=True)), folder


def test_everything_but_pictures_of_bodies_works(ends):
    results, folder = ends
    for command in COMMANDS[:7]:
        # The start is all that is asked for: no target can be missed.
        assert results[command][0] == 0, results[command][1]
    assert (folder / "run" / "report.html").stat().st_size > 1e5
    assert {path.name for path in (folder / "run" / "pictures").iterdir()} == {
        f"{name}.{suffix}" for name in ("history", "profile") for suffix in ("png", "pdf", "svg")
    }
    steps = json.loads((folder / "steps.json").read_text(encoding="utf-8"))["steps"]
    assert steps[-1]["converged"] and steps[-1]["translation_mm"][2] > 0.0


def test_one_line_says_how_to_install_what_is_missing(ends):
    results, _ = ends
    for command in ("draw run body", "draw run all", "design tiny.toml --out run --iterations 1"):
        lines = [line for line in results[command][1].splitlines() if "pneumorph[pictures]" in line]
        assert len(lines) == 1 and "pyvista" in lines[0], results[command][1]
    assert [results[command][0] for command in ("draw run body", "draw run all")] == [1, 1]
    lines = [line for line in results[COMMANDS[1]][1].splitlines() if "pneumorph[fast]" in line]
    assert len(lines) == extras.has_mkl()


def test_every_extra_is_one_of_the_package_and_of_all():
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert known["all"] == [f"pneumorph[{','.join(sorted(extras.LIBRARIES))}]"]
    assert extras.LIBRARIES.keys() < known.keys()


def test_what_is_missing_is_named(monkeypatch):
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name in ("OCP", "lib3mf") else name)
    assert extras.missing("pictures", "drawing") == ""
    assert extras.missing("cad", "making files") == (
        "making files needs OCP, lib3mf; install with: pip install 'pneumorph[cad]'"
    )
