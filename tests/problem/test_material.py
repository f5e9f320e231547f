"""Models of rubber in the problem file: what is read, and that what is written reads back."""

import json
import tomllib

import jsonschema
import pytest
from pydantic import TypeAdapter
from texts import EXTEND, problem_text

from pneumorph.mechanics import rubber_of
from pneumorph.problem import loads
from pneumorph.problem.material import Material, library
from pneumorph.problem.schema import json_schema

COMMON = 'bulk_modulus = "50 MPa"\ndensity = "1 g/cm^3"\nvalid_stretch = 4.0\n'
TABLES = {
    "neo-hookean": 'shear_modulus = "0.3 MPa"',
    "mooney-rivlin": 'c10 = "120 kPa"\nc01 = "-0.01 MPa"',
    "yeoh": 'coefficients = ["0.11 MPa", "0.02 MPa", "-1 kPa"]',
    "gent": 'shear_modulus = "0.3 MPa"\nlimit = 30',
    "arruda-boyce": 'shear_modulus = "0.3 MPa"\nlocking_stretch = 3.5',
    "ogden": 'terms = [{ modulus = "0.4 MPa", exponent = 1.8 }, { modulus = "-1 kPa", exponent = -2 }]',
}


@pytest.mark.parametrize("model", TABLES)
def test_models_read_back_and_are_as_stiff_as_they_say(model):
    text = problem_text(EXTEND, material=f'model = "{model}"\n{TABLES[model]}\n{COMMON}')
    problem = loads(text)
    assert loads(problem.to_toml()) == problem
    rubber = rubber_of(problem.material)
    assert rubber.shear_modulus == pytest.approx(problem.material.initial_shear_modulus, rel=1e-9)
    assert (rubber.bulk_modulus, rubber.density) == (50.0, 1e-9)
    assert rubber.valid_stretch is not None and rubber.valid_stretch <= 4.0
    validator = jsonschema.Draft202012Validator(json.loads(json_schema()))
    validator.validate(tomllib.loads(text))
    validator.validate(tomllib.loads(problem.to_toml()))
    assert not validator.is_valid(tomllib.loads(text.replace(f'"{model}"', '"rubber"')))


def test_without_a_model_it_is_neo_hookean():
    plain = loads(problem_text(EXTEND, material=f'shear_modulus = "0.3 MPa"\n{COMMON}')).material
    assert plain.model == "neo-hookean"


@pytest.mark.parametrize("name", library())
def test_every_name_of_the_library(name):
    problem = loads(problem_text(EXTEND, material=f'name = "{name}"'))
    assert problem.material.name == name
    assert loads(problem.to_toml()) == problem
    assert TypeAdapter(Material).validate_python({"name": name}) == problem.material
