"""What a task asks of its tip, against where the tip is held and how far limits let it go."""

import pytest
from texts import problem_text

from pneumorph.errors import ProblemError
from pneumorph.problem import loads

MOVED = '{ kind = "motion", extension = "5 mm" }'
TURNED = '{ kind = "motion", bending_y = "-20 deg", shift_x = "3 mm" }'


def task(objective, *lines):
    return "\n".join(["[[task]]", 'name = "go"', 'pressure = { A = "40 kPa" }', f"objective = {objective}", *lines, ""])


@pytest.mark.parametrize(
    ("objective", "line", "key", "word"),
    [
        (MOVED, 'hold = ["axial"]', "task[0].objective.extension", "is held, so it does not change"),
        (MOVED, 'hold = { extension = "2 mm" }', "task[0].objective.extension", "is held at 2 mm"),
        (MOVED, 'limits = { motion = { extension = "2 mm" } }', "task[0].objective.extension", "asks for 5 mm"),
        (
            TURNED,
            'limits = { motion = { bending_y = "5 deg" } }',
            "task[0].objective.bending_y",
            "motion.bending_y = 5 deg",
        ),
        (TURNED, 'limits = { motion = { shift = "1 mm" } }', "task[0].objective.shift_x", "motion.shift = 1 mm"),
        (
            '{ motion = "extension" }',
            'limits = { motion = { extension = "2 mm" }, at_least = { extension = "3 mm" } }',
            "task[0].limits.at_least.extension",
            "allows less",
        ),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(objective, line, key, word):
    with pytest.raises(ProblemError) as refused:
        loads(problem_text(task(objective, line)))
    (only,) = refused.value.faults
    assert only.startswith(f"{key}: ") and word in only


@pytest.mark.parametrize(
    ("objective", "line"),
    [
        (MOVED, 'hold = ["bending_x"]'),
        ('{ motion = "extension" }', 'hold = ["axial"]'),
        (MOVED, 'hold = { extension = "5 mm" }'),
        (MOVED, 'limits = { motion = { extension = "5 mm" } }'),
        (TURNED, 'limits = { motion = { twist = "1 deg", bending_y = "20 deg" } }'),
        ('{ kind = "blocked", motion = "extension" }', 'hold = ["axial"]'),
    ],
)
def test_what_can_be_is_not(objective, line):
    loads(problem_text(task(objective, line)))


def test_the_limits_of_a_task_take_the_place_of_those_of_all():
    wide = 'limits = { motion = { extension = "9 mm" } }'
    narrow = '[limits]\nmotion = { extension = "2 mm" }\n'
    loads(problem_text(f"{task(MOVED, wide)}{narrow}"))
    with pytest.raises(ProblemError, match=r"limits\.motion\.extension = 2 mm"):
        loads(problem_text(f"{task(MOVED)}{narrow}"))
