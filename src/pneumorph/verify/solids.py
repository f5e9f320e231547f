"""Structured quadratic tetrahedral meshes of simple solids, and their rubber, for cases with known solutions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.mechanics import neo_hookean_rubber
from pneumorph.mesh.block import block
from pneumorph.mesh.tets import TET_EDGES, TetMesh

SHEAR, BULK, DENSITY = 0.49, 4.80, 1.1e-9
"""μ and κ in MPa and the density in t/mm³ of the paper's rubber, Table I."""

RUBBER = neo_hookean_rubber(SHEAR, BULK, DENSITY)


def bar(width: float, length: float, counts: Sequence[int]) -> TetMesh:
    """Square bar about the z axis; faces base (z = 0), tip (z = length), and side, the one of least x."""

    def mapping(r: np.ndarray) -> np.ndarray:
        return r * [width, width, length] - [width / 2, width / 2, 0]

    return block(
        counts,
        mapping,
        {
            "base": lambda r: r[:, 2] == 0,
            "tip": lambda r: r[:, 2] == 1,
            "side": lambda r: r[:, 0] == 0,
        },
    )


def distorted_cube(count: int, amount: float = 0.3) -> TetMesh:
    """Unit cube of count³ cells whose inner corners are moved at random by up to `amount` cells; edges stay straight.

    The element's quadrature integrates the gradients of the shape functions exactly for straight edges only; then a
    linear displacement is in equilibrium to rounding.
    """
    mesh = block([count] * 3, lambda r: r, {"bottom": lambda r: r[:, 2] == 0})
    points = mesh.points.copy()
    inner = (np.abs(points - 0.5) < 0.5 - 1e-9).all(axis=1)
    points[inner] += np.random.default_rng(0).uniform(-amount / count, amount / count, (inner.sum(), 3))
    points[mesh.tets[:, 4:]] = points[mesh.tets[:, TET_EDGES]].mean(axis=2)
    return mesh.at(points)


def tube(inner: float, outer: float, length: float, counts: Sequence[int]) -> TetMesh:
    """Hollow cylinder about the z axis.

    Faces: base (z = 0), tip (z = length), chamber A (the bore), exterior.

    Parameters
    ----------
    inner, outer, length : float
        mm.
    counts : (3,) of int
        Numbers of cells radially, around and along.
    """

    def mapping(r):
        radius, angle = inner + (outer - inner) * r[:, 0], 2 * np.pi * r[:, 1]
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), length * r[:, 2]])

    return block(
        counts,
        mapping,
        {
            "base": lambda r: r[:, 2] == 0,
            "tip": lambda r: r[:, 2] == 1,
            "chamber A": lambda r: r[:, 0] == 0,
            "exterior": lambda r: r[:, 0] == 1,
        },
    )


def with_lids(mesh: TetMesh, length: float) -> tuple[TetMesh, np.ndarray]:
    """Close the bore of a tube by flat fans of triangles at z = 0 and z = length, so that it has a volume.

    Returns the mesh, and which of its nodes (N,) bool are new: these belong to no element.
    """
    points, triangles = [mesh.points], [mesh.faces["chamber A"]]
    count = len(mesh.points)
    for z in (0.0, length):
        corners, middles = mesh.faces["chamber A"][:, :3], mesh.faces["chamber A"][:, 3:]
        at = np.abs(mesh.points[:, 2] - z) < 1e-9
        rims = [
            (int(corners[row, edge]), int(middles[row, edge]), int(corners[row, (edge + 1) % 3]))
            for row, edge in np.argwhere(at[corners] & at[np.roll(corners, -1, axis=1)])
        ]
        spokes = {node: count + 1 + k for k, node in enumerate(sorted({n for a, _, b in rims for n in (a, b)}))}
        points += [[[0.0, 0.0, z]], [0.5 * (mesh.points[node] + [0.0, 0.0, z]) for node in spokes]]
        # Along the rim, fan and bore have opposite directions, so that the closed surface is oriented.
        triangles.append(np.array([[b, a, count, m, spokes[a], spokes[b]] for a, m, b in rims]))
        count += 1 + len(spokes)
    closed = TetMesh(np.concatenate(points), mesh.tets, mesh.faces | {"chamber A": np.concatenate(triangles)})
    return closed, np.arange(count) >= len(mesh.points)


def octant(inner: float, outer: float, counts: Sequence[int]) -> TetMesh:
    """One eighth of a hollow sphere, x, y, z > 0, made of three gnomonic patches; faces chamber A and exterior."""
    third = [
        block(
            counts,
            lambda r, turn=turn: _gnomonic(r, inner, outer, turn),
            {
                "chamber A": lambda r: r[:, 0] == 0,
                "exterior": lambda r: r[:, 0] == 1,
            },
        )
        for turn in range(3)
    ]
    points = np.concatenate([m.points for m in third])
    offsets = np.cumsum([0] + [len(m.points) for m in third[:-1]])
    _, index, inverse = np.unique(np.round(points, 8), axis=0, return_index=True, return_inverse=True)
    inverse = inverse.ravel()
    tets = np.concatenate([inverse[m.tets + k] for m, k in zip(third, offsets, strict=True)])
    faces = {
        name: np.concatenate([inverse[m.faces[name] + k] for m, k in zip(third, offsets, strict=True)])
        for name in ("chamber A", "exterior")
    }
    return TetMesh(points[index], tets, faces)


def _gnomonic(r, inner, outer, turn):
    a, b = np.tan(np.pi / 4 * r[:, 1]), np.tan(np.pi / 4 * r[:, 2])
    direction = np.column_stack([np.ones_like(a), a, b])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return np.roll((inner + (outer - inner) * r[:, :1]) * direction, turn, axis=1)
