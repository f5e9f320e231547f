"""Compare the barrier of the package with a third medium, on two arms that are pressed on each other.

    python benchmarks/third_medium.py

A C in plane strain: two arms of 10 mm × 1 mm, 1 mm apart, that a wall of 1 mm joins on the left, where it is clamped.
A plate on the last 2 mm of the upper arm moves down, until the arms touch and on; the lower arm is free below, or
stands on the ground. In the gap is

- nothing, and the arms have the barrier of `mechanics/contact/contact.py`; or
- a third medium (Wriggers, Schröder and Schwarz 2013): the elements that fill the gap have the energy

      γ (μ/2 (J^(−2/3) I₁ − 3) + κ/2 ln² J) + γ κ ℓ²/2 |∇∇u|²,

  whose last part (Bluhm, Sigmund and Poulios 2021) keeps them from turning inside out.

Both have the same elements in the arms, and the same solver. The reference is CalculiX, which has to be installed, with
its contact face to face. Printed are the error of the force on the plate before and after touch, the least gap at the
end, the unknowns, and the factorisations and seconds (CPU) for all motions. Without an equilibrium the reason is
printed. It takes a quarter of an hour, most of it for media that find none.
"""

import time
from dataclasses import dataclass, replace
from functools import partial

import jax.numpy as jnp
import numpy as np
from jax.tree_util import register_dataclass

from pneumorph.mechanics import (
    NoEquilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    solve,
)
from pneumorph.mechanics.assembly.build import with_terms
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.elements.energy import ElementEnergy, Term
from pneumorph.mechanics.elements.terms import connect
from pneumorph.mesh import TetMesh
from pneumorph.mesh.block import block
from pneumorph.mesh.tets import TET_EDGES, TET_FACES, TRIANGLE_EDGES, tet_gradient
from pneumorph.verify import calculix

SHEAR, BULK = 0.49, 4.80
RUBBER = neo_hookean_rubber(SHEAR, BULK, 1.1e-9)
LENGTH, HEIGHT, DEPTH, GAP = 10.0, 3.0, 0.5, 1.0
CELLS = (20, 6, 1)
PLATE, HOLD = 2.0, 1e3  # mm of the upper arm under the plate; N/mm of the spring that draws it along
MOTIONS = {"free": (0.9, 1.2, 1.4, 1.6), "on the ground": (0.9, 1.05, 1.1, 1.2)}
"""Of the plate in mm, the first before touch, where the lower arm is free below and where it stands on the ground."""
PENALTY, NEAR = 1600.0, 0.01  # MPa/mm, of CalculiX; mm, for the slope of its force

MOST = 150  # factorisations for a motion
ACTIVATIONS = (0.1, 0.05, 0.025, 0.0125, 0.005)  # mm; the package takes a twentieth of the elements' edges: 0.025
MEDIA = [(stiffness, length) for length in (0.0, 1.0, 10.0) for stiffness in (1e-5, 1e-6, 1e-7)]


def _rule(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n³, 3) in a tetrahedron and weights of sum 1: products of Gauss's rule, drawn together at a corner.

    Many points, since elements of the medium are flattened until they would turn inside out between a few.
    """
    at, weight = np.polynomial.legendre.leggauss(count)
    a, b, c = (axis.ravel() for axis in np.meshgrid(*[(1 + at) / 2] * 3, indexing="ij"))
    product = np.einsum("i,j,k->ijk", *[weight / 2] * 3).ravel()
    return np.column_stack([a, b * (1 - a), c * (1 - a) * (1 - b)]), 6 * product * (1 - a) ** 2 * (1 - b)


_POINTS, _WEIGHTS = _rule(3)
_GRADIENT = tet_gradient(_POINTS)
_BARYCENTRIC = np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
# Shape functions are λ(2λ − 1) at corners and 4λλ' between them: their second derivatives are constant.
_SECOND = np.concatenate(
    [
        4.0 * np.einsum("ai,aj->aij", _BARYCENTRIC, _BARYCENTRIC),
        4.0 * (lambda a, b: a[:, :, None] * b[:, None] + b[:, :, None] * a[:, None])(*_BARYCENTRIC[TET_EDGES.T]),
    ]
)


@partial(register_dataclass, data_fields=["stiffness", "length"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Medium(ElementEnergy):
    """The third medium in straight quadratic tetrahedra: γ and ℓ in mm."""

    stiffness: float
    length: float

    def energies(self, local, loads):
        corners = local.X[:, :4]
        jacobian = jnp.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
        inverse, volume = jnp.linalg.inv(jacobian), jnp.linalg.det(jacobian) / 6.0
        F = jnp.eye(3) + jnp.einsum("eai,gak,ekj->egij", local.u, _GRADIENT, inverse)
        J = jnp.linalg.det(F)
        inside = jnp.where(J > 0.0, J, 1.0)
        shear = 0.5 * SHEAR * (inside ** (-2 / 3) * jnp.sum(F**2, axis=(2, 3)) - 3.0)
        density = jnp.where(J > 0.0, shear + 0.5 * BULK * jnp.log(inside) ** 2, jnp.nan) @ _WEIGHTS
        hessian = jnp.einsum("eai,akl,ekj,elm->eijm", local.u, _SECOND, inverse, inverse)
        smooth = 0.5 * BULK * self.length**2 * jnp.sum(hessian**2, axis=(1, 2, 3))
        return self.stiffness * volume * (density + smooth)


def arms(below: str) -> tuple[TetMesh, np.ndarray]:
    """The C with faces base, tip, upper and lower; all nodes of the block, and the elements (n, 10) of the gap.

    What is `below` the lower arm is a key of `MOTIONS`.
    """
    whole = block(CELLS, lambda r: r * [LENGTH, HEIGHT, DEPTH], {})
    center = whole.points[whole.tets[:, :4]].mean(axis=1)
    void = (np.abs(center[:, 1] - HEIGHT / 2) < GAP / 2) & (center[:, 0] > 1.0)
    solid = whole.tets[~void]
    sides = solid[:, TET_FACES]
    _, index, count = np.unique(np.sort(sides.reshape(-1, 3)), axis=0, return_index=True, return_counts=True)
    edge = {frozenset(pair): 4 + k for k, pair in enumerate(TET_EDGES.tolist())}
    middle = np.array([[edge[frozenset(face[pair])] for pair in TRIANGLE_EDGES] for face in TET_FACES])
    faces = np.concatenate([sides, solid[:, middle]], axis=2).reshape(-1, 6)[index[count == 1]]
    x, y, _ = whole.points[faces].transpose(2, 0, 1)

    def at(height: float) -> np.ndarray:
        return np.abs(y - height).max(axis=1) < 1e-9

    chosen = {
        "base": (x.max(axis=1) < 1e-9) | (at(0.0) & (below != "free")),
        "tip": at(HEIGHT) & (x.min(axis=1) > LENGTH - PLATE - 1e-9),
        "upper": at((HEIGHT + GAP) / 2),
        "lower": at((HEIGHT - GAP) / 2),
    }
    return TetMesh(whole.points, solid, {name: faces[own] for name, own in chosen.items()}), whole.tets[void]


def compact(mesh: TetMesh) -> TetMesh:
    """The mesh without nodes that are in no element."""
    used, tets = np.unique(mesh.tets, return_inverse=True)
    number = np.full(len(mesh.points), -1)
    number[used] = np.arange(len(used))
    faces = {name: number[triangles] for name, triangles in mesh.faces.items()}
    return TetMesh(mesh.points[used], tets.reshape(-1, 10), faces)


def held(mesh: TetMesh, contact=None):
    supports = np.zeros(mesh.points.shape, bool)
    supports[:, 2] = True
    supports[np.unique(mesh.faces["base"])] = True
    return build_model(mesh, RUBBER, supports=supports, weight=False, contact=contact)


def with_barrier(mesh: TetMesh, activation: float):
    surface = surface_of(TetMesh(mesh.points, mesh.tets, {name: mesh.faces[name] for name in ("upper", "lower")}))
    return held(mesh, Contact(surface, {}, {}, Pairs(surface, mesh.points, True, [], activation, SHEAR)))


def with_medium(mesh: TetMesh, gap: np.ndarray, stiffness: float, length: float):
    plain = held(mesh)
    return with_terms(plain, [*plain.terms, Term(connect(gap), Medium(stiffness, length))])


def least_gap(mesh: TetMesh, u: np.ndarray) -> float:
    """The least height in mm of the upper arm's inner nodes above the lower arm, in the plane z = 0."""
    sides = []
    for name in ("upper", "lower"):
        nodes = np.unique(mesh.faces[name])
        places = (mesh.points + u)[nodes[mesh.points[nodes, 2] < 1e-9]]
        sides.append(places[np.argsort(places[:, 0])])
    upper, lower = sides
    return float((upper[:, 1] - np.interp(upper[:, 0], lower[:, 0], lower[:, 1]))[upper[:, 0] < lower[-1, 0]].min())


def pressed(mesh: TetMesh, model, to: tuple[float, ...]):
    """Motions of the plate and the forces on it (M,), the least gap at the end and the factorisations, or a reason."""
    spring, tangent, since = HOLD * np.eye(6)[1], Tangent(model), None
    motions, factorisations = [], 0
    at = configure(model, mesh.points, build_loads(model, {}), np.arange(6) != 1)
    for distance in to:
        at = replace(at, loads=build_loads(model, {}, spring=spring, wrench=-spring * distance))
        found = solve(at, tangent, since=since, most=MOST)
        if isinstance(found, NoEquilibrium):
            return f"at {distance:g} mm: {found.reason}"
        since = at.loads, found.state
        factorisations += found.factorisations
        motions.append(found.plate[1])
    moved = np.array(motions)
    return moved, -HOLD * (np.array(to) + moved), least_gap(mesh, found.u), factorisations


def compare(below: str) -> None:
    """Print the table of a lower arm that is free below or stands on the ground."""
    full, gap = arms(below)
    mesh, to = compact(full), MOTIONS[below]
    cases = [(f"barrier, {each:g} mm", mesh, partial(with_barrier, mesh, each)) for each in ACTIVATIONS]
    cases += [
        (f"medium, γ = {g:g}, ℓ = {size:g} mm", full, partial(with_medium, full, gap, g, size)) for g, size in MEDIA
    ]
    own = held(mesh)
    sides = mesh.faces["upper"], mesh.faces["lower"]
    still = configure(own, mesh.points, build_loads(own, {}))
    # Twice at every motion: the spring gives way a little, and the reference is that at the motion reached.
    near = np.array([[each - NEAR, each] for each in to])
    reference = calculix.tip_forces(mesh, still, sides, PENALTY, (-near).ravel().tolist())[:, 1].reshape(-1, 2)
    print(f"\nThe lower arm is {below}. Force on the plate by CalculiX, N: {reference[:, 1].round(5).tolist()}\n")
    titles = [f"{each:g} mm" for each in to]
    print("| | " + " | ".join(["unknowns", *titles, "least gap", "factorisations", "seconds"]) + " |")
    print("|" + " --- |" * (len(titles) + 5))
    for name, of, build in cases:
        started = time.process_time()
        model = build()
        found = pressed(of, model, to)
        seconds = time.process_time() - started
        unknowns = int(np.count_nonzero(~model.fixed))
        if isinstance(found, str):
            print(f"| {name} | {unknowns} | {found} |", flush=True)
            continue
        moved, forces, least, count = found
        slope = (reference[:, 1] - reference[:, 0]) / NEAR
        errors = forces / (reference[:, 1] - slope * (np.array(to) + moved)) - 1.0
        shown = " | ".join(f"{100 * error:+.2f} %" for error in errors)
        print(f"| {name} | {unknowns} | {shown} | {1e3 * least:.2f} µm | {count} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    for below in MOTIONS:
        compare(below)
