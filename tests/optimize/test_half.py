"""The loop on half or a quarter of a body: what it says of the whole, and that it goes on after a stop."""

import numpy as np
import pytest
from designing import BRIEFLY, accepted, solved
from tiny import tiny

from pneumorph.analysis import build_discretisation, carry_over, design_gradient, discretise
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mesh.tube import mesh_body
from pneumorph.optimize import Finished, Started, design
from pneumorph.problem import loads
from pneumorph.sensitivity import taylor_test

HALF = (
    tiny(
        control_density='"0.4 /mm"',
        spring='{ bending_y = "50 N*mm/rad" }',
        pressure='{ A = { start = "50 kPa", min = "40 kPa", max = "60 kPa" } }',
        objective='{ kind = "maximize", motion = "bending_y" }',
        size='"5 mm"',
    )
    .replace('name = "extend"', 'name = "bend"')
    .replace(
        "[[body.chamber]]",
        'ripple = { amplitude = "0.3 mm", period = "10 mm" }\nsymmetry = { mirror = ["xz"] }\n[[body.chamber]]',
    )
)
QUARTER = HALF.replace('["xz"]', '["xz", "yz"]').replace('motion = "bending_y"', 'motion = "extension"')


@pytest.fixture(scope="module", params=[HALF, QUARTER], ids=["half", "quarter"])
def problem(request):
    return loads(request.param)


@pytest.fixture(scope="module")
def events(problem):
    return list(design(problem))


def test_the_loop_designs_on_part_of_the_body(problem, events):
    started, finished = events[0], events[-1]
    assert isinstance(started, Started) and isinstance(finished, Finished)
    assert started.part == problem.body.symmetry.mirror
    first, *_, last = (event.entry for event in accepted(events))
    assert last.objective < first.objective - 1e-3
    found = last.tasks["bend"]
    assert found.translation[1] == found.rotation[0] == found.rotation[2] == 0.0
    assert (found.translation[0] == found.rotation[1] == 0.0) == (len(started.part) == 2)
    assert finished.stable == {"bend": True}


def test_a_stopped_run_goes_on(problem, events):
    designs = accepted(events)
    (again,) = accepted(design(problem, designs[1].state, BRIEFLY))
    assert again.iteration == 2
    assert again.entry.objective == pytest.approx(designs[2].entry.objective, rel=1e-6)
    # Adjoints in the loop have six digits, and other factorisations are at hand.
    assert np.abs(again.body.control_points() - designs[2].body.control_points()).max() < 2e-5


def test_states_are_carried_to_new_meshes(problem):
    """From a quarter to another mesh of it, and to one from a half as a run of an earlier version may have it."""
    space = build_design_space(problem, starting_body(problem.tubes))
    body, phi = space.body(space.start), space.start
    new = discretise(problem, body)
    fresh = solved(problem, space, new, phi)
    for mirrors in (problem.body.symmetry.mirror, ("xz",)):
        old = build_discretisation(problem, mesh_body(body, 4.0, mirrors), body.control_points())
        there = solved(problem, space, old, phi)
        states = {"bend": there.equilibria["bend"].state}
        again = solved(problem, space, new, phi, carry_over(old, there.X, states, new, new.morph.mesh.points))
        assert again.value == pytest.approx(fresh.value, rel=1e-7, abs=1e-9)
        # The load is so small that Newton's method from rest takes two factorisations only.
        work = [(each.factorisations, each.solves) for each in (again.equilibria["bend"], fresh.equilibria["bend"])]
        assert work[0] < work[1]


def test_the_gradient_is_right_and_that_of_the_whole_body(problem):
    space = build_design_space(problem, starting_body(problem.tubes))
    # A bulge on the side of +x, so that the body bends; in a quarter on both sides.
    start = space.control_points(space.start)
    angle, height = np.arctan2(start[:, 1], start[:, 0]), start[:, 2] / 24
    bulge = (
        np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        * ((1 + np.cos(angle)) * np.sin(np.pi * height) ** 2)[:, None]
    )
    along = np.concatenate([space.pullback(bulge)[: space.n_shape], [0.3]])
    phi = space.start + 0.5 * along / np.abs(along).max()
    body = space.body(phi)
    part = discretise(problem, body)
    whole = build_discretisation(problem, mesh_body(body, problem.mesh.size), body.control_points())
    assert part.model.part == problem.body.symmetry.mirror and whole.model.part == ()
    found = [solved(problem, space, disc, phi) for disc in (part, whole)]
    slopes = [design_gradient(problem, space, disc, one) for disc, one in zip((part, whole), found, strict=True)]
    assert found[0].value == pytest.approx(found[1].value, rel=0.03)
    assert slopes[0] @ slopes[1] > 0.98 * np.linalg.norm(slopes[0]) * np.linalg.norm(slopes[1])
    assert slopes[0] @ along == pytest.approx(slopes[1] @ along, rel=0.03)

    def value(x):
        starts = {"bend": found[0].equilibria["bend"].state}
        return solved(problem, space, part, x, starts).value

    test = taylor_test(value, phi, slopes[0], along, step=0.1, count=3)
    assert test.passed, test
