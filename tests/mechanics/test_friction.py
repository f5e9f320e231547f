"""Friction on obstacles: what sticks is held, what slips is held by the coefficient times the normal force."""

import numpy as np
import pytest

from pneumorph.mechanics import (
    Equilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    contact_forces,
    neo_hookean_rubber,
    sweep_with_friction,
)
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.implicit import Implicit
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.contact.shapes import Box, Plane
from pneumorph.mechanics.contact.triangulated import Triangulated
from pneumorph.verify.solids import distorted_cube

COEFFICIENT, ACTIVATION, HEIGHT = 0.1, 0.04, -0.05
MESH = distorted_cube(2)
PRESSED = 0.15
WAY = [(x, PRESSED) for x in (0.0, 0.01, 0.01, 0.1, 0.2, 0.19, 0.0)]
"""Displacements of the plane along x and z, step by step."""


SURFACE = surface_of(MESH)
PLANE = Implicit(SURFACE, Plane(np.array([0.0, 0.0, HEIGHT]), np.array([0.0, 0.0, 1.0])), ACTIVATION, 0.49)
BLOCK = Box(np.array([0.5, 0.5, HEIGHT - 1.0]), np.array([4.0, 4.0, 1.0])).mesh(0.0)


@pytest.fixture(scope="module", params=["plane", "triangles"])
def steps(request):
    """A cube of 1 mm that hangs by its top, and a plane that is pressed onto it from below and moved along it."""
    plane = PLANE if request.param == "plane" else Triangulated(SURFACE, BLOCK, ACTIVATION, 0.49)
    supports = np.repeat((MESH.points[:, 2] > 1 - 1e-9)[:, None], 3, axis=1)
    contact = Contact(SURFACE, {"plane": plane}, {}, None)
    rubber = neo_hookean_rubber(0.49, 4.80, 1.1e-9)
    model = build_model(MESH, rubber, plate=False, supports=supports, weight=False, contact=contact)
    path = [configure(model, MESH.points, build_loads(model, {}, moves={"plane": (x, 0.0, z)})) for x, z in WAY]
    found = list(sweep_with_friction(path, Tangent(model), COEFFICIENT))
    assert all(isinstance(each, Equilibrium) for _, each in found), [getattr(each, "reason", "") for _, each in found]
    return [(at, each, contact_forces(at, each.state)) for at, each in found]


def test_friction_is_what_holds_the_cube(steps):
    for at, found, forces in steps:
        _, residual = kernels.value_and_residual(at.model.potential, at.X, found.state, at.loads)
        held = np.where(at.model.supports, residual.u, 0.0).sum(axis=0)
        assert held == pytest.approx(forces.on["plane"], abs=1e-8)


def test_friction_is_never_more_than_the_coefficient_allows(steps):
    friction = np.array([forces.on["plane"][:2] for *_, forces in steps])
    normal = np.array([forces.normal["plane"] for *_, forces in steps])
    assert normal.min() > 0.05
    assert np.all(np.linalg.norm(friction, axis=1) <= COEFFICIENT * normal * (1 + 1e-3))
    # It is all of that where the whole face slips; against the motion of the plane, so the cube pulls it back.
    slips = [4, 6]
    assert friction[slips, 0] == pytest.approx(COEFFICIENT * normal[slips] * np.array([-1.0, 1.0]), rel=2e-2)


def test_what_sticks_does_not_creep(steps):
    """A small displacement is followed; a step without one changes nothing; on the way back it sticks at first."""
    pulls = [forces.on["plane"][0] for *_, forces in steps]
    limit = COEFFICIENT * steps[1][2].normal["plane"]
    assert 0.05 * limit < -(pulls[1] - pulls[0]) < 0.7 * limit
    assert pulls[2] == pytest.approx(pulls[1], rel=5e-3)
    assert (pulls[5] - pulls[4]) == pytest.approx(-(pulls[1] - pulls[0]), rel=0.3)
