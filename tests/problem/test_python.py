"""Problems made and changed in Python."""

import pint
import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem, loads
from pneumorph.units import text_of

u = pint.UnitRegistry()
PROBLEM = loads(tiny())
TABLES = {
    "material": {"name": "Hei-Cast 8400"},
    "body": {
        "length": 2.4 * u.cm,
        "radius": u.Quantity(8, "mm"),
        "control_density": 0.3 / u.mm,
        "chamber": [{"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", 21 * u.mm]}],
    },
    "task": [{"name": "extend", "pressure": {"A": 60 * u.kPa}, "objective": {"motion": "extension"}}],
}


def test_quantities_of_pint_and_as_text_are_the_same():
    made = Problem(**TABLES, title="Tiny", mesh={"size": "6 mm"}, optimizer={"iterations": 2})
    assert made == PROBLEM
    assert loads(made.to_toml()) == made
    spring = Problem(**TABLES, end_effector={"spring": {"bending_y": 100 * u.N * u.mm / u.rad}})
    assert spring.end_effector.spring.bending_y == 100.0
    heavy = Problem(**TABLES, gravity={"acceleration": 9.81 * u.m / u.s**2, "direction": [0, 0, -1]})
    assert heavy.gravity.acceleration == 9810.0


def test_text_stays_text():
    assert text_of("60 kPa") == "60 kPa"
    assert text_of(0.3 / u.mm**2) == "0.3 1/millimeter^2"


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({}, "material: is missing"),
        ({**TABLES, "colour": "red"}, "colour: unknown key"),
        ({**TABLES, "body": {**TABLES["body"], "length": 24}}, "body.length: the number 24 has no unit"),
        ({**TABLES, "body": {**TABLES["body"], "length": 24 * u.kPa}}, "is not a unit of a length"),
        ({**TABLES, "body": {**TABLES["body"], "radius": "3 mm"}}, "body.chamber"),
    ],
)
def test_what_does_not_fit_is_one_line(tables, words):
    with pytest.raises(ProblemError) as caught:
        Problem(**tables)
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_changes():
    changed = PROBLEM.with_changes(
        {
            "end_effector.spring.axial": "4 N/mm",
            "task[0].pressure.A": {"start": "30 kPa", "min": "0 kPa", "max": 60 * u.kPa},
            "body.ripple": {"amplitude": "0.2 mm", "period": "12 mm"},
            "optimizer.iterations": 7,
        }
    )
    assert changed.end_effector.spring.axial == 4.0
    assert changed.task[0].pressure["A"].free and changed.task[0].pressure["A"].max == 0.06
    assert changed.body.ripple.amplitude == 0.2 and changed.optimizer.iterations == 7
    assert PROBLEM.with_changes({}) == PROBLEM, "what is not changed stays to the last bit"
    assert changed.with_changes({"body.ripple": False}).body.ripple is None
    assert PROBLEM.end_effector.spring.axial == 0.0, "the problem itself is not changed"


def test_another_elastomer_takes_its_own_parameters():
    other = PROBLEM.with_changes({"material.name": "Ecoflex 00-30"})
    table = PROBLEM.model_dump()
    del table["limits"]["strain"]  # a default that follows from the rubber
    assert other == Problem.model_validate({**table, "material": {"name": "Ecoflex 00-30"}})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"body.lenth": "24 mm"}, 'body.lenth: unknown key; did you mean "length"?'),
        ({"task[3].weight": 2.0}, "there is no entry [3]; the list has 1"),
        ({"task..name": "x"}, "is not a key of a problem"),
        ({"mesh.size.x": "1 mm"}, 'there is no table to hold "x"'),
        ({"material.name": "steel"}, "material"),
        ({"limits.wall": "20 mm"}, "limits.wall"),
    ],
)
def test_changes_that_do_not_fit(changes, words):
    with pytest.raises(ProblemError) as caught:
        PROBLEM.with_changes(changes)
    assert words in str(caught.value)
