"""Objectives that users write: good ones, and one line for every way to get them wrong."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.objective import Features, build_objectives
from pneumorph.objective.kinds import custom, trial
from pneumorph.problem import load, loads
from pneumorph.run import create, open_run
from pneumorph.study import load_study

GOOD = '''"""Volume for motion."""
import jax.numpy as jnp

SCALE = 1e-3


def cost(f):
    bent = jnp.sum(f.section_rotation[:, 0, 2] ** 2)
    return SCALE * f.volume["A"] - f.translation[2] + bent + f.rotation[1] ** 2
'''
FILE = tiny(objective='{ kind = "custom", file = "cost.py", function = "cost", sections = 3 }')


def some_features(sections=3):
    turns = jnp.broadcast_to(jnp.eye(3), (sections, 3, 3)).at[0, 0, 2].set(0.5)
    return Features(jnp.array([0, 0, 2.0]), jnp.array([0, 0.3, 0]), {"A": jnp.array(1500.0)}, turns[:, 0], turns)


def tried_here(asked):
    """As it is tried in a process of its own, whose start takes seconds."""
    try:
        found = custom.shape_of(asked)
    except BaseException as error:
        found = "code", trial.words_of(error)
    return found and trial.Fault(*found)


@pytest.fixture
def written(tmp_path):
    """The problem file with a file of code beside it."""

    def write(code=GOOD, text=FILE):
        (tmp_path / "cost.py").write_text(code, encoding="utf-8")
        (tmp_path / "arm.toml").write_text(text, encoding="utf-8")
        return tmp_path / "arm.toml"

    return write


def test_a_function_is_an_objective_with_its_gradient(written):
    found = build_objectives(load(written(), trust=True))["extend"]
    assert len(found.slabs.middle) == 3
    value, slope = jax.value_and_grad(found.value)(some_features())
    assert float(value) == pytest.approx(1.5 - 2.0 + 0.25 + 0.09)
    np.testing.assert_allclose(slope.translation, [0, 0, -1])
    np.testing.assert_allclose(slope.rotation, [0, 0.6, 0], atol=1e-15)
    assert float(slope.volume["A"]) == 1e-3
    assert float(slope.section_rotation[0, 0, 2]) == 1.0 and float(jnp.abs(slope.section_rotation[1:]).max()) == 0.0


def test_the_file_is_beside_the_problem_and_not_where_one_stands(written, monkeypatch, tmp_path):
    path = written()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert load(path, trust=True).task[0].objective.code == GOOD
    (tmp_path / "study.toml").write_text('base = "arm.toml"\n[grid]\n"mesh.size" = ["5 mm", "6 mm"]\n')
    for member in load_study(tmp_path / "study.toml", trust=True).members:
        assert member.problem.task[0].objective.code == GOOD


def test_a_run_has_the_code_in_its_problem(written, tmp_path):
    path = written(GOOD + "# ‖log R‖ \t \\n \"quoted\" '''thrice'''\n")
    asked = load(path, trust=True)
    create(tmp_path / "run", asked)
    (tmp_path / "cost.py").unlink()
    assert open_run(tmp_path / "run").problem == asked
    assert float(
        build_objectives(open_run(tmp_path / "run").problem)["extend"].value(some_features())
    ) == pytest.approx(-0.16)


@pytest.mark.parametrize(
    ("code", "key", "said"),
    [
        ("def cost(f:\n    return 1.0\n", "code", "SyntaxError in line 1"),
        ("import jax.numpy as jnp\n\ndef kost(f):\n    return 1.0\n", "function", 'has no function "cost"'),
        ("cost = 3.0\n", "function", 'has no function "cost"'),
        ("import numpy_of_mine\n", "code", "ModuleNotFoundError in line 1"),
        ("def cost(f):\n    return f.translation\n", "function", "an array of shape (3,)"),
        ("def cost(f):\n    return f.translation > 0\n", "function", "of shape (3,) and type bool"),
        ("def cost(f):\n    return 1\n", "function", "make it return one real number"),
        ("def cost(f):\n    return None\n", "function", "cost returns nothing; make it"),
        ("def cost(f):\n    return\n", "function", "returns nothing"),
        ("def cost(f):\n    x = 1.0\n\n    return x * f.speed[2]\n", "code", "AttributeError in line 4"),
        ('def cost(f):\n    return f.volume["B"]\n', "code", "KeyError in line 2"),
        ("def cost(f):\n    return f.section_rotation @ f.translation[:2]\n", "code", "TypeError in line 2"),
        ("exit()\n", "code", "SystemExit in line 1"),
        ("def cost():\n    return 1.0\n", "code", "TypeError"),
        ("def cost(f):\n    return f.translation[2] if f.rotation[1] > 0 else 0.0\n", "code", "in line 2"),
        ("def cost(f):\n    raise ValueError('two\\nlines')\n", "code", "ValueError in line 2 (two lines)"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(written, monkeypatch, code, key, said):
    monkeypatch.setattr(custom, "fault_of", tried_here)
    asked = load(written(code), trust=True)
    with pytest.raises(ProblemError) as caught:
        build_objectives(asked)
    message = str(caught.value)
    assert message.startswith(f"task[0].objective.{key}: ") and said in message and "\n" not in message


@pytest.mark.parametrize(
    ("table", "key", "said"),
    [
        ('file = "none.py"', "file", "none.py cannot be read (No such file or directory)"),
        ('file = "."', "file", "cannot be read (Is a directory)"),
        ('file = "latin.py"', "file", "it is not UTF-8 text"),
        ("file = 3", "file", "should be the name of a Python file"),
        ('file = "cost.py", code = "x = 1"', "file", "is given together with code"),
        ('function = "cost"', "code", 'is missing; add a file next to the problem file, e.g. file = "objective.py"'),
        ('file = "cost.py", sections = -1', "sections", "out of range"),
        ('file = "cost.py", weight = 2.0', "weight", "unknown key"),
    ],
)
def test_what_is_wrong_with_the_table(written, tmp_path, table, key, said):
    (tmp_path / "latin.py").write_bytes("# Körper".encode("latin-1"))
    path = written(text=tiny(objective=f'{{ kind = "custom", {table} }}'))
    with pytest.raises(ProblemError) as caught:
        load(path)
    message = str(caught.value)
    assert message.startswith(f"task[0].objective.{key}: ") and said in message and "\n" not in message


ENDLESS = "takes more than 3 s of processor time"
CALLED = "def cost(f):\n    {}\n    return f.translation[2]\n"
STRANGE = {
    "a sum in C": ("sum(range(10**15))\n", ENDLESS),
    "a wait": (CALLED.format("import time; time.sleep(1e6)"), ENDLESS),
    "an end": (CALLED.format("import os; os._exit(0)"), "ends the process in which it is loaded (status 0)"),
    "a crash": ("import ctypes\nctypes.string_at(0)\n", "ends the process in which it is loaded"),
    "KeyboardInterrupt": (CALLED.format("raise KeyboardInterrupt"), "KeyboardInterrupt in line 2"),
    "memory": ("x = bytearray(40 * 10**9)\n", "takes more than 2 GB of memory"),
}


@pytest.mark.parametrize("name", STRANGE)
def test_code_that_does_anything_is_refused(monkeypatch, name):
    monkeypatch.setattr(trial, "CHILD", trial.CHILD.replace("trial.main", "trial.WALL = 4; trial.main"))
    code, said = STRANGE[name]
    asked = loads(FILE.replace('file = "cost.py"', f"code = {json.dumps(code)}"))
    with pytest.raises(ProblemError) as caught:
        build_objectives(asked)
    assert str(caught.value).startswith("task[0].objective.code: ") and said in str(caught.value)


def test_code_finds_modules_where_the_program_does(monkeypatch, tmp_path):
    (tmp_path / "beside.py").write_text("SCALE = 2.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    code = "import beside\ndef cost(f):\n    print(1)\n    return beside.SCALE * f.translation[2]\n"
    asked = loads(FILE.replace('file = "cost.py"', f"code = {json.dumps(code)}"))
    assert float(build_objectives(asked)["extend"].value(some_features())) == 4.0


def test_a_text_without_a_place_looks_in_the_working_directory(written, monkeypatch):
    monkeypatch.chdir(written().parent)
    assert loads(FILE).task[0].objective.code == GOOD
