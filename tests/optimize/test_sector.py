"""The loop on a sector of a body: what it says of the whole, and that it goes on after a stop and on new meshes."""

import numpy as np
import pytest
from designing import BRIEFLY, accepted, solved
from tiny import tiny

from pneumorph.analysis import (
    build_discretisation,
    carry_over,
    check_stability,
    collect_fields,
    design_gradient,
    discretise,
)
from pneumorph.analysis.explore import Explorer
from pneumorph.errors import MeshError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import deformation_gradients, displacement, part_of
from pneumorph.mesh.tube import mesh_body
from pneumorph.optimize import Finished, Started, design
from pneumorph.problem import loads
from pneumorph.results import Fields, nodal_stretch
from pneumorph.sensitivity import taylor_test
from pneumorph.symmetry.part import sector

THIRD = (
    tiny(
        control_density='"0.4 /mm"',
        spring='{ torsion = "50 N*mm/rad" }',
        pressure='{ A = { start = "50 kPa", min = "40 kPa", max = "60 kPa" } }',
        objective='{ kind = "maximize", motion = "twist" }',
        size='"5 mm"',
    )
    .replace('name = "extend"', 'name = "twist"')
    .replace(
        "[[body.chamber]]",
        'ripple = { amplitude = "0.5 mm", period = "24 mm", lobes = 3 }\nsymmetry = { rotation = 3 }\n[[body.chamber]]',
    )
)


@pytest.fixture(scope="module")
def problem():
    return loads(THIRD)


@pytest.fixture(scope="module")
def events(problem):
    return list(design(problem))


def test_the_loop_designs_on_a_sector(events):
    started, finished = events[0], events[-1]
    assert isinstance(started, Started) and isinstance(finished, Finished)
    assert started.part == (sector(3),)
    first, *_, last = (event.entry for event in accepted(events))
    assert last.objective < first.objective - 1e-3
    found = last.tasks["twist"]
    assert found.translation[:2] == (0.0, 0.0) == found.rotation[:2]
    assert finished.stable == {"twist": True}
    fields = accepted(events)[-1].fields
    whole = fields.whole()
    assert whole.mesh.part == () and len(whole.mesh.tets) == 3 * len(fields.mesh.tets)


def test_a_stopped_run_goes_on(problem, events):
    designs = accepted(events)
    (again,) = accepted(design(problem, designs[1].state, BRIEFLY))
    assert again.iteration == 2
    assert again.entry.objective == pytest.approx(designs[2].entry.objective, rel=1e-6)


@pytest.fixture(scope="module")
def analysed(problem):
    """A twisted design on a mesh of a sector and on one of the whole body."""
    space = build_design_space(problem, starting_body(problem.tubes))
    phi = space.start + 0.1 * np.random.default_rng(0).normal(size=space.n)
    phi[space.n_shape :] = space.start[space.n_shape :]
    body = space.body(phi)
    part = discretise(problem, body)
    whole = build_discretisation(problem, mesh_body(body, problem.mesh.size), body.control_points())
    assert part.model.part == (sector(3),) and whole.model.part == ()
    return space, phi, part, whole, *(solved(problem, space, disc, phi) for disc in (part, whole))


def test_the_gradient_is_exact_and_that_of_the_whole(problem, analysed):
    space, phi, part, whole, *found = analysed
    slopes = [design_gradient(problem, space, disc, one) for disc, one in zip((part, whole), found, strict=True)]
    assert found[0].value == pytest.approx(found[1].value, rel=0.1)
    assert slopes[0] @ slopes[1] > 0.97 * np.linalg.norm(slopes[0]) * np.linalg.norm(slopes[1])
    along = np.random.default_rng(1).uniform(-1.0, 1.0, space.n)

    def value(x):
        starts = {"twist": found[0].equilibria["twist"].state}
        return solved(problem, space, part, x, starts).value

    test = taylor_test(value, phi, slopes[0], along, step=0.1, count=3)
    assert test.passed, test


def test_states_are_carried_between_meshes(problem, analysed):
    space, phi, part, whole, mine, other = analysed
    finer = build_discretisation(problem, mesh_body(space.body(phi), 3.5, (sector(3),)), space.control_points(phi))
    for old, X, states in ((part, mine.X, mine), (whole, other.X, other)):
        given = {"twist": states.equilibria["twist"].state}
        carried = carry_over(old, X, given, finer, finer.morph.mesh.points)["twist"]
        there = solved(problem, space, finer, phi)
        exact = there.equilibria["twist"].state
        away = finer.model.vector(carried.state) - finer.model.vector(exact)
        assert np.linalg.norm(away) < 0.1 * np.linalg.norm(finer.model.vector(exact))
        u = displacement(finer.model.tip, there.X, exact)
        F = deformation_gradients(finer.morph.mesh.tets, there.X, u)
        assert np.linalg.norm(carried.gradients - F) < 0.4 * np.linalg.norm(F - np.eye(3)[:, :, None, None])
    assert check_stability(part, mine) == {"twist": True}


def test_where_a_cut_cannot_be_meshed_the_whole_body_is(problem, monkeypatch):
    def refuse(*given):
        raise MeshError("the profiles of two surfaces cross in a plane")

    monkeypatch.setattr("pneumorph.mesh.tube.build.with_sector", refuse)
    assert discretise(problem, starting_body(problem.tubes)).model.part == ()


def test_stretches_at_nodes_are_those_of_the_whole(problem):
    """Also in the cuts, where half of the elements at a node are those at its image."""
    space = build_design_space(problem, starting_body(problem.tubes))
    phi = space.start + 0.1 * np.random.default_rng(1).normal(size=space.n)
    disc = discretise(problem, space.body(phi))
    fields = collect_fields(disc, solved(problem, space, disc, phi))
    whole = fields.whole()
    assert len(whole.mesh.tets) == 3 * len(fields.mesh.tets)
    assert np.abs(whole.stretch["twist"] - nodal_stretch(whole.mesh, whole.u["twist"])).max() < 1e-9


def test_what_was_stored_of_a_part_is_explored_on_it():
    """With mirror planes too, sectors or not: the mesh of the run is not given up for a part that it does not have."""
    mirrored = tiny(control_density='"0.4 /mm"').replace("[[body.chamber]]", "symmetry = SYMMETRY\n[[body.chamber]]")
    stored = loads(mirrored.replace("SYMMETRY", '{ mirror = ["xz"] }'))
    asked = loads(mirrored.replace("SYMMETRY", '{ mirror = ["xz"], rotation = 3 }'))
    assert part_of(asked) == (sector(3),)
    body = starting_body(asked.tubes)
    disc = discretise(stored, body)
    assert disc.model.part == ("xz",)
    mesh = disc.morph.mesh
    still = Fields(mesh, {"extend": np.zeros_like(mesh.points)}, {"extend": np.ones(len(mesh.points))})
    found = Explorer(asked, body, still).at({"A": 0.02})
    assert found.fields is not None
    assert found.fields.mesh.part == ("xz",)
