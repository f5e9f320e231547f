"""A command says once that it compiles, where nothing compiled before is at hand."""

import json
import os
import subprocess
import sys
from shutil import copytree

import pytest

from pneumorph import numerics
from pneumorph.cli.warm_up import small, twisted
from pneumorph.geometry.starting import body_of
from pneumorph.limits.of_shape import tube_limits
from pneumorph.mesh import relax, slide
from pneumorph.optimize.setup import build_setup

SAID = "compiling (once)\n"


WITHOUT_FOLDER = """
import pneumorph.numerics
import jax
print(jax.jit(lambda x: x + 1)(1), jax.config.jax_compilation_cache_dir)
"""


@pytest.mark.slow
def test_what_designs_need_is_compiled_once_by_warming_up(tiny, tmp_path):
    """Another tube is designed without a kernel of its own: other sizes, no ripple, a spring."""
    # In a folder of the user's own choice jax keeps only what took long. Numba's cache, which takes longest, is shared.
    own = {key: value for key, value in os.environ.items() if key != "JAX_COMPILATION_CACHE_DIR"}

    def run(*words):
        """What it prints with a cache of jax of its own."""
        command = [sys.executable, "-m", "pneumorph", *words]
        env = own | {"PNEUMORPH_CACHE": str(tmp_path / "cache")}
        return subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=True)

    warm = run("warm-up")
    # On a slow machine it is also said what is done.
    assert warm.stderr.count(SAID) == 1 and SAID not in warm.stdout and str(tmp_path / "cache") in warm.stdout
    kernels = sorted((tmp_path / "cache").glob("*-cache"))
    found = run("design", str(tiny), "--iterations", "1")
    assert SAID not in found.stderr and kernels == sorted((tmp_path / "cache").glob("*-cache"))
    assert len(kernels) > 3 and min(kernel.stat().st_size for kernel in kernels) > 0
    for number, kernel in enumerate(kernels):
        # As after a crash, a full disk and a faulty one.
        kernel.write_bytes((b"", kernel.read_bytes()[:99], b"garbage" * 99)[number % 3])
    steps = tmp_path / "steps.json"
    simulated = "simulate", str(tiny), "--json", str(steps)
    assert run(*simulated).stderr.count(SAID) == 1
    assert SAID not in run(*simulated).stderr, "they are kept again"
    assert len(json.loads(steps.read_text())["steps"]) == 1


def test_warming_up_looks_at_curvature_between_samples():
    asked = small("quadratic")
    body = body_of(asked)
    rows = tube_limits(body, asked.limits).rows(body, 0.1, -0.5)
    assert len(rows.places["curvature"].surface)


def test_warming_up_moves_nodes_of_poor_elements():
    morph, points = twisted(build_setup(small("quadratic")))
    assert relax(morph, points) is not morph and slide(morph, points) is not morph


def test_a_folder_that_cannot_be_made_is_none(tmp_path):
    (tmp_path / "file").touch()
    own = {key: value for key, value in os.environ.items() if key != "JAX_COMPILATION_CACHE_DIR"}
    env = own | {"PNEUMORPH_CACHE": str(tmp_path / "file" / "other")}
    found = subprocess.run([sys.executable, "-c", WITHOUT_FOLDER], env=env, capture_output=True, text=True, check=True)
    assert (found.stdout, found.stderr) == ("2 None\n", "")


def test_help_compiles_nothing():
    found = subprocess.run([sys.executable, "-m", "pneumorph", "--help"], capture_output=True, text=True, check=True)
    assert found.stderr == ""


def test_flags_of_xla_are_added_to_those_of_the_user_and_only_where_they_are_known():
    assert numerics.flags("--other=1", (0, 10, 2)) == f"--other=1 {numerics.QUICK}"
    own = "--xla_cpu_use_fusion_emitters=true"
    assert numerics.flags(own, (0, 10, 2)) == own
    assert numerics.flags("", (0, 5, 0)) == "" == numerics.flags("", (1, 10, 0))


KERNEL = """
from pneumorph import compiling
import sys
if "announced" in sys.argv:
    compiling.announce(lambda: print("said"))
import pneumorph.numerics
import numba
for _ in range(2):
    numba.njit(lambda x: x + 1)(1)
"""


def test_a_program_says_nothing():
    def printed(*arguments):
        command = [sys.executable, "-c", KERNEL, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert printed() == ""
    assert printed("announced") == "said\n"


ANOTHER = """
import sys
import pneumorph.kept
from kernel import twice
print(twice(21), sum(twice.stats.cache_hits.values()))
"""
SPOILED = {
    "emptied": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:40]),
    "garbage": lambda path: path.write_bytes(b"\x80\x04garbage"),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
    "removed": lambda path: path.unlink(),
}


@pytest.fixture(scope="module")
def hits(tmp_path_factory):
    """Computes with a kernel in a process of its own, and says how often one was read from a folder."""
    folder = tmp_path_factory.mktemp("kernel")
    (folder / "kernel.py").write_text("import numba\n@numba.njit(cache=True)\ndef twice(x):\n    return 2 * x\n")
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])

    def count(**places):
        env = os.environ | {"PYTHONPATH": path} | places
        found = subprocess.run([sys.executable, "-c", ANOTHER], env=env, capture_output=True, text=True)
        assert (found.returncode, found.stderr) == (0, "")
        value, read = found.stdout.split()
        assert value == "42"
        return int(read)

    return count


@pytest.fixture(scope="module")
def kept(hits, tmp_path_factory):
    """A folder with a kernel that can be read."""
    folder = tmp_path_factory.mktemp("kept")
    assert [hits(NUMBA_CACHE_DIR=str(folder)) for _ in range(2)] == [0, 1]
    return folder


@pytest.mark.parametrize("spoil", SPOILED)
def test_kernels_that_cannot_be_read_are_compiled_again(tmp_path, hits, kept, spoil):
    copytree(kept, tmp_path / "kept")
    files = sorted((tmp_path / "kept").rglob("*.nb?"))
    assert len(files) == 2, "an index and a kernel"
    for file in files:
        SPOILED[spoil](file)
    folder = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    assert (hits(**folder), hits(**folder)) == (0, int(spoil != "a folder"))


def test_where_no_folder_can_be_written_kernels_are_compiled(tmp_path, hits):
    for name in ("file", "__pycache__"):
        (tmp_path / name).touch()
    within = str(tmp_path / "file" / "within")
    assert hits(NUMBA_CACHE_DIR=within, HOME=within, XDG_CACHE_HOME=within, LOCALAPPDATA=within) == 0
