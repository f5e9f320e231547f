"""Contact and obstacles in problem files."""

import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.mechanics import mirrors_of
from pneumorph.problem import loads

BALL = '[[obstacle]]\nname = "ball"\nkind = "sphere"\ncenter = ["20 mm", "0 mm", "20 mm"]\nradius = "4 mm"\n'
TABLE = '[[obstacle]]\nname = "table"\nkind = "plane"\npoint = ["0 mm", "0 mm", "-5 mm"]\nnormal = [0, 0, 2]\n'
ROD = (
    '[[obstacle]]\nname = "rod"\nkind = "cylinder"\ncenter = ["20 mm", "0 mm", "9 mm"]\naxis = [0, 3, 4]\n'
    'radius = "2 mm"\nlength = "9 mm"\n'
)
BLOCK = (
    '[[obstacle]]\nname = "block"\nkind = "box"\ncenter = ["20 mm", "0 mm", "9 mm"]\nsize = ["4 mm", "5 mm", "6 mm"]\n'
)


def test_all_kinds_are_read_and_written():
    problem = loads(tiny() + "[contact]\n" + BALL + TABLE + ROD + BLOCK)
    assert problem.contact is not None and problem.contact.self and problem.contact.distance is None
    assert [each.kind for each in problem.obstacle] == ["sphere", "plane", "cylinder", "box"]
    assert problem.obstacle[1].normal == (0.0, 0.0, 1.0)
    assert problem.obstacle[2].axis == pytest.approx((0.0, 0.6, 0.8))
    assert loads(problem.to_toml()) == problem


def test_nothing_touches_by_default():
    problem = loads(tiny())
    assert problem.contact is None and problem.obstacle == ()
    assert "contact" not in problem.to_toml()


def test_the_whole_body_is_solved_where_anything_touches():
    symmetric = tiny().replace(
        'control_density = "0.3 /mm"', 'control_density = "0.3 /mm"\nsymmetry = {mirror = ["xz"]}'
    )
    assert mirrors_of(loads(symmetric)) == ("xz",)
    assert mirrors_of(loads(symmetric + BALL)) == ()
    assert mirrors_of(loads(symmetric + "[contact]\n")) == ()


@pytest.mark.parametrize(
    "text, message",
    [
        (
            BALL.replace('"sphere"', '"egg"'),
            r'obstacle\[0\].kind: "egg" is not a known kind of obstacle; use one of plane',
        ),
        (BALL.replace('kind = "sphere"\n', ""), r"obstacle\[0\].kind: is missing; use one of plane"),
        (BALL.replace('"4 mm"', '"-4 mm"'), r"obstacle\[0\].radius: .* is not above zero"),
        (BALL.replace('radius = "4 mm"\n', ""), r"obstacle\[0\].radius: is missing"),
        (BALL + BALL, r'obstacle\[1\].name: "ball" is used twice'),
        (
            TABLE.replace("[0, 0, 2]", "[0, 0, 0]"),
            r"obstacle\[0\].normal: has length zero; write e.g. normal = \[0, 0, 1\]",
        ),
        ("[contact]\nself = 1\n", r"contact.self"),
        ("[contact]\nfriction = 0.3\n", r"contact.friction: acts on obstacles alone, and there is none"),
        (BALL + "[contact]\nfriction = -0.3\n", r"contact.friction"),
        (
            '[contact]\ndistance = "0.8 mm"\n',
            r"contact.distance: 0.8 mm is more than half of limits.fold.distance = 1 mm",
        ),
        ("[contact]\nstiffness = 0.3\n", r"contact.stiffness: unknown key"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(text, message):
    with pytest.raises(ProblemError, match=message) as refused:
        loads(tiny() + text)
    assert "\n" not in str(refused.value)
