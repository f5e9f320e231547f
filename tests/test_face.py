"""The package's face: what is loaded when, what is public, and that its examples run."""

import doctest
import inspect
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from shutil import copytree

import pytest

import pneumorph as pm
from pneumorph.cli.commands import simulate

ROOT = Path(__file__).parents[1]
HEAVY = {"jax", "scipy", "numpy", "numba", "pyvista", "vtk", "matplotlib", "netgen", "distributed", "pint"}
SLOW = {"Design", "Run", "Sweep", "validate", "check_gradient", "design", "designs", "open_run"}


def loaded_by(code: str) -> set[str]:
    """Packages in a fresh process after some code."""
    code += "\nimport sys; print(*{name.split('.')[0] for name in sys.modules})"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True).stdout
    return set(printed.splitlines()[-1].split())


def test_importing_loads_nothing_else():
    assert not loaded_by("import pneumorph") & HEAVY


def test_importing_changes_nothing():
    loaded_by("import os; before = dict(os.environ)\nimport pneumorph, pneumorph.problem\nassert before == os.environ")


def test_reading_a_problem_needs_no_mechanics():
    assert not loaded_by(f"import pneumorph as pm; pm.load({str(ROOT / 'examples' / 'small.toml')!r})") & {
        "jax", "numba", "pyvista", "matplotlib", "netgen", "pint",
    }  # fmt: skip


@pytest.mark.parametrize("command", ["check", "design", "simulate"])
def test_commands_load_what_draws_when_they_draw(command):
    assert not loaded_by(f"import pneumorph.cli.{command}") & {"matplotlib", "pyvista", "vtk", "netgen", "distributed"}


@pytest.mark.parametrize("arguments", [["--help"], ["simulate", "--help"], ["material", "fit", "--help"]])
def test_help_comes_at_once(arguments):
    code = f"import sys; sys.argv = ['pneumorph', *{arguments!r}]\nfrom pneumorph.cli import app\n"
    assert not loaded_by(code + "try: app()\nexcept SystemExit: pass") & HEAVY


def test_arrays_are_double_from_the_first_use():
    loaded_by("import pneumorph.limits\nimport jax.numpy as jnp\nassert jnp.ones(1).dtype == 'float64'")


def test_public_names():
    assert set(pm.__all__) <= set(dir(pm))
    for name in pm.__all__:
        assert getattr(pm, name).__doc__, f"{name} says nothing of itself"
    with pytest.raises(AttributeError, match="no attribute 'desing'"):
        getattr(pm, "desing")  # noqa: B009
    typed = (Path(pm.__file__).parent / "py.typed").exists()
    assert typed


def test_help_names_what_there_is():
    """It is written out, so that nothing has to be loaded for it."""
    from pneumorph.analysis.pressures import BLOCKS
    from pneumorph.cli.new import BODIES
    from pneumorph.output.export import CHAIN, FORMATS
    from pneumorph.problem.material import MODELS
    from pneumorph.problem.starts import KINDS

    commands = import_module("pneumorph.cli.commands")
    showing, materials = (import_module(f"{commands.__name__}.{name}") for name in ("showing", "materials"))
    told = inspect.getsource(simulate)
    assert all(re.search(rf"\b{name}\b", told) for name in BLOCKS)
    kinds = " ".join(inspect.getsource(commands.new).replace('"\n', "").replace('            "', "").split())
    assert ", ".join(KINDS) in kinds and ", ".join(BODIES) in kinds
    assert f'metavar="{"|".join((*FORMATS, CHAIN))}"' in inspect.getsource(showing)
    assert f"One of {', '.join(MODELS)}, or all." in inspect.getsource(materials)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the examples."""
    folder = tmp_path_factory.mktemp("place")
    copytree(ROOT / "examples", folder / "examples")
    return folder


@pytest.fixture(scope="module")
def with_run(place):
    """A folder with the examples and a run of the small one."""
    pm.design(place / "examples" / "small.toml", out=place / "runs" / "small")
    return place


def examples_of(name: str) -> list[doctest.DocTest]:
    """The examples of a public name: of its docstring, and of its public methods."""
    found = doctest.DocTestFinder(exclude_empty=True).find(getattr(pm, name), name, globs={})
    return [one for one in found if one.examples]


def run_examples(examples: list[doctest.DocTest]) -> None:
    printed: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for example in examples:
        runner.run(example, out=printed.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(printed)


FUNCTIONS = [name for name in pm.__all__ if name[0].islower()] + ["Design", "Problem", "Run", "Sweep"]


@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name not in SLOW])
def test_examples_run(name, place, monkeypatch):
    monkeypatch.chdir(place)
    assert examples_of(name), f"{name} has no example"
    run_examples(examples_of(name))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SLOW))
def test_examples_with_a_run_run(name, with_run, monkeypatch):
    monkeypatch.chdir(with_run)
    # Elements of what is validated, mm: larger ones than in a quick validation.
    monkeypatch.setattr("pneumorph.validation.beam.QUICK", 28.0)
    assert examples_of(name), f"{name} has no example"
    run_examples(examples_of(name))


@pytest.mark.slow
@pytest.mark.parametrize("page", ["docs/python.md"])
def test_pages_run(page, with_run, monkeypatch):
    monkeypatch.chdir(with_run)
    text = (ROOT / page).read_text(encoding="utf-8").replace("```", "")
    run_examples([doctest.DocTestParser().get_doctest(text, {}, page, page, 0)])
