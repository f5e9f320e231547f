"""Problems with fewer chambers, and chambers that share a supply."""

import textwrap

import numpy as np
import pytest
from solids import box, cylinder, occ
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis import design_slopes
from pneumorph.analysis.gradient import analyse_body
from pneumorph.cad.shells import shells_of
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.mechanics import part_of
from pneumorph.problem import loads, with_fewer_chambers

FREE = '{ start = "30 kPa", min = "0 kPa", max = "60 kPa" }'
TASK = f"""
[[task]]
name = "go"
pressure.A = {FREE}
pressure.B = SECOND
objective = {{ motion = "extension" }}
"""


def text(second, symmetry='symmetry = { mirror = ["xz", "yz"] }'):
    return problem_text(TASK.replace("SECOND", second), radius=11, chambers=TWO_BESIDE, body=symmetry)


SHARED = loads(text('{ same_as = "A" }'))


def test_a_shared_pressure_is_one_variable_of_both_chambers():
    space = space_of(SHARED)
    assert space.n == space.n_shape + 1
    phi = space.start.copy()
    phi[-1] *= 1.5
    assert space.pressures(phi)["go"] == {"A": pytest.approx(0.045), "B": pytest.approx(0.045)}
    # The transpose of that map.
    pulled = space.pullback(np.zeros((space.reference.n_points, 3)), {"go": {"A": 3.0, "B": 4.0}})
    step = 0.01
    phi[-1] += step
    raised = space.pressures(phi)["go"]
    assert 3.0 * (raised["A"] - 0.045) + 4.0 * (raised["B"] - 0.045) == pytest.approx(pulled[-1] * step)


@pytest.mark.parametrize(("second", "part"), [('{ same_as = "A" }', ("xz", "yz")), (FREE, ("xz",))])
def test_a_mirror_plane_between_chambers_of_one_supply_halves_what_is_solved(second, part):
    assert part_of(loads(text(second))) == part


def test_what_is_solved_of_chambers_of_one_supply_gives_the_whole():
    objectives = {}
    for symmetry in ('symmetry = { mirror = ["xz", "yz"] }', ""):
        problem = loads(text('{ same_as = "A" }', symmetry))
        at = analyse_body(problem, body_of(problem))
        objectives[symmetry] = at.analysis.value, design_slopes(at.problem, at.space, at.disc, at.analysis).total[-1]
    (value, slope), (whole, of_whole) = objectives.values()
    assert (value, slope) == pytest.approx((whole, of_whole), rel=0.02)


def test_a_motion_that_one_supply_rules_out_is_refused():
    bent = TASK.replace("SECOND", '{ same_as = "A" }').replace('"extension"', '"bending_y"')
    body = 'symmetry = { mirror = ["xz", "yz"] }'
    with pytest.raises(ProblemError, match=r'bending_y is ruled out by body.symmetry, mirror "yz"'):
        loads(problem_text(bent, radius=11, chambers=TWO_BESIDE, body=body))


def test_a_shared_pressure_follows_the_other_when_it_changes():
    assert loads(SHARED.to_toml()) == SHARED
    assert SHARED.with_changes({"task[0].pressure.A": "20 kPa"}).task[0].pressure["B"].start == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("second", "reason"),
    [
        ('{ same_as = "C" }', "names no other chamber"),
        ('{ same_as = "B" }', "names no other chamber"),
        ('{ same_as = "A", max = "3 kPa" }', "gives max too"),
    ],
)
def test_a_shared_pressure_that_makes_no_sense(second, reason):
    with pytest.raises(ProblemError, match=rf"task\[0\].pressure.B: .*{reason}"):
        loads(text(second))


def test_chambers_that_are_merged_share_the_supply_of_the_first():
    apart = loads(text(FREE))
    assert with_fewer_chambers(apart, (), {"B": "A"}) == SHARED


def test_a_body_without_a_chamber_keeps_the_symmetry_that_is_left():
    fewer = with_fewer_chambers(loads(text(FREE)), ["A"], {})
    assert [chamber.name for chamber in fewer.body.chamber] == ["B"]
    assert list(fewer.task[0].pressure) == ["B"]
    assert fewer.body.symmetry.mirror == ("xz",)
    # What shared the supply of the chamber has its pressure.
    assert with_fewer_chambers(SHARED, ["A"], {}).task[0].pressure["B"].max == pytest.approx(0.06)


def test_some_chamber_is_left():
    with pytest.raises(ProblemError, match="none is left"):
        with_fewer_chambers(SHARED, ["A", "B"], {})
    with pytest.raises(ProblemError, match='no chamber "C"'):
        with_fewer_chambers(SHARED, ["C"], {})


def with_voids(folder, kind):
    """A block with two spherical voids, or one void and a hole from below, in a file."""
    shape = box((-8, -6, 0), (8, 6, 30)) - ball(2.5, -3, 15)
    shape = shape - (cylinder(2, 0, 20, x=4) if kind == "port" else ball(2, 4, 15))
    path = folder / "voids.step"
    shape.WriteStep(str(path))
    other = 'name = "B"\ninside = ["4 mm", "0 mm", "15 mm"]' + ('\nport = "z = 0 mm"' if kind == "port" else "")
    text = f"""
    [material]
    name = "Dragon Skin 30"
    [body]
    file = "{path}"
    symmetry = {{ mirror = ["xz"] }}
    [[body.chamber]]
    name = "A"
    inside = ["-3 mm", "0 mm", "15 mm"]
    [[body.chamber]]
    {other}
    [[task]]
    name = "go"
    pressure = {{ A = "10 kPa", B = "0 kPa" }}
    objective = {{ motion = "extension" }}
    """
    return loads(textwrap.dedent(text))


def ball(radius, x, z):
    return occ().Sphere(occ().Pnt(x, 0, z), radius)


def test_a_void_of_a_file_is_filled(tmp_path):
    before = with_voids(tmp_path, "void")
    fewer = with_fewer_chambers(before, ["B"], {})
    assert [chamber.name for chamber in fewer.body.chamber] == ["A"] and list(fewer.task[0].pressure) == ["A"]
    assert fewer.body.symmetry.mirror == ("xz",) and fewer.solid.length == pytest.approx(30.0)
    [void] = shells_of(fewer.solid.faces(1.0)).voids
    assert -void.volume == pytest.approx(4.0 / 3.0 * np.pi * 2.5**3, rel=0.01)
    assert void.centre == pytest.approx([-3.0, 0.0, 15.0], abs=0.02)
    # Its file is part of it.
    assert loads(fewer.to_toml()) == fewer


def test_a_port_of_a_file_is_left_to_cad(tmp_path):
    with pytest.raises(ProblemError, match="B opens through a port"):
        with_fewer_chambers(with_voids(tmp_path, "port"), ["B"], {})
