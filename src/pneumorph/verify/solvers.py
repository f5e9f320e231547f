"""The same actuator by other solvers: NGSolve to the last digits, CalculiX to what its own quadrature leaves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.geometry import Body, starting_body
from pneumorph.mechanics import Equilibrium, NoEquilibrium, Tangent, configuration, loads_of, model_of, solve
from pneumorph.mesh import mesh_body
from pneumorph.mesh.tets import TetMesh
from pneumorph.verify import symbolic
from pneumorph.verify.actuator import PRESSURE, bellows, linear_actuator
from pneumorph.verify.verdict import Verdict, absolute, relative


def ngsolve(body: Body | None = None, size: float = 3.0) -> Iterator[Verdict]:
    """A body (the linear actuator's start by default) at 60 kPa with a rigid plate, by NGSolve's symbolic forms."""
    symbolic.ngsolve()
    mesh, found = inflated(body or starting_body(linear_actuator().body), size)
    shear, bulk = linear_actuator().material.shear_modulus, linear_actuator().material.bulk_modulus

    # Newton begins 1 % away from our answer, so that it has to find its own.
    u, plate = symbolic.equilibrium(
        mesh, lambda F: symbolic.neo_hookean(F, shear, bulk), {"A": PRESSURE}, 0.99 * found.u, 0.99 * found.plate
    )
    yield relative("axial motion of the plate, mm", found.plate[2], plate[2], 1e-6)
    length = float(np.linalg.norm(plate[:3]))
    yield absolute("plate's translation off / its length", np.linalg.norm(found.plate[:3] - plate[:3]) / length, 0, 1e-6)
    yield absolute("largest nodal difference / largest displacement", np.abs(found.u - u).max() / np.abs(u).max(), 0, 1e-6)


def inflated(body: Body, size: float) -> tuple[TetMesh, Equilibrium]:
    """A body of the linear actuator's problem meshed at `size` mm, and its equilibrium at 60 kPa."""
    problem = linear_actuator()
    mesh = mesh_body(body, size).mesh
    built = model_of(problem, mesh)
    found = solve(configuration(built, mesh.points, loads_of(problem, built, {"A": PRESSURE})), Tangent(built))
    if isinstance(found, NoEquilibrium):
        raise ComputationError(found.reason)
    return mesh, found
