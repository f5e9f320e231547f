"""Contact with rigid obstacles: a patch test, Hertz's sphere, the energy balance through touch, a ball that is free."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    NoEquilibrium,
    Rubber,
    State,
    Tangent,
    build_loads,
    build_model,
    configure,
    contact_forces,
    loads_of,
    model_of,
    neo_hookean_rubber,
    solve,
)
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.implicit import Implicit
from pneumorph.mechanics.contact.samples import sample_places, surface_of
from pneumorph.mechanics.contact.shapes import Plane
from pneumorph.mechanics.solve.balance import unloaded
from pneumorph.mesh import TetMesh
from pneumorph.mesh.block import block
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import Problem
from pneumorph.verify.actuator import LINEAR, PRESSURE
from pneumorph.verify.homogeneous import UNIAXIAL, homogeneous, neo_hookean
from pneumorph.verify.prescribed import residual
from pneumorph.verify.solids import BULK, RUBBER, SHEAR, distorted_cube
from pneumorph.verify.verdict import Verdict, absolute, relative
from pneumorph.verify.work import SIZE, integral

UP = np.array([0.0, 0.0, 1.0])


def patch_test(stretch: float = 0.8) -> Iterator[Verdict]:
    """Signorini's problem of a cube with a distorted mesh, pressed onto a plane that leaves its sides free.

    Its state is homogeneous: all nodes of the face keep one distance from the plane, which balances the stress.
    """
    mesh = distorted_cube(2)
    X = mesh.points
    supports = np.column_stack([X[:, 0] < 1e-9, X[:, 1] < 1e-9, X[:, 2] > 1 - 1e-9])
    activation = 0.02
    at = _on_plane(mesh, supports, 1.0 - stretch, activation, SHEAR, RUBBER)
    equilibrium = _pressed(at, 1.0 - stretch + 0.5 * activation, 1e-11)
    z = (X + equilibrium.u)[X[:, 2] < 1e-9, 2]
    yield absolute("largest difference between the heights of nodes that touch, mm", float(np.ptp(z)), 0.0, 1e-10)
    _, stress = homogeneous(BULK, neo_hookean(SHEAR), UNIAXIAL, 1.0 - float(z.mean()))
    force = contact_forces(at, equilibrium.state).on["plane"][2]
    yield relative("force on the plane, N", force, stress, 1e-9)


def hertz(cells: tuple[int, int] = (6, 6), tolerance: float = 1e-2) -> Iterator[Verdict]:
    """A quarter of a sphere of radius 50 mm, pressed onto a plane over a circle of about 1 mm.

    The radius of contact and the largest pressure are taken from moments of the pressure of Hertz's form
    p₀ √(1 − r²/a²): ⟨r²⟩ = 2a²/5 and ⟨p⟩ = 3p₀/4, with means weighted by p.

    Parameters
    ----------
    cells : numbers of cells along each edge of the block, of equal size where it touches, and growing outside.
    """
    radius, shear, poisson = 50.0, 1.0, 0.3
    bulk = 2 * shear * (1 + poisson) / (3 * (1 - 2 * poisson))
    mesh = cap(radius, cells, 1.5, 20.0)
    X = mesh.points
    supports = np.column_stack([X[:, 0] < 1e-9, X[:, 1] < 1e-9, X[:, 2] > 20.0 - 1e-9])
    depth = 1.0 / radius  # a²/R of a half-space with a = 1 mm
    activation = 0.02 * depth
    rubber = neo_hookean_rubber(shear, bulk, 1e-9)
    at = _on_plane(mesh, supports, depth, activation, 0.02 * shear, rubber)
    equilibrium = _pressed(at, depth + 0.5 * activation, 1e-5)
    acting, r, area = _pressures(at, equilibrium)
    force = 4.0 * float(np.sum(acting * area))
    modulus = 2 * shear * (1 + poisson) / (1 - poisson**2)
    a = (0.75 * force * radius / modulus) ** (1 / 3)
    weight = acting * area / np.sum(acting * area)
    yield relative("radius of contact, mm", float(np.sqrt(2.5 * np.sum(weight * r**2))), a, tolerance)
    yield relative(
        "largest pressure, MPa", 4 / 3 * float(np.sum(weight * acting)), 1.5 * force / (np.pi * a**2), tolerance
    )


def energy_balance(size: float = SIZE) -> Iterator[Verdict]:
    """The starting tube that extends by its inflation until its plate presses on a wall: ∫p dV is what it stores."""
    wall = {"name": "wall", "kind": "plane", "point": ["0 mm", "0 mm", "80.25 mm"], "normal": [0, 0, -1]}
    problem = Problem.model_validate(LINEAR | {"obstacle": [wall]})
    mesh = mesh_body(body_of(problem), size).mesh
    model = model_of(problem, mesh)
    tangent = Tangent(model)

    def at_pressure(pressure: float) -> tuple[Configuration, Equilibrium]:
        at = configure(model, mesh.points, loads_of(problem, model, {"A": pressure}))
        return at, _solved(solve(at, tangent))

    at, full = at_pressure(PRESSURE)
    # V(p) bends where the wall is touched: ∫V dp in two parts there.
    touch = _touches(lambda pressure: contact_forces(*_of(at_pressure(pressure))).on["wall"][2] > 0.0)
    within = integral(lambda p: at_pressure(p)[1].volumes["A"], touch)
    within += integral(lambda p: at_pressure(touch + p)[1].volumes["A"], PRESSURE - touch)
    rest = kernels.total(model.potential, at.X, model.state(np.zeros(model.size)), unloaded(at).loads)
    stored = kernels.total(model.potential, at.X, full.state, unloaded(at).loads) - rest
    yield relative("stored energy, N·mm", stored, PRESSURE * full.volumes["A"] - within, 1e-5)


def free_ball(size: float = 4.0, tolerance: float = 1e-6) -> Iterator[Verdict]:
    """A ball of 30 g lies on a soft tube that is clamped at its base and lies too; a guide keeps it in the middle.

    The tube carries its weight, and the clamped base that of both.
    """
    gravity, mass, density = 9.81, 0.03, 1.1e-9
    ball = {"name": "ball", "kind": "sphere", "center": ["14.6 mm", "0 mm", "20 mm"], "radius": "6 mm"}
    chamber = LINEAR["body"]["chamber"][0] | {"span": ["4 mm", "36 mm"]}
    body = {"length": "40 mm", "radius": "8 mm", "control_density": "0.5 /mm", "chamber": [chamber]}
    rubber = {"model": "neo-hookean", "shear_modulus": "0.1 MPa", "bulk_modulus": "1 MPa", "density": "1.1 g/cm^3"}
    problem = Problem.model_validate(
        LINEAR
        | {
            "material": rubber,
            "body": body | {"symmetry": {"mirror": ["xz"]}},
            "gravity": {"acceleration": f"{gravity} m/s^2", "direction": [-1, 0, 0]},
            "obstacle": [ball | {"free": {"mass": f"{1e3 * mass} g", "hold": ["y", "z"]}}],
        }
    )
    mesh = mesh_body(body_of(problem), size).mesh
    model = model_of(problem, mesh)
    at = configure(model, mesh.points, loads_of(problem, model, {}))
    equilibrium = _solved(solve(at, Tangent(model)))
    yield relative(
        "force of the ball on the tube, N",
        contact_forces(at, equilibrium.state).on["ball"][0],
        mass * gravity,
        tolerance,
    )
    forces = np.asarray(model.state(residual(at, model.vector(equilibrium.state))).u)
    weight = gravity * (mass + 1e3 * density * mesh.volume())
    base = np.unique(mesh.faces["base"])
    yield relative("force on the clamped base, N", float(forces[base, 0].sum()), weight, tolerance)


def _of(solution: tuple[Configuration, Equilibrium]) -> tuple[Configuration, State]:
    return solution[0], solution[1].state


def _touches(touched) -> float:
    low, high = 0.0, PRESSURE
    for _ in range(8):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if touched(middle) else (middle, high)
    return 0.5 * (low + high)


def cap(radius: float, cells: tuple[int, int], fine: float, size: float) -> TetMesh:
    """A quarter of a block under which is a sphere: its face "bottom" touches z = 0 at the origin.

    Parameters
    ----------
    radius : float
        Of the sphere, mm.
    cells : (2,) of int
        Numbers of equal cells, and of those that grow, along each edge.
    fine : float
        Edge of the part with equal cells, mm.
    size : float
        Edge of the whole, mm.
    """
    equal, growing = cells

    def graded(share: np.ndarray) -> np.ndarray:
        at = share * (equal + growing)
        step = fine / equal
        growth = _growth(growing, (size - fine) / step)
        beyond = np.maximum(at - equal, 0.0)
        return step * np.minimum(at, equal) + step * growth * (growth**beyond - 1) / (growth - 1)

    def mapping(r: np.ndarray) -> np.ndarray:
        x, y, z = graded(r).T
        below = radius - np.sqrt(radius**2 - x**2 - y**2)
        return np.column_stack([x, y, below + (size - below) * z / size])

    return block([equal + growing] * 3, mapping, {"bottom": lambda r: r[:, 2] == 0})


def _growth(count: int, total: float) -> float:
    """q with q + q² + … + q^count = total."""
    low, high = 1.0 + 1e-9, 10.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if sum(middle**k for k in range(1, count + 1)) > total else (middle, high)
    return low


def _on_plane(
    mesh: TetMesh, supports: np.ndarray, height: float, activation: float, stiffness: float, rubber: Rubber
) -> Configuration:
    """A body over a plane at a height; that it goes through the plane at rest does not matter."""
    surface = surface_of(mesh)
    contact = Contact(surface, {"plane": Implicit(surface, Plane(height * UP, UP), activation, stiffness)}, {}, None)
    model = build_model(mesh, rubber, plate=False, supports=supports, weight=False, contact=contact)
    return configure(model, mesh.points, build_loads(model, {}))


def _pressed(at: Configuration, raised: float, tolerance: float = 1e-6) -> Equilibrium:
    """The equilibrium, sought from a linear displacement that raises z = 0 by so much."""
    u = np.zeros(at.X.shape)
    u[:, 2] = raised * (1.0 - at.X[:, 2] / at.X[:, 2].max())
    return _solved(solve(at, Tangent(at.model), State(u, np.zeros(6)), tolerance))


def _solved(equilibrium: Equilibrium | NoEquilibrium) -> Equilibrium:
    if isinstance(equilibrium, NoEquilibrium):
        raise ComputationError(equilibrium.reason)
    return equilibrium


def _pressures(at: Configuration, equilibrium: Equilibrium) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact pressure (MPa), distance from the axis z (mm) and area (mm²) of all sample points on the plane."""
    contact = at.model.contact
    assert contact is not None
    surface = contact.surface
    places = sample_places(surface, at.X + equilibrium.u)
    acting = np.linalg.norm(contact.obstacles["plane"].pressures(places), axis=-1)
    # The padding repeats a face.
    own = slice(surface.count)
    return acting[own], np.linalg.norm(places[own, :, :2], axis=-1), surface.data[own]
