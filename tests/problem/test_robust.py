"""The table [robust]: its tolerances are read and written, and nonsense is refused by its key."""

import pytest
from texts import EXTEND, problem_text

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem, loads

SPANNED = '{ kind = "workspace", axes = ["z"] }'


def with_robust(table, rest=""):
    return loads(problem_text(f"{EXTEND}[robust]\n{table}\n{rest}"))


def test_tolerances_are_read_and_written():
    robust = with_robust('rubber = "7 %"\npressure = "2 kPa"\ndeviations = 2').robust
    assert (robust.rubber, robust.pressure, robust.deviations) == (0.07, 0.002, 2.0)
    assert (robust.wall, robust.shift) == (0.1, 0.2)


@pytest.mark.parametrize("value", ["7 %", "0.3 %", "12.34567 %", "0 %"])
def test_percentages_are_written_as_they_are_read(value):
    problem = with_robust(f'rubber = "{value}"')
    again = loads(problem.to_toml())
    assert again.robust == problem.robust
    assert again.robust.rubber == float(value.split()[0]) / 100


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ('rubber = "10"', "robust.rubber"),
        ("rubber = 0.1", "robust.rubber"),
        ('rubber = "-1 %"', "robust.rubber"),
        ('rubber = "80 %"', "robust.rubber"),
        ('wall = "-0.1 mm"', "robust.wall"),
        ('wall = "1.5 mm"', "robust.wall"),
        ("deviations = 0", "robust.deviations"),
        ("deviations = 9", "robust.deviations"),
        ("rubber = '0 %'\npressure = '0 kPa'\nwall = '0 mm'\nshift = '0 mm'\ntilt = '0 deg'", "robust"),
        ('steel = "1 mm"', "robust.steel"),
    ],
)
def test_nonsense_is_refused_by_its_key(table, key):
    with pytest.raises(ProblemError) as refused:
        with_robust(table)
    assert str(refused.value).startswith(f"{key}: ")


@pytest.mark.parametrize(
    "rest",
    [
        "[contact]\nself = true",
        '[[region]]\nname = "top"\nmaterial = { name = "Dragon Skin 30" }\nbeyond = "12 mm"',
        '[[obstacle]]\nname = "wall"\nkind = "plane"\npoint = ["30 mm", "0 mm", "0 mm"]\nnormal = [-1, 0, 0]',
    ],
)
def test_what_bears_loads_beside_the_rubber_is_refused(rest):
    with pytest.raises(ProblemError, match=r"robust: is not possible with"):
        with_robust("", rest)


@pytest.mark.parametrize(
    ("objective", "more"),
    [
        ('{ kind = "blocked", motion = "extension" }', 'hold = ["axial"]'),
        ('{ kind = "stiffness", motion = "shift_x" }', ""),
        (SPANNED, '[[task]]\nname = "pull"\npressure = {}\nforce = ["0 N", "0 N", "1 N"]\nobjective = ' + SPANNED),
        *(
            (f'{{ kind = "minimize", of = "{of}" }}', 'limits = { at_least = { extension = "0.1 mm" } }')
            for of in ("mass", "air", "stretch")
        ),
    ],
)
def test_tasks_about_more_than_motions_are_refused_by_their_kind(objective, more):
    """A force of a held tip changes with castings too, but its slopes are not those of motions."""
    task = f'[[task]]\nname = "push"\npressure = {{ A = "20 kPa" }}\nobjective = {objective}\n{more}\n'
    assert loads(problem_text(task)).robust is None
    with pytest.raises(ProblemError) as refused:
        loads(problem_text(f'{task}[robust]\nrubber = "5 %"\n'))
    kind = objective.split('"')[1]
    begin = f'robust: is not possible with the objective "{kind}" of the task "push" yet'
    assert str(refused.value).startswith(begin)
    assert "\n" not in str(refused.value)


def test_without_the_table_designs_are_not_robust():
    assert isinstance(loads(problem_text(EXTEND)), Problem)
    assert loads(problem_text(EXTEND)).robust is None


@pytest.mark.parametrize(
    ("table", "key"),
    [('shift = "1 mm"', "robust.shift"), ('tilt = "5 deg"', "robust.tilt"), ('tilt = "90 deg"', "robust.tilt")],
)
def test_cores_that_would_leave_their_walls_are_refused(table, key):
    with pytest.raises(ProblemError, match=rf"^{key}: .*limits\.wall"):
        with_robust(table)
