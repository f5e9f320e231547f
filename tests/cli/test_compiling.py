"""A command says once that it compiles, where nothing compiled before is at hand."""

import json
import os
import subprocess
import sys

import pytest

from pneumorph import numerics

SAID = "compiling (once)\n"


def test_it_is_said_when_something_is_compiled_and_not_again(tiny, tmp_path):
    steps = tmp_path / "steps.json"

    def simulated(cache, *options):
        """What it prints with a cache of jax of its own; Numba's is shared, since it takes longest to fill."""
        # In a folder of the user's own choice jax keeps only what took long.
        own = {key: value for key, value in os.environ.items() if key != "JAX_COMPILATION_CACHE_DIR"}
        command = [sys.executable, "-m", "pneumorph", "simulate", str(tiny), "--json", str(steps), *options]
        env = own | {"PNEUMORPH_CACHE": str(tmp_path / cache)}
        return subprocess.run(command, env=env, capture_output=True, text=True, check=True)

    first, again = simulated("one"), simulated("one")
    # On a slow machine it is also said what is done.
    assert first.stderr.count(SAID) == 1 and SAID not in again.stderr
    assert SAID not in first.stdout and len(json.loads(steps.read_text())["steps"]) == 1
    (tmp_path / "file").touch()
    assert simulated("file/other", "--quiet").stderr == "", "a folder that cannot be made is none"
    kernels = sorted((tmp_path / "one").glob("*-cache"))
    for number, kernel in enumerate(kernels):
        # As after a crash, a full disk and a faulty one.
        kernel.write_bytes((b"", kernel.read_bytes()[:99], b"garbage" * 99)[number % 3])
    assert simulated("one").stderr.count(SAID) == 1
    assert len(kernels) > 3 and min(kernel.stat().st_size for kernel in kernels) > 0
    assert SAID not in simulated("one").stderr, "they are kept again"


@pytest.mark.slow
def test_what_designs_need_is_compiled_by_warming_up(tiny, tmp_path):
    """Another tube is designed without a kernel of its own: other sizes, no ripple, a spring."""
    own = {key: value for key, value in os.environ.items() if key != "JAX_COMPILATION_CACHE_DIR"}

    def run(*words):
        command = [sys.executable, "-m", "pneumorph", *words]
        env = own | {"PNEUMORPH_CACHE": str(tmp_path / "cache")}
        return subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=True)

    warm = run("warm-up")
    assert warm.stderr.count(SAID) == 1 and str(tmp_path / "cache") in warm.stdout
    kept = set((tmp_path / "cache").glob("*-cache"))
    found = run("design", str(tiny), "--iterations", "1")
    assert SAID not in found.stderr and kept == set((tmp_path / "cache").glob("*-cache"))


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


@pytest.fixture
def hits(tmp_path):
    """Computes with a kernel in a process of its own, and says how often one was read from a folder."""
    (tmp_path / "kernel.py").write_text("import numba\n@numba.njit(cache=True)\ndef twice(x):\n    return 2 * x\n")
    path = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])

    def count(**places):
        env = os.environ | {"PYTHONPATH": path} | places
        found = subprocess.run([sys.executable, "-c", ANOTHER], env=env, capture_output=True, text=True)
        assert (found.returncode, found.stderr) == (0, "")
        value, read = found.stdout.split()
        assert value == "42"
        return int(read)

    return count


@pytest.mark.parametrize("spoil", SPOILED)
def test_kernels_that_cannot_be_read_are_compiled_again(tmp_path, hits, spoil):
    folder = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    assert (hits(**folder), hits(**folder)) == (0, 1)
    for file in sorted((tmp_path / "kept").rglob("*.nb?")):
        SPOILED[spoil](file)
    assert (hits(**folder), hits(**folder)) == (0, int(spoil != "a folder"))


def test_where_no_folder_can_be_written_kernels_are_compiled(tmp_path, hits):
    for name in ("file", "__pycache__"):
        (tmp_path / name).touch()
    within = str(tmp_path / "file" / "within")
    assert hits(NUMBA_CACHE_DIR=within, HOME=within, XDG_CACHE_HOME=within, LOCALAPPDATA=within) == 0
