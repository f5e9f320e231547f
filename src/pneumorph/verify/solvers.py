"""The same actuators by other solvers: NGSolve with the same quadrature, CalculiX with its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.geometry.tube.lining import build_linings
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    NoEquilibrium,
    Tangent,
    configure,
    loads_of,
    model_of,
    solve,
)
from pneumorph.mesh.tets import TetMesh
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import Problem
from pneumorph.verify import calculix as ccx
from pneumorph.verify import symbolic
from pneumorph.verify.actuator import PRESSURE, linear_actuator
from pneumorph.verify.verdict import Verdict, absolute, relative

SIZE = 4.0
"""Edge length of the meshes, mm. It need not be fine, since all solvers use the same mesh."""


Make = Callable[[], Problem]


def ngsolve(body: Callable[[], Body], size: float = SIZE, problem: Make = linear_actuator) -> Iterator[Verdict]:
    """Compare a body at 60 kPa, with a rigid plate, with NGSolve's symbolic forms."""
    symbolic.ngsolve()
    mesh, at, equilibrium = inflated(body, size, problem)
    own = [at.model.rubbers[name] for name in mesh.regions or at.model.rubbers]
    energies = [partial(symbolic.neo_hookean, shear=rubber.parameters[0], bulk=rubber.bulk_modulus) for rubber in own]
    # Newton's method starts 1 % away from our solution, so that it has to find its own.
    u, plate = symbolic.equilibrium(mesh, energies, {"A": PRESSURE}, 0.99 * equilibrium.u, 0.99 * equilibrium.plate)
    yield from compared(equilibrium, u, plate, 1e-6)


def calculix(body: Callable[[], Body], size: float = SIZE, problem: Make = linear_actuator) -> Iterator[Verdict]:
    """Compare a body at 60 kPa, with a rigid plate, with CalculiX, which starts from rest."""
    ccx.program()
    mesh, at, equilibrium = inflated(body, size, problem)
    yield from compared(equilibrium, *ccx.equilibrium(mesh, at), 5e-3)


def compared(equilibrium: Equilibrium, u: np.ndarray, plate: np.ndarray, tolerance: float) -> Iterator[Verdict]:
    """Compare an equilibrium with that of another solver.

    Parameters
    ----------
    equilibrium : Equilibrium
    u : (N, 3) array
        Displacements by the other solver, mm.
    plate : (6,) array
        Its motion of the plate, mm and rad.
    tolerance : float
        Relative.
    """
    yield relative("axial motion of the plate, mm", equilibrium.plate[2], plate[2], tolerance)
    off = float(np.linalg.norm(equilibrium.plate[:3] - plate[:3]) / np.linalg.norm(plate[:3]))
    yield absolute("difference of the plate's translations / its length", off, 0.0, tolerance)
    off = np.abs(equilibrium.u - u).max() / np.abs(u).max()
    yield absolute("largest difference of a displacement / largest displacement", off, 0.0, tolerance)


def start() -> Body:
    """The starting body of the linear actuator."""
    return starting_body(linear_actuator().tubes)


@cache
def inflated(
    body: Callable[[], Body], size: float, problem: Make = linear_actuator
) -> tuple[TetMesh, Configuration, Equilibrium]:
    """Mesh a body of a problem with edges of `size` mm, and find its equilibrium at 60 kPa.

    Raises
    ------
    ComputationError
        If there is no equilibrium.
    """
    asked = problem()
    mesh = mesh_body(body(), size, (), build_linings(asked.tubes, asked.region)).mesh
    built = model_of(asked, mesh)
    at = configure(built, mesh.points, loads_of(asked, built, {"A": PRESSURE}))
    answer = solve(at, Tangent(built))
    if isinstance(answer, NoEquilibrium):
        raise ComputationError(answer.reason)
    return mesh, at, answer
