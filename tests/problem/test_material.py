"""Models of rubber in the problem file: what is read, and that what is written reads back."""

import json
import tomllib

import jsonschema
import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from texts import EXTEND, problem_text

from pneumorph.errors import ProblemError
from pneumorph.mechanics import rubber_of
from pneumorph.mechanics.material.homogeneous import nominal_stress
from pneumorph.problem import loads
from pneumorph.problem.doubts import doubts
from pneumorph.problem.material import Material, elastomer, library
from pneumorph.problem.scaled import scaled
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


STATED = 'density = "1.1 g/cm^3"\n'


@pytest.mark.parametrize(
    ("keys", "shear", "bulk"),
    [
        ('youngs_modulus = "0.3 MPa"\npoisson = 0.49', 0.3 / 2.98, 0.3 / 0.06),
        ('youngs_modulus = "70 kPa"\npoisson_ratio = 0.49', 0.07 / 2.98, 0.07 / 0.06),
        ('youngs_modulus = "0.3 MPa"\npoisson = "incompressible"', 0.1, 100.0),
        # 0.43 of Gent's 1.147 MPa over three.
        ('shore = "A 30"', 0.43 * 1.14670 / 3, 430 * 1.14670 / 3),
        ('shore = "shore a30"', 0.43 * 1.14670 / 3, 430 * 1.14670 / 3),
        ('shore = "30A"', 0.43 * 1.14670 / 3, 430 * 1.14670 / 3),
        ('shore = "A-30"', 0.43 * 1.14670 / 3, 430 * 1.14670 / 3),
    ],
)
def test_rubbers_of_which_only_the_stiffness_is_known(keys, shear, bulk):
    text = problem_text(EXTEND, material=f"{keys}\n{STATED}")
    problem = loads(text)
    assert problem.material.model == "neo-hookean"
    assert problem.material.shear_modulus == pytest.approx(shear, rel=2e-3)
    assert problem.material.bulk_modulus == pytest.approx(bulk, rel=2e-3)
    assert loads(problem.to_toml()) == problem


@pytest.mark.parametrize("text", ['youngs_modulus = "0.3 MPa"\npoisson = 0.4', 'shore = "A 30"'])
def test_the_schema_knows_them(text):
    written = tomllib.loads(problem_text(EXTEND, material=f"{text}\n{STATED}"))
    jsonschema.Draft202012Validator(json.loads(json_schema())).validate(written)


@pytest.mark.parametrize(
    ("keys", "key", "said"),
    [
        ('youngs_modulus = "0.3 MPa"', "material.poisson", "incompressible"),
        ('youngs_modulus = "0.3 MPa"\npoisson = 0.7', "material.poisson", "0.7"),
        ('youngs_modulus = "1 MPa"\nshear_modulus = "1 MPa"', "material.youngs_modulus", "shear_modulus"),
        ('youngs_modulus = "0.3 MPa"\npoisson = 0.1', "material.poisson", "compressible = true"),
        ('youngs_modulus = "0.3 MPa"\npoisson_ratio = 0.1', "material.poisson_ratio", "compressible = true"),
        ('youngs_modulus = 0.3\npoisson = 0.49', "material.youngs_modulus", "unit"),
        ('youngs_modulus = "-1 MPa"\npoisson = 0.49', "material.youngs_modulus", "above zero"),
        ('youngs_modulus = "300 GPa"\npoisson = 0.49', "material.youngs_modulus", "unit"),
        ('youngs_modulus = "0.1 Pa"\npoisson = 0.49', "material.youngs_modulus", "unit"),
        ('shear_modulus = "100 GPa"\nbulk_modulus = "200 TPa"', "material.shear_modulus", "unit"),
        ('shore = "D 30"', "material.shore", "hard plastics"),
        ('shore = "00 30"', "material.shore", "library"),
        ('shore = "00-30"', "material.shore", "library"),
        ('shore = "30 00"', "material.shore", "library"),
        ('shore = "300"', "material.shore", "A 90"),
        ('model = "polynomial"\nc10 = "1 MPa"', "material.model", "mooney-rivlin is a polynomial"),
        ('shore = "A 130"', "material.shore", "A 90"),
        ('shore = 30', "material.shore", "A 30"),
        # The hint is a thousand times the shear modulus, 0.22 MPa.
        ('model = "yeoh"\ncoefficients = ["0.11 MPa", "0.02 MPa"]', "material.bulk_modulus", "220 MPa"),
        ('shear_modulus = "0.5 MPa"', "material.bulk_modulus", "500 MPa"),
        ('model = "yeoh"\ncoefficients = ["0.11 MPa"]\nbulk_modulus = "0.49 MPa"', "material.bulk_modulus", "220 MPa"),
    ],
)  # fmt: skip
def test_hints_never_make_wrong_physics(keys, key, said):
    with pytest.raises(ProblemError) as caught:
        loads(problem_text(EXTEND, material=f"{keys}\n{STATED}"))
    assert any(line.startswith(f"{key}: ") and said in line for line in caught.value.faults), caught.value.faults


def test_beside_a_name_of_the_library_stands_how_far_the_batch_scatters():
    own = elastomer("Ecoflex 00-30")
    given = TypeAdapter(Material).validate_python({"name": "Ecoflex 00-30", "scatter": 0.05})
    assert given.scatter == 0.05 and given.model_copy(update={"scatter": own.scatter}) == own
    with pytest.raises(ValidationError, match="in place of the name") as caught:
        TypeAdapter(Material).validate_python({"name": "Ecoflex 00-30", "covariance": [[0.01]]})
    assert len(caught.value.errors()) == 1


def test_a_modulus_of_hard_plastic_is_doubted():
    def doubted(young):
        material = f'youngs_modulus = "{young}"\npoisson = 0.49\n{STATED}'
        return list(doubts(loads(problem_text(EXTEND, material=material))))

    assert doubted("2 MPa") == [] and len(doubted("150 MPa")) == 1


def test_a_foam_is_confirmed():
    keys = 'shear_modulus = "0.1 MPa"\nbulk_modulus = "0.2 MPa"\ncompressible = true'
    assert loads(problem_text(EXTEND, material=f"{keys}\n{STATED}")).material.bulk_modulus == 0.2


def test_five_terms_are_as_their_derivatives_say():
    keys = 'model = "mooney-rivlin"\nc10 = "-0.233 MPa"\nc01 = "2.562 MPa"\nc20 = "0.116 MPa"\nc11 = "-0.561 MPa"\n'
    rubber = rubber_of(
        loads(problem_text(EXTEND, material=f'{keys}c02 = "0.9 MPa"\nbulk_modulus = "400 MPa"\n{STATED}')).material
    )
    stretch = np.array([0.7, 1.2, 1.6])
    first, second = stretch**2 + 2 / stretch, 2 * stretch + stretch**-2
    by_first = -0.233 + 2 * 0.116 * (first - 3) - 0.561 * (second - 3)
    by_second = 2.562 - 0.561 * (first - 3) + 2 * 0.9 * (second - 3)
    expected = 2 * (stretch - stretch**-2) * (by_first + by_second / stretch)
    np.testing.assert_allclose(
        nominal_stress(rubber.isochoric, np.array(rubber.parameters[:-1]), stretch), expected, rtol=1e-9
    )


@pytest.mark.parametrize(
    ("rows", "word"),
    [
        ("[[1e-4]]", "2 rows and columns, for c1, c2"),
        ("[[1e-4, 2e-5], [1e-5, 1e-4]]", "symmetric"),
        ("[[1e-4, 2e-4], [2e-4, 1e-4]]", "negative variance"),
        ("[[1e-4, nan], [nan, 1e-4]]", "finite|number"),
    ],
)
def test_a_covariance_that_the_constants_cannot_have_is_refused(rows, word):
    with pytest.raises(ProblemError, match=word) as refused:
        loads(problem_text(EXTEND, material=YEOH + f"covariance = {rows}"))
    assert "material.covariance" in str(refused.value)


YEOH = 'model = "yeoh"\ncoefficients = ["0.2 MPa", "0.01 MPa"]\nbulk_modulus = "20 MPa"\ndensity = "1.1 g/cm^3"\n'


def test_a_covariance_is_read_written_and_kept_where_moduli_are_scaled():
    problem = loads(problem_text(EXTEND, material=YEOH + "covariance = [[1e-4, 2e-5], [2e-5, 4e-3]]"))
    assert loads(problem.to_toml()).material == problem.material
    stiffer = scaled(problem.material, 2.0, name="stiffer", source="")
    assert stiffer.covariance == problem.material.covariance and stiffer.coefficients[0] == pytest.approx(0.4)
