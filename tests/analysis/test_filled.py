"""Problems with chambers that are filled to a volume or sealed with gas: designs, sweeps, files, mistakes."""

from dataclasses import replace

import pytest
from designing import BRIEFLY
from texts import TWO_BESIDE, problem_text
from tiny import tiny

from pneumorph.analysis import analyse_body, collect_fields, collect_task_results, motion_rates, run_gradient_check
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.design import starting_design
from pneumorph.mechanics import Equilibrium, Tangent, contact_forces, mirrors_of, rest, solve, whole_of
from pneumorph.mechanics.assembly.enclosed import volumes_of
from pneumorph.optimize import DesignAccepted, design
from pneumorph.output.export import export
from pneumorph.problem import loads

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

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


PLATE = """
[[obstacle]]
name = "plate"
kind = "plane"
point = ["11.6 mm", "0 mm", "0 mm"]
normal = [-1, 0, 0]
"""
PRESSING = BOTH.replace('objective = { motion = "bending_y" }', 'objective = { kind = "press", obstacle = "plate" }')


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


@pytest.fixture(scope="module")
def pressing():
    problem = loads(two_beside(PRESSING + PLATE).replace("0.12 ml", "0.35 ml"))
    return analyse_body(problem, starting_body(problem.tubes))


def test_what_is_filled_presses_as_at_the_pressure_found(pressing):
    at, found = pressing.analysis.configurations["fill"], pressing.analysis.equilibria["fill"]
    rest_A, rest_B = volumes_of(pressing.disc.model, at.X, rest(pressing.disc.model))
    assert found.volumes["A"] == pytest.approx(rest_A + 350.0, rel=1e-7) and found.stable
    force = contact_forces(at, found.state).normal["plate"]
    assert force > 0.02
    same = replace(at, enclosed=None)
    again = solve(same, Tangent(pressing.disc.model), found.state)
    assert isinstance(again, Equilibrium)
    assert contact_forces(same, again.state).normal["plate"] == pytest.approx(force, rel=1e-4)
    results = collect_task_results(pressing.disc, pressing.analysis)["fill"]
    assert results.gas == {"B": pytest.approx(rest_B * 0.111325 / 0.101325, rel=1e-9)}
    assert results.pressures == pytest.approx(found.enclosed)


def test_the_gradient_where_it_presses(pressing):
    check = run_gradient_check(pressing)
    assert check.passed, check
    for test in check.tests.values():
        assert abs(test.rates[-1] - 2.0) < 0.02, test


def test_a_state_is_found_again_as_it_was(pressing):
    """The pressure of gas is that of its volume, so that nothing is left to be corrected."""
    for name, found in pressing.analysis.equilibria.items():
        at = pressing.analysis.configurations[name]
        again = solve(at, Tangent(pressing.disc.model), found.state)
        assert isinstance(again, Equilibrium) and again.factorisations <= 1
        assert (pressing.disc.model.vector(again.state) == pressing.disc.model.vector(found.state)).all()


def test_an_input_file_has_the_pressures_found_and_says_so(both, tmp_path):
    """And a design knows that they are not its problem's."""
    for name in ("fill", "press"):
        path, found = tmp_path / f"{name}.inp", collect_task_results(both.disc, both.analysis)[name].pressures
        export(path, "inp", both.problem, collect_fields(both.disc, both.analysis), found, name)
        lines = path.read_text().splitlines()
        told = [line.split()[2] for line in lines if line.startswith("** chamber")]
        assert told == (["A", "B"] if name == "fill" else ["B"])
        last = [line for line in lines[: lines.index("*END STEP")] if ", P" in line][-1]
        assert float(last.split(", ")[2]) == pytest.approx(found["B"])
    start = starting_design(both.problem)
    assert start.has_found_pressures("press") and not starting_design(loads(tiny())).has_found_pressures()


def test_a_sweep_of_volume_is_that_of_its_pressures():
    start = starting_design(loads(tiny()))
    swept = start.simulate(volumes={"A": "0:0.3:0.15 ml"})
    steps = swept.steps
    assert [step.volumes["A"] - steps[0].volumes["A"] for step in steps] == pytest.approx([0.0, 150.0, 300.0], abs=1e-4)
    pressure = steps[2].pressures["A"]
    back = start.simulate({"A": f"{pressure} MPa"}).steps[0]
    assert back.volumes["A"] == pytest.approx(steps[2].volumes["A"], rel=1e-6)
    assert back.translation == pytest.approx(steps[2].translation, abs=1e-4)
    assert steps[0].pressures["A"] == pytest.approx(0.0, abs=1e-9) and steps[0].translation[2] == pytest.approx(
        0.0, abs=1e-6
    )
    assert [step.filled["A"] for step in steps] == pytest.approx([0.0, 150.0, 300.0])
    assert swept.plot().axes[0].get_xlabel() == "volume filled into A, ml"


def test_what_is_sealed_has_no_pressure_of_its_own():
    start = starting_design(loads(two_beside()))
    for options in ({"pressures": {"B": "3 kPa"}}, {"volumes": {"B": "1 ml"}}):
        with pytest.raises(ProblemError, match='"B" is sealed'):
            start.prepare_simulation(**options)
    with pytest.raises(ProblemError, match="follow"):
        start.explorer()


def test_motions_change_with_the_pressures_that_are_given(both):
    rates = motion_rates(both.disc, both.analysis)
    assert {name: set(each.by_pressure) for name, each in rates.items()} == {"fill": set(), "press": {"A"}}


def test_files_keep_them_and_parts_do_not_share_them():
    problem = loads(two_beside())
    again = loads(problem.to_toml())
    assert again == problem and again.task[0].volumes == {"A": 120.0}
    assert again.body.chamber[1].gas.pressure == 0.01 and again.body.chamber[1].gas.exponent == 1.4
    mirrored = 'symmetry = { mirror = ["xz", "yz"] }\n[[body.chamber]]'
    alike = two_beside().replace(GAS, "").replace("[[body.chamber]]", mirrored, 1)
    assert mirrors_of(loads(alike)) == ("xz",)


def test_one_filled_chamber_refuses_a_limit_on_the_sensitivity():
    """Of its own task alone: the other has a pressure in all its chambers."""
    text = two_beside().replace(GAS, "")
    limits = 'limits = { sensitivity = "2 deg/kPa" }'
    with pytest.raises(ProblemError, match=r"task\[0\]\.limits\.sensitivity: is not possible with"):
        loads(text.replace('volume = { A = "0.12 ml" }', f'volume = {{ A = "0.12 ml" }}\n{limits}'))
    # Of a translation, which that task is not about: one line is enough.
    with pytest.raises(ProblemError) as error:
        loads(text.replace('{ A = "0.12 ml" }', f'{{ A = "0.12 ml" }}\n{limits.replace("deg", "mm")}'))
    assert str(error.value).count("sensitivity") == 1
    limits = limits.replace("deg", "mm")
    loads(text.replace('pressure = { A = "30 kPa" }', f'pressure = {{ A = "30 kPa" }}\n{limits}'))


@pytest.mark.parametrize("symmetry", ['mirror = ["xz"]', "rotation = 3"])
def test_a_volume_counts_for_the_whole_body_where_a_part_is_solved(symmetry):
    density = 'control_density = "0.3 /mm"'
    text = tiny(pressure='{}\nvolume = { A = "0.3 ml" }')
    problem = loads(text.replace(density, f"{density}\nsymmetry = {{ {symmetry} }}"))
    found = analyse_body(problem, starting_body(problem.tubes))
    model, at = found.disc.model, found.analysis.configurations["extend"]
    part = found.analysis.equilibria["extend"]
    assert model.copies > 1
    (at_rest,) = volumes_of(model, at.X, rest(model))
    assert part.volumes["A"] == pytest.approx(model.copies * at_rest + 300.0, rel=1e-8)
    whole = whole_of(model, found.disc.morph.mesh)
    both = solve(whole.configuration(at), whole.tangent)
    assert isinstance(both, Equilibrium)
    assert both.volumes["A"] == pytest.approx(part.volumes["A"], rel=1e-8)
    assert both.enclosed["A"] == pytest.approx(part.enclosed["A"], rel=1e-6)


def test_a_stopped_run_goes_on_with_what_is_filled_and_sealed():
    problem = loads(two_beside().replace("[mesh]", "[optimizer]\niterations = 2\n[mesh]"))
    designs = [event for event in design(problem) if isinstance(event, DesignAccepted)]
    assert [each.iteration for each in designs] == [0, 1, 2]
    (again,) = (event for event in design(problem, designs[1].state, BRIEFLY) if isinstance(event, DesignAccepted))
    # Adjoints in the loop have six digits.
    assert again.entry.objective == pytest.approx(designs[2].entry.objective, rel=1e-6)
    for name, task in designs[2].entry.tasks.items():
        assert again.entry.tasks[name].pressures == pytest.approx(task.pressures, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('volume = { A = "0.12 ml" }', 'volume = { C = "0.12 ml" }', "task[0].volume.C"),
        ('volume = { A = "0.12 ml" }', 'volume = { B = "0.12 ml" }', "task[0].volume.B"),
        ('pressure = { A = "30 kPa" }', 'pressure = { B = "30 kPa" }', "task[1].pressure.B"),
        ("pressure = {}", 'pressure = { A = "1 kPa" }', "task[0].pressure.A"),
        ('pressure = "10 kPa"', 'pressure = "-200 kPa"', "body.chamber[1].gas.pressure"),
        ("exponent = 1.4", "exponent = 0.5", "body.chamber[1].gas.exponent"),
        ("[mesh]", f"{PLATE}[contact]\nfriction = 0.3\n[mesh]", "contact.friction"),
        ("[mesh]", '[limits]\nsensitivity = "2 mm/kPa"\n[mesh]', "limits.sensitivity: is not possible with"),
    ],
)
def test_mistakes_name_their_key(old, new, key):
    with pytest.raises(ProblemError) as error:
        loads(two_beside().replace(old, new))
    assert str(error.value).removeprefix("problem: ").startswith(key), error.value
