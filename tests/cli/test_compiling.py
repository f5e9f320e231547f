"""A command says once that it compiles, where nothing compiled before is at hand."""

import json
import os
import subprocess
import sys

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
    assert (first.stderr, again.stderr) == (SAID, "")
    assert SAID not in first.stdout and len(json.loads(steps.read_text())["steps"]) == 1
    assert simulated("other", "--quiet").stderr == ""


def test_help_compiles_nothing():
    found = subprocess.run([sys.executable, "-m", "pneumorph", "--help"], capture_output=True, text=True, check=True)
    assert found.stderr == ""


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
