"""Good problem files: what is read from them, what is written, and the schema that describes them."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from texts import TWO_BESIDE, problem_text
from tiny import tiny

from pneumorph.errors import ProblemError, Renamed
from pneumorph.problem import load, loads
from pneumorph.problem.schema import SHIPPED, json_schema

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(FOLDER.glob("*.toml"))

BEND = """
[[task]]
name = "bend"
pressure = { B = { start = "30 kPa", min = "0 kPa", max = "60 kPa" } }
objective = { motion = "-bending_y" }
"""
LEAST = problem_text(BEND, 80, 12, TWO_BESIDE)


def test_inside_units_and_defaults():
    problem = loads(LEAST)
    rubber = problem.material
    assert (rubber.model, rubber.shear_modulus, rubber.bulk_modulus, rubber.density) == (
        "neo-hookean",
        0.49,
        4.8,
        1.1e-9,
    )
    assert problem.body.control_density == 0.6
    assert problem.body.chamber[0].span == (3.0, 77.0)
    assert problem.body.ripple is None
    assert problem.gravity is None
    assert problem.end_effector.kind == "plate"
    limits = problem.limits
    assert (limits.wall, limits.fold.distance, limits.fold.neighbourhood) == (2.0, 1.0, 2.0)
    assert (limits.curvature, limits.skew, limits.stretch.limit, limits.stretch.form) == (0.3, 0.2, 0.1, "per_mm")
    assert limits.envelope is None


def test_pressures_and_objective():
    task = loads(LEAST).task[0]
    assert list(task.pressure) == ["A", "B"]
    a, b = task.pressure["A"], task.pressure["B"]
    assert (a.start, a.free) == (0.0, False)
    assert (b.start, b.min, b.max, b.free) == (0.03, 0.0, 0.06, True)
    assert (task.objective.sign, task.objective.component) == (-1.0, "bending_y")


def test_gravity_direction_is_a_unit_vector():
    text = LEAST + '[gravity]\nacceleration = "9.81 m/s^2"\ndirection = [3, 0, -4]\n'
    gravity = loads(text).gravity
    assert gravity is not None
    assert gravity.acceleration == 9810.0
    assert gravity.direction == pytest.approx((0.6, 0.0, -0.8), abs=1e-15)


@pytest.mark.parametrize("length", [5e-324, 1e-200, 1e308])
def test_directions_of_any_length_are_normalised(length):
    gravity = loads(LEAST + f"[gravity]\ndirection = [0, {length!r}, {length!r}]\n").gravity
    assert gravity is not None
    assert gravity.direction == pytest.approx((0.0, 0.5**0.5, 0.5**0.5), abs=1e-15)


def test_stretch_as_printed():
    text = LEAST + '[limits]\nstretch = { limit = "0.2 /mm^2", form = "printed" }\n'
    assert loads(text).limits.stretch.form == "printed"


def test_a_rubber_of_ones_own():
    own = 'shear_modulus = "0.1 MPa"\nbulk_modulus = "50 MPa"\ndensity = "1070 kg/m^3"'
    rubber = loads(LEAST.replace('name = "Hei-Cast 8400"', own)).material
    assert (rubber.shear_modulus, rubber.bulk_modulus, rubber.density) == (0.1, 50.0, 1.07e-9)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_sound_and_round_trip(path):
    problem = load(path)
    assert loads(problem.to_toml()) == problem


lengths = st.floats(20, 200)


@given(
    length=lengths,
    radius=st.floats(9, 30),
    share=st.floats(0.3, 0.7),
    direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(any),
    pressure=st.floats(-0.1, 0.5),
    stiffness=st.floats(0, 1e6),
    density=st.floats(1e-10, 1e-8),
)
def test_written_problems_read_back_exactly(length, radius, share, direction, pressure, stiffness, density):
    problem = loads(f"""
title = "ρ, “quotes” and \\\\ in a title"
gravity = {{ direction = [{", ".join(repr(part) for part in direction)}] }}
[material]
name = "own"
shear_modulus = "0.3 MPa"
bulk_modulus = "3 MPa"
density = "{density!r} t/mm^3"
[body]
length = "{length!r} mm"
radius = "{radius!r} mm"
[[body.chamber]]
name = "a-1"
radius = "{share * radius!r} mm"
center = ["0 mm", "0 mm"]
span = ["2 mm", "{length - 2!r} mm"]
[end_effector]
spring = {{ torsion = "{stiffness!r} N*mm/rad" }}
[[task]]
name = "t"
pressure = {{ a-1 = "{pressure!r} MPa" }}
objective = {{ motion = "+twist" }}
""")
    assert problem.task[0].pressure["a-1"].start == pressure
    assert problem.material.density == density
    assert loads(problem.to_toml()) == problem


def test_shipped_schema_is_what_the_models_generate():
    """After a change of the models: python -m pneumorph.problem.schema."""
    assert SHIPPED.read_text(encoding="utf-8") == json_schema()


def test_schema_describes_the_file():
    schema = json.loads(json_schema())
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for text in [LEAST, *(path.read_text(encoding="utf-8") for path in EXAMPLES)]:
        validator.validate(tomllib.loads(text))
        validator.validate(tomllib.loads(loads(text, folder=EXAMPLES[0].parent).to_toml()))
    for wrong in ("length = 80", 'length = "-80 mm"', 'lenght = "80 mm"', ""):
        assert not validator.is_valid(tomllib.loads(LEAST.replace('length = "80 mm"', wrong)))


def test_schema_knows_the_file_of_an_objective():
    validator = jsonschema.Draft202012Validator(json.loads(json_schema()))
    table = tomllib.loads(LEAST)
    for source, valid in (
        ({"file": "a.py"}, True),
        ({"code": "…"}, True),
        ({"file": "a.py", "code": "…"}, False),
        ({}, False),
    ):
        table["task"][0]["objective"] = {"kind": "custom", **source}
        assert validator.is_valid(table) == valid


def test_schema_states_defaults_as_the_file_would():
    definitions = json.loads(json_schema())["$defs"]
    assert definitions["Limits"]["properties"]["wall"]["default"] == "2 mm"
    assert definitions["BodySpec"]["properties"]["control_density"]["default"] == "0.6 /mm"


def test_springs_and_motions_are_read_by_each_others_names():
    text = (FOLDER / "linear_spring.toml").read_text(encoding="utf-8")
    assert 'motion = "extension"' in text
    assert "axial =" in text
    other = text.replace('motion = "extension"', 'motion = "-axial"').replace("axial =", "extension =")
    problem = loads(other)
    assert problem.end_effector.spring.axial == loads(text).end_effector.spring.axial > 0
    assert problem.task[0].objective.motion == "-extension"
    with pytest.raises(ProblemError, match=r"end_effector\.spring\.extension: is the same as axial; give only one"):
        loads(text.replace("axial =", 'extension = "1 N/mm", axial ='))


def test_the_old_name_of_the_method_is_read_with_a_sentence():
    text = (FOLDER / "linear.toml").read_text(encoding="utf-8").replace('"sqp"', '"lbfgs"')
    with pytest.warns(Renamed, match='"lbfgs" is now called "sqp"'):
        assert loads(text).optimizer.method == "sqp"


def test_limits_on_states_that_a_problem_has_by_default():
    """Each follows what it depends on until it is given, and is written out."""
    asked = load(FOLDER / "small.toml")
    assert (asked.limits.margin, asked.limits.strain) == (1.15, "off")
    assert loads(asked.to_toml()) == asked
    soft = asked.with_changes({"material.name": "Ecoflex 00-30"})
    assert soft.limits.strain == 1.0
    assert soft.with_changes({"material.name": "Hei-Cast 8400"}).limits.strain == "off"
    assert soft.with_changes({"limits.strain": "off"}).limits.strain == "off"
    chamber = asked.body.chamber[0].name
    vacuum = asked.with_changes({f"task[0].pressure.{chamber}": "-20 kPa"})
    assert vacuum.limits.margin == 1.0
    free = {"start": "-20 kPa", "min": "-30 kPa", "max": "10 kPa"}
    assert vacuum.with_changes({f"task[0].pressure.{chamber}": free}).limits.margin == 1.15
    assert asked.with_changes({"limits.margin": 1}).limits.margin == 1.0


@pytest.mark.parametrize(
    ("key", "value"), [("strain", 0), ("strain", "no"), ("strain", True), ("margin", 0.9), ("margin", "off")]
)
def test_what_limits_on_states_cannot_be(key, value):
    with pytest.raises(ProblemError, match=rf"^limits\.{key}: "):
        load(FOLDER / "small.toml").with_changes({f"limits.{key}": value})


def test_less_than_a_vacuum_is_refused_in_one_line():
    asked = loads(tiny())
    key = "task[0].pressure.A"
    assert asked.with_changes({key: "-101 kPa"})
    for low, at in (("-150 kPa", key), ({"start": "0 kPa", "min": "-2 bar", "max": "1 kPa"}, f"{key}.min")):
        with pytest.raises(ProblemError, match="below a vacuum") as caught:
            asked.with_changes({key: low})
        assert [str(fault).partition(":")[0] for fault in caught.value.faults] == [at]
