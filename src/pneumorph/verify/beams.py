"""A slender bar in large bending: by a moment into a circular arc, by a dead force into Euler's elastica.

In the reference, the elastica, the bar neither stretches nor shears, and its curvature κ is proportional to the moment.
A solid bar of length L and width w differs by terms of second order in w/L and in the strain κw/2 at its sides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_bvp

from pneumorph.errors import ComputationError
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Model,
    NoEquilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
)
from pneumorph.mechanics.elements.reinforcement import Membrane
from pneumorph.mechanics.solve.sweep import sweep
from pneumorph.mesh.tets import RULE, Covered, TetMesh
from pneumorph.verify.solids import bar
from pneumorph.verify.verdict import Verdict, absolute, relative

YOUNG = 1.0
RUBBER = neo_hookean_rubber(YOUNG / 2, YOUNG / 3, 1e-9)
"""Poisson's ratio is 0, so that the clamped ends do not hinder lateral contraction, which would stiffen the bar."""

WIDTH, LENGTH = 1.0, 40.0
STIFFNESS = YOUNG * WIDTH**4 / 12
"""Bending stiffness EI of the square section, N·mm²."""

COUNTS = (2, 2, 32)

SHEETS = (1.0, 100.0, 10000.0)
"""Stiffnesses of a sheet on one face, N/mm; the bar's own is 1 N."""

MATTIASSON = {1.0: (0.30172, 0.05643, 0.46135), 5.0: (0.71379, 0.38763, 1.21537)}
"""P L²/EI: sideways and axial motion of the tip over L, and its angle (Mattiasson 1981, table I)."""


def moment(counts: tuple[int, int, int] = COUNTS, tolerance: float = 2e-3) -> Iterator[Verdict]:
    """Tip moments that bend the bar to an eighth, a quarter and half of a circle."""
    turns = np.pi * np.arange(1, 17) / 16
    path = bend(counts, [np.array([0, 0, 0, 0, STIFFNESS * turn / LENGTH, 0]) for turn in turns])
    for turn, equilibrium in zip(turns, path, strict=True):
        if turn not in (turns[3], turns[7], turns[15]):
            continue
        radius, part = LENGTH / turn, f"{turn / np.pi:g}π rad"
        sideways, axial = radius * (1 - np.cos(turn)) / LENGTH, radius * np.sin(turn) / LENGTH - 1
        yield relative(f"rotation at {part}, rad", equilibrium.plate[4], turn, tolerance)
        yield absolute(f"lateral motion / length at {part}", equilibrium.plate[0] / LENGTH, sideways, tolerance)
        yield absolute(f"axial motion / length at {part}", equilibrium.plate[2] / LENGTH, axial, tolerance)


def force(counts: tuple[int, int, int] = COUNTS, tolerance: float = 2e-3) -> Iterator[Verdict]:
    """Transverse dead forces at the tip, P L²/EI = 1 and 5."""
    steps = np.arange(1, 11) / 2
    path = bend(counts, [np.array([load * STIFFNESS / LENGTH**2, 0, 0, 0, 0, 0]) for load in steps])
    for load, equilibrium in zip(steps, path, strict=True):
        if load not in MATTIASSON:
            continue
        sideways, axial, turn = elastica(load)
        yield absolute(
            f"lateral motion / length at PL²/EI = {load:g}", equilibrium.plate[0] / LENGTH, sideways, tolerance
        )
        yield absolute(f"axial motion / length at PL²/EI = {load:g}", equilibrium.plate[2] / LENGTH, -axial, tolerance)
        yield relative(f"rotation at PL²/EI = {load:g}, rad", equilibrium.plate[4], turn, tolerance)


def layered(counts: tuple[int, int, int] = (2, 2, 16), tolerance: float = 1e-2) -> Iterator[Verdict]:
    """A small tip moment on the bar with a sheet of k N/mm on one face: K = EI + w²/4 / (1/EA + 1/kw).

    A sheet that does not stretch is where the bar does not either, so that its K is E w⁴/3, four times as large.
    """
    area, bare = YOUNG * WIDTH**2, STIFFNESS
    mesh = _covered(bar(WIDTH, LENGTH, counts))
    for stiffness in SHEETS:
        sheet = Membrane(stiffness, 0.0, 1.0)
        built = build_model(mesh, RUBBER, reinforcements={"sheet": sheet})
        turn = np.pi / 32
        exact = bare + WIDTH**2 / 4 / (1 / area + 1 / (stiffness * WIDTH))
        wrench = np.array([0, 0, 0, 0, exact * turn / LENGTH, 0])
        (equilibrium,) = _followed([configure(built, mesh.points, build_loads(built, {}, wrench=wrench))], built)
        yield relative(
            f"rotation at {turn / np.pi:g}π rad, sheet of {stiffness:g} N/mm", equilibrium.plate[4], turn, tolerance
        )
        if stiffness == SHEETS[-1]:
            bent = turn * 3 * exact / (YOUNG * WIDTH**4)
            yield relative("the same for a sheet that does not stretch", equilibrium.plate[4], bent, tolerance)


def _covered(mesh: TetMesh) -> TetMesh:
    """The bar with a cover on its face x = −w/2."""
    faces = mesh.faces["side"]
    points = np.concatenate([RULE, np.full((3, 1), 1 / 6), np.tile([1.0, 0.0], (3, 1))], axis=1)
    return replace(mesh, covers={"sheet": Covered(faces, np.tile(points, (len(faces), 1, 1)))})


def elastica_reference() -> Iterator[Verdict]:
    """The reference solver of the elastica itself, against a published table."""
    for load, known in MATTIASSON.items():
        for word, ours, table in zip(("lateral / L", "axial / L", "angle, rad"), elastica(load), known, strict=True):
            yield absolute(f"{word} at PL²/EI = {load:g}", ours, table, 6e-6)


def elastica(load: float) -> tuple[float, float, float]:
    """Sideways and axial motion of the tip over the length, and its angle, under a transverse dead force P L²/EI.

    Solves θ″ = −(P L²/EI) cos θ over the unit length, clamped at 0 and free of moment at 1.

    Raises
    ------
    ComputationError
        If the boundary-value problem is not solved.
    """

    def equations(_, y: np.ndarray) -> np.ndarray:
        angle, curvature = y[0], y[1]
        return np.stack([curvature, -load * np.cos(angle), np.sin(angle), np.cos(angle)])

    def ends(root: np.ndarray, tip: np.ndarray) -> np.ndarray:
        return np.array([root[0], tip[1], root[2], root[3]])

    s = np.linspace(0, 1, 21)
    solution = solve_bvp(equations, ends, s, np.stack([s, 1 - s, 0 * s, s]), tol=1e-9)
    if not solution.success:
        raise ComputationError(f"the elastica at PL²/EI = {load:g} was not solved: {solution.message}")
    angle, _, sideways, along = solution.y[:, -1]
    return float(sideways), float(1 - along), float(angle)


def bend(counts: tuple[int, int, int], wrenches: Sequence[np.ndarray]) -> Iterator[Equilibrium]:
    """Equilibria of the bar under a sequence of wrenches (6,) on its tip plate, in N and N·mm.

    Raises
    ------
    ComputationError
        If there is no equilibrium.
    """
    mesh = bar(WIDTH, LENGTH, counts)
    built = build_model(mesh, RUBBER)
    at = [configure(built, mesh.points, build_loads(built, {}, wrench=wrench)) for wrench in wrenches]
    yield from _followed(at, built)


def _followed(path: Sequence[Configuration], built: Model) -> Iterator[Equilibrium]:
    """Equilibria of configurations, one after the other."""
    for equilibrium in sweep(path, Tangent(built)):
        if isinstance(equilibrium, NoEquilibrium):
            raise ComputationError(equilibrium.reason)
        yield equilibrium
