"""Problems with chambers that are filled to a volume or sealed with gas: designs, sweeps, files, mistakes."""

import pytest
from texts import TWO_BESIDE, problem_text
from tiny import tiny

from pneumorph.analysis import analyse_body, run_gradient_check
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.design import starting_design
from pneumorph.mechanics import mirrors_of, rest
from pneumorph.mechanics.assembly.enclosed import volumes_of
from pneumorph.problem import loads

GAS = 'gas = { pressure = "10 kPa", exponent = 1.4 }\n'
BOTH = """
[[task]]
name = "fill"
pressure = {}
volume = { A = "0.12 ml" }
objective = { motion = "bending_y" }
[[task]]
name = "press"
pressure = { A = "30 kPa" }
objective = { motion = "extension" }
[mesh]
size = "6 mm"
"""


def two_beside(rest=BOTH):
    text = problem_text(rest, radius=11, chambers=TWO_BESIDE, body='control_density = "0.3 /mm"')
    return text.replace('name = "B"\n', f'name = "B"\n{GAS}')


@pytest.fixture(scope="module")
def both():
    problem = loads(two_beside())
    return analyse_body(problem, starting_body(problem.tubes))


def test_volumes_and_gases_are_kept(both):
    """A holds what was filled in; p V^γ of B is that at rest in both tasks."""
    fill, press = (both.analysis.equilibria[name] for name in ("fill", "press"))
    assert both.analysis.pressures["fill"]["A"] > 0.005 and both.analysis.pressures["press"]["A"] == 0.03
    at, model = both.analysis.configurations["fill"], both.disc.model
    rest_A, rest_B = volumes_of(model, at.X, rest(model))
    assert fill.volumes["A"] == pytest.approx(rest_A + 120.0, rel=1e-8)
    amounts = [(each.enclosed["B"] + 0.101325) * each.volumes["B"] ** 1.4 for each in (fill, press)]
    assert amounts == pytest.approx([0.111325 * rest_B**1.4] * 2, rel=1e-8)
    assert fill.enclosed["B"] != pytest.approx(press.enclosed["B"], rel=1e-2)
    assert fill.stable and press.stable


def test_the_gradient_of_both(both):
    check = run_gradient_check(both)
    assert check.passed, check
    for test in check.tests.values():
        assert abs(test.rates[-1] - 2.0) < 0.02, test


def test_a_sweep_of_volume_is_that_of_its_pressures():
    design = starting_design(loads(tiny()))
    swept = design.simulate(volumes={"A": "0:0.3:0.15 ml"})
    steps = swept.steps
    assert [step.volumes["A"] - steps[0].volumes["A"] for step in steps] == pytest.approx([0.0, 150.0, 300.0], abs=1e-4)
    pressure = steps[2].pressures["A"]
    back = design.simulate({"A": f"{pressure} MPa"}).steps[0]
    assert back.volumes["A"] == pytest.approx(steps[2].volumes["A"], rel=1e-6)
    assert back.translation == pytest.approx(steps[2].translation, abs=1e-4)
    assert steps[0].pressures["A"] == pytest.approx(0.0, abs=1e-9) and steps[0].translation[2] == pytest.approx(
        0.0, abs=1e-6
    )
    assert swept.plot().axes[0].get_xlabel() == "volume of A, ml"


def test_what_is_sealed_has_no_pressure_of_its_own():
    design = starting_design(loads(two_beside()))
    for options in ({"pressures": {"B": "3 kPa"}}, {"volumes": {"B": "1 ml"}}):
        with pytest.raises(ProblemError, match='"B" is sealed'):
            design.prepare_simulation(**options)
    with pytest.raises(ProblemError, match="follow"):
        design.explorer()


def test_files_keep_them_and_parts_do_not_share_them():
    problem = loads(two_beside())
    again = loads(problem.to_toml())
    assert again == problem and again.task[0].volumes == {"A": 120.0}
    assert again.body.chamber[1].gas.pressure == 0.01 and again.body.chamber[1].gas.exponent == 1.4
    mirrored = 'symmetry = { mirror = ["xz", "yz"] }\n[[body.chamber]]'
    alike = two_beside().replace(GAS, "").replace("[[body.chamber]]", mirrored, 1)
    assert mirrors_of(loads(alike)) == ("xz",)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('volume = { A = "0.12 ml" }', 'volume = { C = "0.12 ml" }', "task[0].volume.C"),
        ('volume = { A = "0.12 ml" }', 'volume = { B = "0.12 ml" }', "task[0].volume.B"),
        ('pressure = { A = "30 kPa" }', 'pressure = { B = "30 kPa" }', "task[1].pressure.B"),
        ("pressure = {}", 'pressure = { A = "1 kPa" }', "task[0].pressure.A"),
        ('pressure = "10 kPa"', 'pressure = "-200 kPa"', "body.chamber[1].gas.pressure"),
        ("exponent = 1.4", "exponent = 0.5", "body.chamber[1].gas.exponent"),
        ("[mesh]", "[contact]\n[mesh]", "contact"),
    ],
)
def test_mistakes_name_their_key(old, new, key):
    with pytest.raises(ProblemError) as error:
        loads(two_beside().replace(old, new))
    assert str(error.value).removeprefix("problem: ").startswith(key), error.value
