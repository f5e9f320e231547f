"""Small voids at pressure: the first-order formula beside voids that are really there, on the same mesh."""

import numpy as np
import pytest

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import Tangent, configure, rubbers_of, solve
from pneumorph.mechanics.assembly.build import build_model
from pneumorph.mechanics.solve.equilibrium import build_loads
from pneumorph.mesh.tets import TURNED, TetMesh
from pneumorph.mesh.volume import fill
from pneumorph.problem import Problem
from pneumorph.sensitivity import tip_motion_adjoints
from pneumorph.sensitivity.insertion import insertion_slopes, swelling

LENGTH, RADIUS = 24.0, 1.2
WITHIN = 0.2


def problem(material, pressure, place):
    """A thick tube with a chamber beside its axis, and a sphere S."""
    x, y, z = place
    sphere = {
        "name": "S",
        "radius": f"{RADIUS} mm",
        "center": [f"{x} mm", f"{y} mm"],
        "span": [f"{z - RADIUS} mm", f"{z + RADIUS} mm"],
        "ends": "pole",
    }
    chamber = {"name": "A", "radius": "4 mm", "center": ["3.5 mm", "0 mm"], "span": ["4 mm", "20 mm"]}
    return Problem.model_validate(
        {
            "material": material,
            "body": {
                "length": f"{LENGTH} mm",
                "radius": "10 mm",
                "control_density": "0.4 /mm",
                "chamber": [chamber, sphere],
            },
            "task": [{"name": "bend", "pressure": {"A": pressure}, "objective": {"motion": "-bending_y"}}],
            "limits": {
                "wall": "0.1 mm",
                "fold": {"distance": "0.05 mm", "neighbourhood": "0.1 mm"},
                "curvature": "9 /mm^2",
            },
            "mesh": {"size": "4 mm"},
        }
    )


def filled(mesh):
    """The mesh with the sphere full of rubber, and the elements in it."""
    inside = mesh.faces["chamber S"][:, TURNED]
    own = np.unique(inside)
    number = np.zeros(len(mesh.points), int)
    number[own] = np.arange(len(own))
    ball = fill({"": number[inside]}, {}, mesh.points[own], RADIUS)
    added = ball.points[len(own) :]
    to = np.concatenate([own, len(mesh.points) + np.arange(len(added))])
    faces = {name: nodes for name, nodes in mesh.faces.items() if name != "chamber S"}
    whole = TetMesh(np.concatenate([mesh.points, added]), np.concatenate([mesh.tets, to[ball.tets]]), faces)
    return whole, np.arange(len(mesh.tets), len(whole.tets))


def solved(mesh, rubber, mixed, pressures, gravity=None):
    model = build_model(mesh, rubber, mixed=mixed)
    at, tangent = configure(model, mesh.points, build_loads(model, pressures, gravity)), Tangent(model)
    return at, tangent, solve(at, tangent, None, 1e-10).state


NEARLY = {"model": "neo-hookean", "shear_modulus": "0.18 MPa", "bulk_modulus": "180 MPa", "density": "1.1 g/cm^3"}
CASES = {
    "gentle": (NEARLY, 0.02, (-5.0, 0.0, 12.0), (0.0, 0.02, 0.06), None),
    "aside": (NEARLY, 0.02, (0.0, 7.5, 9.0), (0.0, 0.06), None),
    "compressible": ({"name": "Hei-Cast 8400"}, 0.06, (-5.0, 0.0, 12.0), (0.0, 0.1), None),
    "weight": (NEARLY, 0.0, (-5.0, 0.0, 20.0), (0.0,), np.array([9.81e3, 0.0, 0.0])),
}


@pytest.mark.parametrize("case", CASES)
def test_a_small_void_moves_the_tip_as_one_that_is_meshed_does(case):
    material, pressure, place, inside, gravity = CASES[case]
    asked = problem(material, f"{pressure} MPa", place)
    mesh = mesh_of(asked, body_of(asked), ()).mesh
    whole, ball = filled(mesh)
    rubber, mixed = rubbers_of(asked)["body"], "shear_modulus" in material
    at, tangent, state = solved(whole, rubber, mixed, {"A": pressure}, gravity)
    motion, adjoints = tip_motion_adjoints(at, tangent, state)
    slopes = insertion_slopes(at, state, [at.model.state(each) for each in adjoints], inside)[..., ball]
    volumes = np.linalg.det(np.diff(whole.points[whole.tets[ball, :4]], axis=1)) / 6.0
    volume = whole.volume() - mesh.volume()
    predicted = volume * np.average(slopes, axis=-1, weights=volumes)
    scale = np.repeat([1.0, LENGTH], 3)
    for by_formula, value in zip(predicted.T, inside, strict=True):
        there, other, at_other = solved(mesh, rubber, mixed, {"A": pressure, "S": value}, gravity)
        found = scale * (tip_motion_adjoints(there, other, at_other)[0] - motion)
        assert np.linalg.norm(scale * by_formula - found) < WITHIN * np.linalg.norm(found), (value, by_formula, found)


def test_a_cavity_swells_as_in_the_closed_form():
    asked = problem(NEARLY, "0 kPa", (-5.0, 0.0, 12.0))
    rubber = rubbers_of(asked)["body"]
    for stretch in (0.8, 0.95, 1.02, 1.3):
        # Neo-Hookean rubber, infinitely thick.
        pressure = 0.18 * (2.5 - 2.0 / stretch - 0.5 / stretch**4)
        assert swelling(rubber, pressure) == pytest.approx(stretch**3 - 1.0, rel=2e-3)
    assert swelling(rubber, 1e-4) == pytest.approx(0.75 * 1e-4 / 0.18, rel=2e-3)
