"""Thick spheres and tubes under pressure, against radial boundary-value problems, closed forms and Lamé's solutions."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from scipy.special import roots_jacobi

from pneumorph.errors import ComputationError
from pneumorph.mechanics import (
    NoEquilibrium,
    Rubber,
    Tangent,
    build_loads,
    build_model,
    configure,
    follow,
    neo_hookean_rubber,
    solve,
)
from pneumorph.mesh.tets import TetMesh, tet_gradient, tet_shape
from pneumorph.verify.incompressible import radius_at, sphere_pressure, tube_pressure
from pneumorph.verify.radial import SPHERE, TUBE, Displacement, inflated, lame
from pneumorph.verify.solids import BULK, DENSITY, RUBBER, SHEAR, octant, tube, with_lids
from pneumorph.verify.verdict import Verdict, absolute, at_least, relative

YOUNG, POISSON = 9 * BULK * SHEAR / (3 * BULK + SHEAR), (3 * BULK - 2 * SHEAR) / (2 * (3 * BULK + SHEAR))

SPACE, SECTION = [0, 1, 2], [0, 1]
"""The axes of the radius of a sphere, and of a tube."""


def thick_sphere(counts: tuple[int, int, int] = (4, 8, 8), tolerance: float = 1e-4) -> Iterator[Verdict]:
    """A sphere of radii 10 and 12 mm at 0.02 MPa."""
    mesh = octant(10, 12, counts)
    u = inflate(mesh, sphere_supports(mesh), RUBBER, 0.02)
    yield from _at_the_walls(mesh, u, inflated(RUBBER, 10, 12, 0.02, SPHERE), (10, 12), SPACE, tolerance)


def plane_strain_tube(counts: tuple[int, int, int] = (4, 24, 1), tolerance: float = 5e-4) -> Iterator[Verdict]:
    """A tube of radii 4 and 8 mm at 0.10 MPa, which widens the bore by 17 %."""
    mesh, lids = with_lids(tube(4, 8, 2, counts), 2)
    u = inflate(mesh, tube_supports(mesh, lids), RUBBER, 0.10)
    yield from _at_the_walls(mesh, u, inflated(RUBBER, 4, 8, 0.10, TUBE), (4, 8), SECTION, tolerance)


def incompressible(tolerance: float = 5e-3) -> Iterator[Verdict]:
    """The same sphere and tube at κ/μ = 10⁵, with mixed elements, two through the wall."""
    solid = neo_hookean_rubber(SHEAR, 1e5 * SHEAR, DENSITY)
    mesh = octant(10, 12, (2, 4, 4))
    u = inflate(mesh, sphere_supports(mesh), solid, 0.02, mixed=True)
    exact = radius_at(0.02 / SHEAR, sphere_pressure, 10, 12) - 10
    yield relative("sphere: u(10 mm), mm", wall_displacement(mesh, u, 10, SPACE), exact, tolerance)
    mesh, lids = with_lids(tube(4, 8, 2, (2, 12, 1)), 2)
    u = inflate(mesh, tube_supports(mesh, lids), solid, 0.10, mixed=True)
    exact = radius_at(0.10 / SHEAR, tube_pressure, 4, 8) - 4
    yield relative("tube: u(4 mm), mm", wall_displacement(mesh, u, 4, SECTION), exact, tolerance)


def limit_points(tolerance: float = 5e-3) -> Iterator[Verdict]:
    """Limit points of spheres with B/A = 2 and 1.2 at κ/μ = 10⁵, found by path following.

    Raises
    ------
    ComputationError
        If a path has no limit point.
    """
    for outer, counts, pressure, stretch in ((2.0, (2, 4, 4), 0.816424, 1.82815), (1.2, (1, 5, 5), 0.225138, 1.47016)):
        mesh = octant(1, outer, counts)
        built = build_model(
            mesh, neo_hookean_rubber(1.0, 1e5, 1e-9), plate=False, supports=sphere_supports(mesh), mixed=True
        )
        at = configure(built, mesh.points, build_loads(built, {"A": 1.0}))
        path = follow(at, Tangent(built), first_limit=True)
        if isinstance(path, NoEquilibrium) or not path.limits:
            raise ComputationError(f"no limit point was found on the path of the sphere with B/A = {outer:g}")
        limit = path.limits[0]
        yield relative(f"limit pressure / shear modulus, B/A = {outer:g}", limit.load, pressure, tolerance)
        widened = 1 + wall_displacement(mesh, limit.equilibrium.u, 1, SPACE)
        yield relative(f"stretch of the inner wall there, B/A = {outer:g}", widened, stretch, tolerance)


def radial_references() -> Iterator[Verdict]:
    """The reference solver of the radial problems itself, against four independently computed numbers."""
    sphere, bore = inflated(RUBBER, 10, 12, 0.02, SPHERE), inflated(RUBBER, 4, 8, 0.10, TUBE)
    for word, field, radius, known in (
        ("sphere", sphere, 10.0, 0.28719543),
        ("sphere", sphere, 12.0, 0.21189583),
        ("tube", bore, 4.0, 0.69981819),
        ("tube", bore, 8.0, 0.39689806),
    ):
        yield absolute(f"u({radius:g} mm) of the {word}, mm", float(field(np.array(radius))), known, 1e-8)


def lame_limit(counts: int = 4, tolerance: float = 3e-3) -> Iterator[Verdict]:
    """A thick sphere and tube at 1e-6 MPa, where rubber is linearly elastic."""
    pressure = 1e-6
    mesh = octant(4, 8, (counts, counts, counts))
    u = inflate(mesh, sphere_supports(mesh), RUBBER, pressure)
    exact = lame(YOUNG, POISSON, 4, 8, pressure, SPHERE)
    yield from _at_the_walls(mesh, u, exact, (4, 8), SPACE, tolerance, "sphere: ")
    mesh, lids = with_lids(tube(4, 8, 2, (counts, 6 * counts, 1)), 2)
    u = inflate(mesh, tube_supports(mesh, lids), RUBBER, pressure)
    exact = lame(YOUNG, POISSON, 4, 8, pressure, TUBE)
    yield from _at_the_walls(mesh, u, exact, (4, 8), SECTION, tolerance, "tube: ")


def convergence(counts: tuple[int, ...] = (3, 4, 6)) -> Iterator[Verdict]:
    """Convergence of the L2 error of the displacement of a sphere of radii 5 and 10 mm at 0.1 MPa, on curved meshes."""
    exact = inflated(RUBBER, 5, 10, 0.1, SPHERE)
    errors = []
    for count in counts:
        mesh = octant(5, 10, (count, count, count))
        errors.append(l2_error(mesh, inflate(mesh, sphere_supports(mesh), RUBBER, 0.1), exact))
    for (coarse, fine), (much, less) in zip(pairwise(counts), pairwise(errors), strict=True):
        order = np.log(much / less) / np.log(fine / coarse)
        yield at_least(f"order of the L2 error from {coarse} to {fine} elements through the wall", order, 2.8)


def l2_error(mesh: TetMesh, u: np.ndarray, exact: Displacement) -> float:
    """‖u − u_exact‖ / ‖u_exact‖ over the volume of a sphere, where u_exact is radial."""
    rule, weights = _tet_rule(4)
    shape, gradient = tet_shape(rule), tet_gradient(rule)
    nodes = mesh.points[mesh.tets]
    X = np.einsum("qa,eai->eqi", shape, nodes)
    measure = weights * np.linalg.det(np.einsum("eai,qak->eqik", nodes, gradient))
    radius = np.linalg.norm(X, axis=-1)
    expected = X * (exact(radius.ravel()).reshape(radius.shape) / radius)[:, :, None]
    difference = np.einsum("qa,eai->eqi", shape, u[mesh.tets]) - expected
    return float(np.sqrt(np.sum(measure * np.sum(difference**2, -1)) / np.sum(measure * np.sum(expected**2, -1))))


def _tet_rule(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Conical product of Gauss–Jacobi rules on the unit tetrahedron, exact to degree 2·count − 1 (Stroud 1971)."""
    (x, a), (y, b), (z, c) = (roots_jacobi(count, power, 0) for power in (2, 1, 0))
    x, y, z = ((1 + t) / 2 for t in (x, y, z))
    X, Y, Z = np.meshgrid(x, y, z, indexing="ij")
    weights = np.einsum("i,j,k->ijk", a / 8, b / 4, c / 2)
    return np.stack([X, Y * (1 - X), Z * (1 - X) * (1 - Y)], axis=-1).reshape(-1, 3), weights.ravel()


def inflate(mesh: TetMesh, supports: np.ndarray, rubber: Rubber, pressure: float, mixed: bool = False) -> np.ndarray:
    """Displacements (N, 3) in mm of a mesh under pressure.

    Parameters
    ----------
    mesh : TetMesh
        With the face "chamber A".
    supports : (N, 3) bool
        Components fixed at zero.
    rubber : Rubber
    pressure : float
        In chamber A, MPa.
    mixed : bool
        Whether elements are mixed.

    Raises
    ------
    ComputationError
        If no equilibrium is found.
    """
    built = build_model(mesh, rubber, plate=False, supports=supports, mixed=mixed)
    answer = solve(configure(built, mesh.points, build_loads(built, {"A": pressure})), Tangent(built))
    if isinstance(answer, NoEquilibrium):
        raise ComputationError(answer.reason)
    return answer.u


def sphere_supports(mesh: TetMesh) -> np.ndarray:
    """Supports (N, 3) bool of an octant: no motion normal to its three symmetry planes."""
    return np.abs(mesh.points) < 1e-9


def tube_supports(mesh: TetMesh, lids: np.ndarray) -> np.ndarray:
    """Supports (N, 3) bool for plane strain: no motion along z; nodes on the two axes prevent rigid motions."""
    supports = np.zeros((len(mesh.points), 3), bool)
    supports[:, 2] = True
    supports[lids] = True
    supports[np.abs(mesh.points[:, 1]) < 1e-9, 1] = True
    supports[np.abs(mesh.points[:, 0]) < 1e-9, 0] = True
    return supports


def wall_displacement(mesh: TetMesh, u: np.ndarray, radius: float, axes: list[int]) -> float:
    """Mean radial displacement of the nodes at a radius, mm.

    Parameters
    ----------
    mesh : TetMesh
    u : (N, 3) array
        Displacements, mm.
    radius : float
        Undeformed, mm.
    axes : list of int
        The coordinates of which the radius is: all of a sphere's, two of a tube's.
    """
    on = np.abs(np.linalg.norm(mesh.points[:, axes], axis=1) - radius) < 1e-6
    return float((np.sum(u[on][:, axes] * mesh.points[on][:, axes], axis=1) / radius).mean())


def _at_the_walls(mesh, u, exact: Displacement, radii, axes, tolerance, word="") -> Iterator[Verdict]:
    for radius in radii:
        ours = wall_displacement(mesh, u, radius, axes)
        yield relative(f"{word}u({radius:g} mm), mm", ours, float(exact(np.array(float(radius)))), tolerance)
