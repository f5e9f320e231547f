"""The inner sides of layers, where two rubbers meet: triangles like those of the surface along which a layer lies.

A layer reaches from a part of a surface to its copy. Between the edges of both are walls through the layer, unless the
part is closed or cut by a mirror plane; where it ends in an end disc of the surface, rings of the disc are the wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.geometry.tube.lining import Lining
from pneumorph.mesh.tets import TRIANGLE_EDGES
from pneumorph.problem.regions import REST

INTERFACE = 3
"""The part of a patch (see `surface._Patch`) to which these triangles belong."""


@dataclass(frozen=True)
class Sheet:
    """Vertices and triangles of a patch by parameters.

    Attributes
    ----------
    q, r, s : (n,) float
        Parameters of the vertices, and their distance from the centre of a disc relative to that of its rim.
    depth, lining : (n,) float, (n,) int
        Fraction of the way through a layer, and its number; −1 on the surface itself.
    vertex : (nt, 3) int
        Corners of the triangles.
    corner_q, corner_r : (nt, 3) float
        Parameters of the corners; q exceeds 1 where a triangle crosses the seam.
    part : (nt,) int
        See `surface._Patch`.
    single : (nt, 3) bool
        Whether a corner is a pole or a centre.
    behind, ahead : (nt,) str
        The regions on both sides.
    """

    q: np.ndarray
    r: np.ndarray
    s: np.ndarray
    depth: np.ndarray
    lining: np.ndarray
    vertex: np.ndarray
    corner_q: np.ndarray
    corner_r: np.ndarray
    part: np.ndarray
    single: np.ndarray
    behind: np.ndarray
    ahead: np.ndarray


def steps_through(lining: Lining, size: float) -> int:
    """The number of edges through the thickness of a layer, at its walls."""
    return max(1, round(lining.thickness / size))


def with_interface(sheet: Sheet, lining: Lining, number: int, chains: np.ndarray) -> Sheet:
    """The sheet with the inner side of a layer and its walls.

    Parameters
    ----------
    sheet : Sheet
    lining : Lining
    number : int
        By which its vertices name it.
    chains : (n, steps + 1) int
        For vertices of the rims at which the layer ends in a disc: that vertex, and those below it through the layer,
        which the disc has. Else −1.
    """
    steps = chains.shape[1] - 1
    q, r = sheet.corner_q.mean(axis=1), sheet.corner_r.mean(axis=1)
    on_surface = (sheet.part < INTERFACE) & (lining.ends | (sheet.part == 1))
    covered = on_surface & lining.covers(q, r)
    # Of a disc, the rings that go through the layer.
    in_disc = (sheet.part == 0) | (sheet.part == 2)
    at_rim = (sheet.s[sheet.vertex] == 1.0).all(axis=1) & (sheet.lining[sheet.vertex] == number).any(axis=1)
    through = in_disc & at_rim & ~lining.ends
    behind = np.where(covered | (through & lining.covers(q, r)), lining.region, sheet.behind)

    walls = _walls(sheet, covered)
    chains = chains.copy()
    chains[:, 0] = np.arange(len(chains))
    deep = np.unique(sheet.vertex[covered])
    added = [(deep[chains[deep, steps] < 0], steps)]
    rim = np.unique(sheet.vertex[walls[:, :1], walls[:, 1:]])
    added += [(rim[chains[rim, step] < 0], step) for step in range(1, steps)]
    count = len(sheet.q)
    for vertices, step in added:
        chains[vertices, step] = count + np.arange(len(vertices))
        count += len(vertices)
    origin = np.concatenate([vertices for vertices, _ in added])
    depth = np.concatenate([np.full(len(vertices), step / steps) for vertices, step in added])

    copies = chains[sheet.vertex[covered], steps]
    triangle, a, b = walls.T
    corners, params_q, params_r = [], [], []
    for step in range(steps):
        # Seen from outside the layer.
        for ends, levels in (((b, a, a), (0, 0, 1)), ((b, a, b), (0, 1, 1))):
            own = np.stack([sheet.vertex[triangle, end] for end in ends], axis=1)
            corners.append(np.stack([chains[own[:, k], step + levels[k]] for k in range(3)], axis=1))
            params_q.append(np.stack([sheet.corner_q[triangle, end] for end in ends], axis=1))
            params_r.append(np.stack([sheet.corner_r[triangle, end] for end in ends], axis=1))
    sides = np.concatenate(corners)
    return Sheet(
        q=np.concatenate([sheet.q, sheet.q[origin]]),
        r=np.concatenate([sheet.r, sheet.r[origin]]),
        s=np.concatenate([sheet.s, sheet.s[origin]]),
        depth=np.concatenate([sheet.depth, depth]),
        lining=np.concatenate([sheet.lining, np.full(len(origin), number)]),
        vertex=np.concatenate([sheet.vertex, copies, sides]),
        corner_q=np.concatenate([sheet.corner_q, sheet.corner_q[covered], *params_q]),
        corner_r=np.concatenate([sheet.corner_r, sheet.corner_r[covered], *params_r]),
        part=np.concatenate([sheet.part, np.full(len(copies) + len(sides), INTERFACE)]),
        single=np.concatenate([sheet.single, sheet.single[covered], np.zeros((len(sides), 3), bool)]),
        behind=np.concatenate([behind, np.full(len(copies), REST, object), np.full(len(sides), lining.region, object)]),
        ahead=np.concatenate(
            [sheet.ahead, np.full(len(copies), lining.region, object), np.full(len(sides), REST, object)]
        ),
    )


def _walls(sheet: Sheet, covered: np.ndarray) -> np.ndarray:
    """Edges (n, 3) of covered triangles next to one of the tube that is not: the triangle, and its two corners."""
    tube = np.flatnonzero((sheet.part == 1) & ~covered)
    n = len(sheet.q)

    def keys(triangles: np.ndarray) -> np.ndarray:
        ends = sheet.vertex[triangles][:, TRIANGLE_EDGES]
        return ends[..., 0] * n + ends[..., 1]

    own = np.flatnonzero(covered)
    ends = sheet.vertex[own][:, TRIANGLE_EDGES]
    row, edge = np.nonzero(np.isin(ends[..., 1] * n + ends[..., 0], keys(tube)))
    return np.column_stack([own[row], TRIANGLE_EDGES[edge]])
