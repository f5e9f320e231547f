"""A thin clamped disc of soft rubber under a dead load in its middle: at rest only its bending bears the load."""

import numpy as np
import pytest

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import (
    Equilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    enclosed_of,
    loads_of,
    neo_hookean_rubber,
    part_of,
    rest,
    settled,
    solve,
)
from pneumorph.mechanics import model_of as setup_model
from pneumorph.mechanics.assembly.enclosed import Enclosed, volumes_of
from pneumorph.mechanics.solve.balance import SQUEEZED, ratios_at, squeezed
from pneumorph.mesh.tets import TetMesh
from pneumorph.problem.acting import acting
from pneumorph.validation.tables import problem_of
from pneumorph.verify.solids import tube

SHEAR, CONTACT, FREE, DEPTH = 0.0317, 25.4, 70.0, 10.0
AXIAL = np.array([1, 1, 0, 1, 1, 1], bool)


def disc(thickness):
    """A ring clamped at its outer edge; its inner edge, and a lid across it, move with the plate."""
    ring = tube(CONTACT, FREE, thickness, (4, 8, 1))
    points, bottom = ring.points + np.array([0.0, 0.0, DEPTH]), ring.faces["base"]
    centre, new = len(points), [np.array([0.0, 0.0, DEPTH])]
    at_edge = np.abs(np.hypot(*ring.points[:, :2].T) - CONTACT) < 1e-6
    corners = [(k, (k + 1) % 3) for k in range(3)]
    edges = [(row[a], row[3 + a], row[b]) for row in bottom for a, b in corners if at_edge[row[[a, b]]].all()]
    spokes = {}
    for node in sorted({int(node) for one, _, other in edges for node in (one, other)}):
        spokes[node] = centre + len(new)
        new.append(0.5 * (points[node] + new[0]))
    lid = np.array([[b, a, centre, middle, spokes[int(a)], spokes[int(b)]] for a, middle, b in edges])
    faces = {
        "base": ring.faces["exterior"],
        "tip": np.concatenate([ring.faces["chamber A"], lid]),
        "chamber A": np.concatenate([bottom, lid]),
    }
    return TetMesh(np.concatenate([points, new]), ring.tets, faces)


def model_of(mesh):
    rubber = neo_hookean_rubber(SHEAR, 1000.0 * SHEAR, 1.07e-9)
    return build_model(mesh, rubber, mixed=True, weight=False)


@pytest.fixture(scope="module")
def thick():
    mesh = disc(2.0)
    return mesh, model_of(mesh)


def under(mesh, model, force, liquid=None):
    """The disc under a dead load in N, with `liquid` ml below it, or without pressure."""
    loads = build_loads(model, {"A": 0.0}, wrench=np.array([0.0, 0.0, -force, 0.0, 0.0, 0.0]))
    enclosed = None
    if liquid is not None:
        gas, zero = np.array([False]), np.zeros(1)
        enclosed = Enclosed(("A",), np.array([1e3 * liquid]), gas, zero, np.ones(1), np.full(1, 0.101325))
    return configure(model, mesh.points, loads, AXIAL, enclosed)


def test_a_disc_is_filled_under_its_load_in_few_factorisations(thick):
    """Loads and volume are raised together from rest; without damped steps this took 21 and 253 back-solves."""
    mesh, model = thick
    tangent, at = Tangent(model), under(*thick, 14.715, 80.0)
    found = solve(at, tangent)
    assert isinstance(found, Equilibrium), found
    assert found.stable
    assert found.factorisations <= 15
    assert found.solves <= 120
    at_rest = float(volumes_of(model, mesh.points, rest(model))[0])
    assert found.volumes["A"] - at_rest == pytest.approx(80e3, rel=1e-8)

    # The same state comes from the volume first and the load after it.
    before = under(*thick, 0.0, 80.0)
    first = solve(before, tangent)
    assert isinstance(first, Equilibrium)
    other = solve(at, tangent, since=(settled(before, first), first.state))
    assert isinstance(other, Equilibrium)
    assert other.enclosed["A"] == pytest.approx(found.enclosed["A"], rel=1e-7)
    assert other.plate[2] == pytest.approx(found.plate[2], rel=1e-6)


def test_a_film_bears_a_load_that_its_bending_does_not():
    """The first step of the load has to be far shorter than those after it."""
    mesh = disc(0.5)
    model = model_of(mesh)
    found = solve(under(mesh, model, 14.0), Tangent(model))
    assert isinstance(found, Equilibrium), found
    assert found.stable
    assert found.plate[2] < -FREE


def test_an_element_that_is_about_to_be_turned_inside_out_is_named(thick):
    mesh, model = thick
    at = under(*thick, 0.0)
    assert not squeezed(at, model.vector(rest(model)))
    # A node on the upper face is pushed through most of the ring.
    node = int(np.argmin(np.linalg.norm(mesh.points - [48.0, 0.0, DEPTH + 2.0], axis=1)))
    u = np.zeros_like(mesh.points)
    u[node, 2] = -1.6
    pushed = model.vector(rest(model)._replace(u=u))
    assert ratios_at(at, pushed).min() < SQUEEZED
    place = [float(part) for part in squeezed(at, pushed).split("(")[1].split(")")[0].split(",")]
    assert np.linalg.norm(np.array(place) - mesh.points[node]) < 15.0


def test_what_bears_loads_only_when_it_is_filled_is_filled_first():
    """A disc with stiff fabric rings: loads and volume raised together took 74 factorisations, and 319 for 60 ml."""
    problem = problem_of("ringed", "4", 11.5)
    stiff = {f"membrane[{ring}].stiffness": "30 N/mm" for ring in range(len(problem.membrane))}
    problem = problem.with_changes(stiff)
    under = acting(problem, problem.task[1])
    mesh = mesh_of(problem, body_of(problem), part_of(problem, [{"A": 0.0}], [under])).mesh
    model = setup_model(problem, mesh)
    loads = loads_of(problem, model, {"A": 0.0}, under=under)
    at = configure(model, mesh.points, loads, enclosed=enclosed_of(problem, {"A": 100e3}))
    found = solve(at, Tangent(model))
    assert isinstance(found, Equilibrium) and found.stable
    assert found.factorisations <= 40
