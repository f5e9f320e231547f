"""Membranes and fibres in problem files."""

import math

import numpy as np
import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.cover import build_covers
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.problem import loads
from pneumorph.problem.designed import starting_from

SHEET = '[[membrane]]\nname = "paper"\nstiffness = "200 N/mm"\n'
BRAID = '[[fibres]]\nname = "braid"\nstiffness = "50 N/mm"\nwinding = "70 deg"\n'


def test_they_are_read_and_written():
    problem = loads(tiny() + SHEET + 'angles = ["-90 deg", "90 deg"]\n' + BRAID + 'surfaces = ["A"]\nfamilies = 1\n')
    (sheet,), (fibres,) = problem.membrane, problem.fibres
    assert sheet.surfaces == ("exterior",) and sheet.poisson == 0.3
    assert fibres.winding.start == pytest.approx(math.radians(70)) and not fibres.winding.free
    assert fibres.handed
    assert loads(problem.to_toml()) == problem
    one, other = build_covers(problem.tubes, [*problem.membrane, *problem.fibres])
    assert (one.surface, one.r, one.q) == ("exterior", (0.0, 1.0), pytest.approx((0.75, 1.25)))
    assert (other.surface, other.q) == ("A", None)


def test_stiffness_and_angle_may_be_designed():
    text = SHEET.replace('"200 N/mm"', '{ start = "200 N/mm", min = "50 N/mm", max = "300 N/mm" }')
    text += BRAID.replace('"70 deg"', '{ start = "0 deg", min = "0 deg", max = "90 deg" }') + "families = 1\n"
    problem = loads(tiny() + text)
    assert problem.fibres[0].handed
    assert "stiffness 200 N/mm" in problem.membrane[0].words
    assert loads(problem.to_toml()) == problem
    space = build_design_space(problem, starting_body(problem.tubes))
    assert space.data(space.start) == {"paper": {"stiffness": 200.0}, "braid": {"winding": 0.0}}
    assert space.reinforcement(space.upper)[1, 1] == pytest.approx(math.pi / 2)
    assert space.data(space.lower)["paper"]["stiffness"] == pytest.approx(50.0)
    # A step of 0.2 mm is a tenth of the range.
    step = np.full(space.n, 0.2)
    assert space.reinforcement(space.start + step) == pytest.approx(np.array([[25.0, 0.0], [0.0, math.pi / 20]]))
    there = starting_from(problem, space.data(space.start + step))
    assert there.membrane[0].stiffness.start == pytest.approx(225.0) and there.membrane[0].stiffness.max == 300.0


def test_the_covered_share_of_a_sheet():
    problem = loads(tiny() + SHEET)
    assert problem.membrane[0].coverage.start == 1.0 and "coverage" not in problem.membrane[0].words
    problem = loads(tiny() + SHEET + "coverage = { start = 0.6, min = 0.2, max = 1 }\n" + BRAID)
    assert "coverage 0.6" in problem.membrane[0].words and loads(problem.to_toml()) == problem
    space = build_design_space(problem, starting_body(problem.tubes))
    assert space.data(space.lower) == {"paper": {"coverage": pytest.approx(0.2)}}
    assert space.reinforcement(space.upper) == pytest.approx(np.array([[0.0, 0.4], [0.0, 0.0]]))
    assert starting_from(problem, space.data(space.upper)).membrane[0].coverage.start == pytest.approx(1.0)
    fixed = loads(tiny() + SHEET + "coverage = 0.25\n")
    assert "coverage 0.25" in fixed.membrane[0].words and loads(fixed.to_toml()) == fixed


def test_there_are_none_by_default():
    problem = loads(tiny())
    assert problem.membrane == () and problem.fibres == ()


def test_covers_of_a_chamber_run_the_other_way_and_by_its_own_span():
    low, high = loads(tiny()).body.chamber[0].span
    middle = (low + high) / 2
    text = tiny() + SHEET + f'surfaces = ["A"]\nangles = ["10 deg", "100 deg"]\nspan = ["{middle} mm", "{high} mm"]\n'
    problem = loads(text)
    (cover,) = build_covers(problem.tubes, problem.membrane)
    assert cover.r == pytest.approx((0.5, 1.0))
    assert cover.q == pytest.approx((260 / 360, 350 / 360))


@pytest.mark.parametrize(
    "text, message",
    [
        (SHEET.replace('"200 N/mm"', '"200 MPa"'), r"membrane\[0\].stiffness: .*unit of a stiffness"),
        (SHEET.replace('stiffness = "200 N/mm"\n', ""), r"membrane\[0\].stiffness: is missing; .*the modulus times"),
        (SHEET + "poisson = 1.0\n", r"membrane\[0\].poisson"),
        (SHEET + "wrinkling = 0.0\n", r"membrane\[0\].wrinkling"),
        (SHEET + SHEET, r'membrane\[1\].name: "paper" is used twice'),
        (SHEET + BRAID.replace("braid", "paper"), r'fibres\[0\].name: "paper" is used twice'),
        (
            SHEET + 'surfaces = ["B"]\n',
            r'membrane\[0\].surfaces: there is no surface "B"; the surfaces are exterior, A',
        ),
        (SHEET + 'surfaces = ["A", "A"]\n', r'membrane\[0\].surfaces: has "A" twice'),
        (SHEET + 'span = ["9 mm", "3 mm"]\n', r"membrane\[0\].span: does not rise"),
        (SHEET + 'span = ["3 mm", "300 mm"]\n', r'membrane\[0\].span: reaches beyond "exterior"'),
        (SHEET + 'span = ["3 mm", "3.1 mm"]\n', r"membrane\[0\].span: is shorter than mesh.size"),
        (SHEET + 'angles = ["0 deg", "360 deg"]\n', r"membrane\[0\].angles: must rise, by less than 360 deg"),
        (SHEET + 'angles = ["0 deg", "2 deg"]\n', r"membrane\[0\].angles: cover less than mesh.size"),
        (BRAID.replace("70 deg", "91 deg"), r"fibres\[0\].winding: is beyond a right angle"),
        (BRAID + "families = 3\n", r"fibres\[0\].families"),
        (
            BRAID.replace('"70 deg"', '{ start = "70 deg", min = "30 deg", max = "95 deg" }'),
            r"fibres\[0\].winding: is beyond a right angle",
        ),
        (BRAID.replace('"70 deg"', '{ start = "70 deg", min = "30 deg" }'), r"fibres\[0\].winding.max: is missing"),
        (
            BRAID.replace('"70 deg"', '{ start = "20 deg", min = "30 deg", max = "80 deg" }'),
            r"fibres\[0\].winding.start: is not between min and max",
        ),
        (
            SHEET.replace('"200 N/mm"', '{ start = "1 N/mm", min = "0 N/mm", max = "2 N/mm" }'),
            r"membrane\[0\].stiffness.min: .*is not above zero",
        ),
        (SHEET + "coverage = 1.2\n", r"membrane\[0\].coverage: 1.2 is not above 0 and at most 1; write e.g. 0.6"),
        (SHEET + "coverage = 0\n", r"membrane\[0\].coverage: 0 is not above 0"),
        (SHEET + 'coverage = "60 %"\n', r"membrane\[0\].coverage: a number above 0, at most 1, is expected"),
        (SHEET + "coverage = { start = 0.5, min = 0, max = 1 }\n", r"membrane\[0\].coverage.min: "),
        (BRAID + "coverage = 0.5\n", r"fibres\[0\].coverage: unknown key"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(text, message):
    with pytest.raises(ProblemError, match=message) as refused:
        loads(tiny() + text)
    assert "\n" not in str(refused.value)


def test_a_symmetric_body_may_twist_by_its_fibres():
    text = tiny().replace('control_density = "0.3 /mm"', 'control_density = "0.3 /mm"\nsymmetry = {mirror = ["xz"]}')
    assert 'motion = "extension"' in text
    text = text.replace('motion = "extension"', 'motion = "twist"')
    with pytest.raises(ProblemError, match="twist is ruled out"):
        loads(text + BRAID)
    assert loads(text + BRAID + "families = 1\n").fibres[0].handed
