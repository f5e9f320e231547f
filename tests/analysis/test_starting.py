"""A start of which nothing can come is refused with the key at fault, and a beam is a good estimate of a body."""

import math

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis import analyse, discretise
from pneumorph.analysis.unfound import explained
from pneumorph.errors import Hopeless
from pneumorph.geometry.starting import space_of
from pneumorph.interface.design import starting_design
from pneumorph.mechanics import NoEquilibrium
from pneumorph.problem import beam, loads

PLATE = "[end_effector]\n"
YOUNG, LENGTH = 3 * 0.49, 24.0
SECOND = math.pi / 4 * 8.0**4


def beam_of(problem):
    return beam.beam_of(problem, problem.task[0])


def loaded(keys, **changes):
    return loads(tiny(**changes).replace(PLATE, PLATE + keys + "\n"))


def solid(keys):
    """A body whose chamber is so small that it hardly changes its sections."""
    return loaded(keys).with_changes({"limits.curvature": "100 /mm^2", "body.chamber[0].radius": "0.2 mm"})


def test_a_cantilever_under_force_moment_and_weight():
    """Against the closed forms of a beam of one section: F L²/2EI, M L/EI, w L³/6EI, and Euler's load."""
    bent = beam_of(solid('force = ["0 N", "1 N", "0 N"]'))
    assert bent.turned == pytest.approx([-(LENGTH**2) / (2 * YOUNG * SECOND), 0.0], rel=1e-3)
    turned = beam_of(solid('moment = ["0 N*mm", "5 N*mm", "0 N*mm"]'))
    assert turned.turned == pytest.approx([0.0, 5 * LENGTH / (YOUNG * SECOND)], rel=1e-3)
    weight = 1.1e-9 * math.pi * 64 * 9806.65
    problem = solid("").with_changes({"gravity.direction": [1, 0, 0]})
    hanging = beam_of(problem)
    assert hanging.turned == pytest.approx(
        [0.0, problem.material.density / 1.1e-9 * weight * LENGTH**3 / (6 * YOUNG * SECOND)], rel=2e-3
    )
    critical = math.pi**2 * YOUNG * SECOND / (4 * LENGTH**2)
    pressed = beam_of(solid(f'force = ["0 N", "0 N", "{-critical} N"]'))
    assert pressed.compression == pytest.approx(1.0, rel=1e-3)
    assert pressed.strain == pytest.approx(-critical / (YOUNG * math.pi * 64), rel=1e-3)


def test_a_beam_of_a_section_that_is_not_symmetric():
    """A rectangle that is turned bends in another direction than that of the force, by its product of inertia."""
    square = '{ kind = "rectangle", width = "12 mm", depth = "6 mm", corner = "0.1 mm", turn = "30 deg" }'
    text = (
        tiny()
        .replace('[body]\nlength = "24 mm"\nradius = "8 mm"', f'[body]\nlength = "24 mm"\nsection = {square}')
        .replace("[mesh]", '[limits]\ncurvature = "100 /mm^2"\n[mesh]')
    )
    assert square in text
    text = text.replace(PLATE, PLATE + 'force = ["1 N", "0 N", "0 N"]\n').replace(
        'radius = "4 mm"', 'radius = "0.2 mm"'
    )
    problem = loads(text)
    turned = beam_of(problem).turned
    along, across = np.array([math.cos(math.pi / 6), 0.5]), np.array([-0.5, math.cos(math.pi / 6)])
    about = [6.0 * 12.0**3 / 12, 12.0 * 6.0**3 / 12]
    # The force along x bends the long way by its part along it, and the short way by the other.
    bent = LENGTH**2 / (2 * YOUNG) * (along[0] / about[0] * along + across[0] / about[1] * across)
    assert turned == pytest.approx([-bent[1], bent[0]], rel=1e-2)


def test_what_others_bear_is_not_estimated():
    force = 'force = ["0 N", "1 N", "0 N"]'
    assert beam_of(loads(tiny())) is None
    assert beam_of(loaded(force + '\nhold = ["bending_x"]')) is None
    assert beam_of(loaded(force)) is not None


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ('force = ["0 N", "0 N", "-100 N"]', "end_effector.force"),
        ('moment = ["130 N*mm", "0 N*mm", "0 N*mm"]', "end_effector.moment"),
    ],
)
def test_loads_that_fold_the_body_over(keys, said):
    problem = loaded(keys, length='"60 mm"', objective='{ kind = "maximize", motion = "-bending_x" }')
    with pytest.raises(Hopeless, match=said) as caught:
        _ = starting_design(problem).results
    assert "as a linear beam" in str(caught.value)


def test_a_load_that_bends_it_as_it_should_is_none_of_these():
    problem = loaded(
        length='"60 mm"',
        keys='moment = ["130 N*mm", "0 N*mm", "0 N*mm"]',
        objective='{ kind = "maximize", motion = "bending_x" }',
    )
    assert beam_of(problem).angle > math.radians(90)
    assert starting_design(problem).results["extend"].rotation[0] > math.radians(60)


def test_a_start_beyond_the_limit_pressure_says_where_to_begin():
    soft = loads(tiny(pressure='{ A = { start = "900 kPa", min = "10 kPa", max = "1 MPa" } }'))
    space = space_of(soft)
    disc = discretise(soft, space.body(space.start))
    found = analyse(soft, space, disc, space.start, explain=True)
    assert isinstance(found, NoEquilibrium) and 0.0 < found.fraction < 1.0
    assert found.reason.startswith("task[0].pressure.A: ")
    proposed = float(found.reason.rpartition('start = "')[2].partition(" kPa")[0])
    assert proposed == pytest.approx(0.8 * found.fraction * 900, rel=0.06)
    lower = soft.with_changes({"task[0].pressure.A.start": f"{proposed} kPa"})
    assert starting_design(lower).results["extend"].translation[2] > 0.0


@pytest.mark.parametrize(
    ("pressure", "said"),
    [
        ('{ A = { start = "50 kPa", min = "30 kPa", max = "60 kPa" } }', "the whole range of A, from 30"),
        ('{ A = { start = "50 kPa", min = "-30 kPa", max = "60 kPa" } }', 'start = "8'),
        ('{ A = { start = "-50 kPa", min = "-60 kPa", max = "-30 kPa" } }', "the whole range of A, from -60"),
        ('{ A = "50 kPa" }', 'A = { start = "8 kPa", min = "0 kPa", max = "50 kPa" }'),
        ('{ A = "-50 kPa" }', 'A = { start = "-8 kPa", min = "-50 kPa", max = "0 kPa" }'),
    ],
)
def test_ranges_without_a_state(pressure, said):
    failure = explained(loads(tiny(pressure=pressure)), 0, NoEquilibrium("it balloons", 0.2, None))
    assert failure.reason.startswith("task[0].pressure.A: it balloons") and said in failure.reason


def test_what_is_proposed_for_a_pressure_without_a_state_can_be_written():
    failure = explained(loads(tiny(pressure='{ A = "50 kPa" }')), 0, NoEquilibrium("it balloons", 0.2, None))
    proposed = failure.reason.rpartition("may raise it: ")[2]
    pressure = loads(tiny(pressure=f"{{ {proposed} }}")).task[0].pressure["A"]
    assert pressure.free and (pressure.start, pressure.max) == pytest.approx((0.008, 0.05))
