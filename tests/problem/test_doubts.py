"""Tasks in which nothing moves the body are doubted; those that loads alone move are not."""

import pytest
from texts import problem_text

from pneumorph.problem import loads
from pneumorph.problem.doubts import doubts

OBJECTIVE = 'objective = { kind = "maximize", motion = "extension" }'


def task(keys: str, objective: str = OBJECTIVE, more: str = "") -> str:
    return f'[[task]]\nname = "extend"\n{keys}\n{objective}\n{more}'


@pytest.mark.parametrize("pressure", ["{}", '{ A = "0 kPa" }'])
def test_a_task_in_which_nothing_moves_is_doubted(pressure):
    (doubt,) = doubts(loads(problem_text(task(f"pressure = {pressure}"))))
    assert doubt == (
        "in task extend no chamber has a pressure and no load acts, so nothing moves; give it a pressure, e.g. "
        'pressure = { A = "60 kPa" }'
    )


@pytest.mark.parametrize(
    "given",
    [
        task('pressure = { A = { min = "0 kPa", max = "60 kPa", start = "0 kPa" } }'),
        task('pressure = {}\nvolume = { A = "1 ml" }'),
        task('pressure = {}\nforce = ["0 N", "0 N", "0.1 N"]'),
        task("pressure = {}", more="[gravity]\ndirection = [0, 0, -1]"),
        task("pressure = {}", 'objective = { kind = "stiffness", motion = "extension" }'),
    ],
)
def test_a_task_that_is_moved_or_is_about_no_motion_is_not(given):
    assert not list(doubts(loads(problem_text(given))))
