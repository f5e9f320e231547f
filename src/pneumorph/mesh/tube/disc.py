"""End discs triangulated again where triangles between rings of vertices would be poor.

The rings are copies of the rim, nearer to its centre. Where a line to the centre runs nearly along the rim, triangles
between them are flat, and so are tetrahedra on them; where the disc does not even contain its centre, they overlap. The
disc is then triangulated as any plane region. Its inner vertices are fixed means of those at its edge, so they follow
the control points as all nodes do: mean value coordinates of every vertex in its neighbours (Floater 2003).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy import sparse

from pneumorph.geometry.tube.surface import TubeSurface, turn_to
from pneumorph.mesh.plane import quality_of, triangulate
from pneumorph.mesh.tets import TRIANGLE_EDGES
from pneumorph.mesh.tube.patch import Patch

_POOR = 0.1
"""Quality of a disc's worst triangle (see `quality_of`) below which the disc is triangulated again."""

_STRAIGHT = 1e-3
"""Distance of vertices from a line, relative to its length, up to which they are on it."""


def with_sound_discs(patch: Patch, surface: TubeSurface, size: float) -> Patch:
    """The patch, its poor end discs triangulated again with edges of this size, mm, but those of several regions."""
    for pole, part, direction in zip(surface.poles, (0, 2), surface.directions, strict=True):
        if not pole:
            # In coordinates of which the last is across the disc.
            nodes = patch.B @ surface.net.reshape(-1, 3) @ turn_to(direction)
            patch = _sound(patch, patch.part == part, nodes, size)
    return patch


def _sound(patch: Patch, disc: np.ndarray, nodes: np.ndarray, size: float) -> Patch:
    """The patch with a sound disc: these triangles (nt,) bool. Its nodes are at (n, 3)."""
    old, others = patch.triangles[disc], patch.triangles[~disc]
    if not len(old):
        return patch
    (ax, ay), (bx, by), (cx, cy) = nodes[old[:, :3], :2].transpose(1, 2, 0)
    # Where normals point to the base, triangles are counter-clockwise in a mirror.
    axes = [0, 1] if ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)).sum() > 0 else [1, 0]
    several = len(set(zip(patch.behind[disc], patch.ahead[disc], strict=True))) > 1
    if several or quality_of(nodes[old][..., axes]).min() >= _POOR:
        return patch
    around = _around(old, others)
    if np.isin(np.setdiff1d(old, [*(one for one, _ in around), *around.values()]), others).any():
        return patch  # a layer along the disc is joined to it

    # In mirror planes there may be other vertices; where a sector is cut they have images, and one is on the axis.
    kept = old if len(patch.seam) else others
    rows, filled = _filled(around, np.isin([one for one, _ in around], kept), nodes, axes, size)
    triangles = np.concatenate([others, filled])
    used = np.concatenate([np.unique(triangles[:, :3]), np.unique(triangles[:, 3:])])
    new = np.full(len(rows.indptr) - 1, -1)
    new[used] = np.arange(len(used))
    labelled = np.concatenate([np.flatnonzero(~disc), np.full(len(filled), np.flatnonzero(disc)[0])])
    labels = {name: getattr(patch, name)[labelled] for name in ("part", "param", "behind", "ahead")}
    return replace(
        patch,
        B=sparse.csr_array(rows[used] @ patch.B),
        offset=np.asarray(rows[used] @ patch.offset),
        n_vertices=len(np.unique(triangles[:, :3])),
        triangles=new[triangles],
        seam=new[patch.seam],
        **labels,
    )


def _filled(
    around: dict[tuple[int, int], int], kept: np.ndarray, nodes: np.ndarray, axes: list[int], size: float
) -> tuple[sparse.csr_array, np.ndarray]:
    """Rows (m, n) that give all nodes as means of those there were, and the disc's new triangles (nt, 6).

    The nodes there were come first, then new vertices, then new mid-side nodes.
    """
    outline, rows = _even(around, kept, nodes[:, axes], size)
    places = np.asarray(rows @ nodes)[:, axes]
    number = np.arange(len(outline))
    edges = np.column_stack([number, np.roll(number, -1)])
    pairs = zip(outline, [*outline[1:], outline[0]], strict=True)
    middles = np.array([places[around[pair]] if pair in around else places[list(pair)].mean(axis=0) for pair in pairs])
    inside, corners = triangulate(places[outline], edges, middles, size)
    weights = _mean_values(np.concatenate([places[outline], inside]), corners, len(outline))
    corners = np.concatenate([outline, len(places) + np.arange(len(inside))])[corners]
    rows = sparse.csr_array(sparse.vstack([rows, weights @ rows[outline]]))

    ends = list(map(tuple, np.sort(corners[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1).tolist()))
    middle = {tuple(sorted(pair)): node for pair, node in around.items()}
    fresh = sorted(set(ends) - set(middle))
    middle |= {pair: node for node, pair in enumerate(fresh, len(places) + len(inside))}
    one, other = np.array(fresh).T
    rows = sparse.csr_array(sparse.vstack([rows, 0.5 * (rows[one] + rows[other])]))
    return rows, np.hstack([corners, np.array([middle[pair] for pair in ends]).reshape(-1, 3)])


def _around(disc: np.ndarray, others: np.ndarray) -> dict[tuple[int, int], int]:
    """The edges around a disc, one after the other from a vertex of other triangles on, and their middles.

    Half a disc has a part of its edge in the mirror plane.
    """
    pairs = disc[:, TRIANGLE_EDGES].reshape(-1, 2).tolist()
    middle = dict(zip(map(tuple, pairs), disc[:, 3:].ravel().tolist(), strict=True))
    following = {one: other for one, other in middle if (other, one) not in middle}
    at, around = min(set(following) & set(others.ravel().tolist())), {}
    while at in following:
        after = following.pop(at)
        around[at, after] = middle[at, after]
        at = after
    return around


def _even(
    around: dict[tuple[int, int], int], kept: np.ndarray, nodes: np.ndarray, size: float
) -> tuple[list[int], sparse.csr_array]:
    """The vertices around a disc, new ones on lines between kept ones; rows (m, n) for all nodes and these."""
    old, outline = [one for one, _ in around], []
    means: list[tuple[int, int, float]] = []
    ends = np.flatnonzero(np.append(kept, True))
    for first, last in pairwise(ends.tolist()):
        one, other = old[first], old[last % len(old)]
        along, away = nodes[other] - nodes[one], nodes[old[first:last]] - nodes[one]
        outline.append(one)
        if np.abs(away[:, 0] * along[1] - away[:, 1] * along[0]).max() > _STRAIGHT * (along @ along):
            outline += old[first + 1 : last]  # in two planes
        elif last - first > 1:
            steps = max(1, round(float(np.linalg.norm(along)) / size))
            outline += range(len(nodes) + len(means), len(nodes) + len(means) + steps - 1)
            means += [(one, other, step / steps) for step in range(1, steps)]
    rows = sparse.csr_array(sparse.eye_array(len(nodes)))
    if means:
        one, other, share = (np.array(column) for column in zip(*means, strict=True))
        rows = sparse.vstack([rows, (1.0 - share)[:, None] * rows[one] + share[:, None] * rows[other]])
    return outline, sparse.csr_array(rows)


def _mean_values(points: np.ndarray, triangles: np.ndarray, n: int) -> np.ndarray:
    """Weights (k, n) ≥ 0 by which the points after the first n are means of these."""
    weights = np.zeros((len(points), len(points)))
    for turn in range(3):
        at, one, other = np.roll(triangles, turn, axis=1).T
        a, b = points[one] - points[at], points[other] - points[at]
        lengths = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
        half = np.tan(np.arccos(np.clip((a * b).sum(axis=1) / (lengths[0] * lengths[1]), -1.0, 1.0)) / 2.0)
        np.add.at(weights, (at, one), half / lengths[0])
        np.add.at(weights, (at, other), half / lengths[1])
    inner = weights[n:]
    return np.linalg.solve(np.diag(inner.sum(axis=1)) - inner[:, n:], inner[:, :n])
