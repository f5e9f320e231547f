"""A ring that is closed until its inner wall meets itself, with the contact of CalculiX on the same mesh.

Half a thick ring in plane strain; x = 0 is its mirror plane. It is clamped to the ground along a short arc outside at
the bottom, and to a plate along another at the top, which moves down. The upper and the lower half of the inner wall
meet: parts of one surface, which no mirror plane keeps apart. The bore is eccentric: so nodes meet faces, and the ring
has only one way to go; one of even thickness could evade to both sides, and CalculiX's does where it is pressed hard.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.mechanics import (
    Configuration,
    NoEquilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    solve,
)
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mesh import TetMesh
from pneumorph.mesh.block import block
from pneumorph.verify import calculix
from pneumorph.verify.solids import RUBBER, SHEAR
from pneumorph.verify.verdict import Verdict, relative

INNER, OUTER, DEPTH, ECCENTRICITY = 5.0, 7.0, 0.6, 0.4
CLAMPED = 1 / 16
"""Radii and the depth of the ring in mm, and the parts of half its circumference that are clamped."""

CLOSED = (9.0, 10.4, 10.6, 10.8, 11.0, 11.2)
"""How far the plate comes down, mm. The wall meets itself at 10.2 mm."""

ACTIVATION = 0.00125
"""The activation distance of the barrier in mm: surfaces that press on each other keep a part of it as a gap."""

LARGER = {0.02: 5e-2, 0.005: 2e-2}
"""Errors that are allowed soon after touch for larger activation distances, mm: they fall with it."""

HOLD = 1e3
"""Stiffness in N/mm of the spring that draws the plate along; its force is that on the ring."""

PENALTY = 1600.0
"""MPa/mm: at a pressure of 0.5 MPa CalculiX's surfaces go through each other by 0.3 µm."""


def self_contact(
    cells: int = 32,
    activation: float = ACTIVATION,
    closed: Sequence[float] = CLOSED,
    larger: Mapping[float, float] = LARGER,
    tolerance: float = 1e-2,
) -> Iterator[Verdict]:
    """The force on the plate at several distances, the first before the wall meets itself, the second soon after.

    Parameters
    ----------
    cells : number of cells around half the ring, a multiple of 16.
    activation : the activation distance of the barrier, mm.
    larger : larger ones with the errors that they may have at the second distance.
    """
    calculix.program()
    mesh = half_ring(cells)
    motions, forces = pressed(mesh, activation, closed)
    held = _supported(mesh, activation)
    theirs = calculix.tip_forces(mesh, held, sides(mesh), PENALTY, motions.tolist())[:, 1]
    for distance, ours, reference in zip(closed, forces, theirs, strict=True):
        yield relative(f"force at {distance:g} mm, N", ours, reference, tolerance)
    for wider, allowed in larger.items():
        _, found = pressed(mesh, wider, closed[:2])
        yield relative(f"force at {closed[1]:g} mm, activation distance {wider:g} mm, N", found[1], theirs[1], allowed)


def half_ring(cells: int) -> TetMesh:
    """The half with x > 0: two cells through the wall, one along z; faces base, tip and "wall", the inner one."""

    def mapping(r: np.ndarray) -> np.ndarray:
        radius, angle = INNER + (OUTER - INNER) * r[:, 0], np.pi * (r[:, 1] - 0.5)
        lowered = ECCENTRICITY * (1.0 - r[:, 0])
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle) - lowered, DEPTH * r[:, 2]])

    faces = {
        "base": lambda r: (r[:, 0] == 1) & (r[:, 1] <= CLAMPED),
        "tip": lambda r: (r[:, 0] == 1) & (r[:, 1] >= 1 - CLAMPED),
        "wall": lambda r: r[:, 0] == 0,
    }
    return block((2, cells, 1), mapping, faces)


def sides(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray]:
    """The upper and the lower half of the inner wall, (nf, 6) each."""
    wall = mesh.faces["wall"]
    upper = mesh.points[wall, 1].mean(axis=1) > -ECCENTRICITY
    return wall[upper], wall[~upper]


def pressed(mesh: TetMesh, activation: float, closed: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """How far the plate moves along y, mm, and the forces on it, N, when it is drawn down by a spring.

    Raises
    ------
    ComputationError
        If there is no equilibrium.
    """
    held = _supported(mesh, activation)
    tangent, since = Tangent(held.model), None
    spring = HOLD * np.eye(6)[1]
    motions = []
    for distance in closed:
        loads = build_loads(held.model, {}, spring=spring, wrench=-spring * distance)
        at = replace(held, loads=loads)
        equilibrium = solve(at, tangent, since=since)
        if isinstance(equilibrium, NoEquilibrium):
            raise ComputationError(equilibrium.reason)
        since = at, equilibrium.state
        motions.append(equilibrium.plate[1])
    moved = np.array(motions)
    return moved, -HOLD * (np.array(closed) + moved)


def _supported(mesh: TetMesh, activation: float) -> Configuration:
    """The ring without loads, with its supports; its plate moves along y only, and its inner wall may touch itself."""
    X = mesh.points
    supports = np.column_stack([np.abs(X[:, 0]) < 1e-9, np.zeros(len(X), bool), np.ones(len(X), bool)])
    supports[np.unique(mesh.faces["base"])] = True
    surface = surface_of(mesh)
    own = Pairs(surface, X, True, [], activation, SHEAR)
    model = build_model(mesh, RUBBER, supports=supports, weight=False, contact=Contact(surface, {}, {}, own))
    return configure(model, X, build_loads(model, {}), np.arange(6) != 1)
