"""Nodes of surfaces moved along them, with those inside, where these alone cannot make poor elements better.

A mesh that follows its surfaces is sheared with them. Moving the nodes inside (`relax.py`) does not help an element one
of whose faces on a surface has become poor. Nodes slide within the triangles around them: their rows of B become means
of those of the nodes of a triangle. So they stay on the surface as far as its triangles are on it, and the mesh stays
the same but for the places of its nodes: the unknowns stay, and so does the pattern of the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
from scipy import sparse

from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.morph import Morph
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.mesh.refine import NODES_OF_TRIANGLE
from pneumorph.mesh.relax import (
    ENOUGH,
    GAIN,
    LONGEST,
    SHORTEST,
    SWEEPS,
    WAYS,
    edge_length,
    free_inside,
    sort_by_quality,
    worst_first,
    worst_of,
)
from pneumorph.mesh.tets import TET_EDGES, TetMesh, is_cut, triangle_gradient, triangle_shape

_SMOOTH = np.cos(np.radians(20))
"""Nodes stay where the normals of the triangles around them differ by more: at edges that a body is to keep."""
_ROUND = np.array([[np.cos(angle), np.sin(angle)] for angle in np.arange(8) * np.pi / 4])
"""Directions within a surface in which steps are tried."""
_ITERATIONS = 5
"""Of Gauss and Newton's method for the nearest place on a triangle; the last only tells the place."""
_MOST = 64
"""Most nodes that move together."""
_STAYS, _INSIDE, _SLIDES = 0, 1, 2


@dataclass(frozen=True, eq=False)
class _Around:
    """The numbers of what is around every node: those of node k are `numbers[start[k] : start[k + 1]]`."""

    start: np.ndarray
    numbers: np.ndarray


def slide(morph: Morph, P: np.ndarray) -> Morph:
    """The morph with nodes on surfaces and inside moved so that the worst elements are better at P (n_points, 3).

    A corner takes the middle nodes of its edges half of the way along. Nodes at sharp edges, between faces of different
    names, where something is bonded on, in cuts and between regions stay. If no element is poor, the same morph is
    returned.
    """
    points = morph.positions(P)
    mesh = morph.mesh.at(points)
    quality = scaled_jacobian(points, mesh.tets)
    if quality.min() >= ENOUGH:
        return morph
    named = [(name, face) for name, face in mesh.faces.items() if not is_cut(name)]
    triangles = np.concatenate([face for _, face in named])
    slides, normal = _sliding(mesh, [face for _, face in named], triangles, morph.n_surface)
    kind = np.where(slides, _SLIDES, np.where(free_inside(mesh, morph.n_surface), _INSIDE, _STAYS))
    for name, face in mesh.faces.items():
        if is_cut(name):
            kind[face] = _STAYS
    elements, faces = _around(mesh.tets, len(points)), _around(triangles, len(points))
    moved, face, local = points.copy(), np.full(len(points), -1), np.zeros((len(points), 2))
    surface = (kind, normal, points, triangles, faces.start, faces.numbers)
    for _ in range(SWEEPS):
        stop_if_asked()
        first = worst_first(quality)
        if not _sweep(moved, face, local, surface, mesh.tets, elements.start, elements.numbers, quality, first):
            break
    return _placed(morph, P, moved, triangles, face, local)


def _placed(
    morph: Morph, P: np.ndarray, moved: np.ndarray, triangles: np.ndarray, face: np.ndarray, local: np.ndarray
) -> Morph:
    """The morph whose nodes are at the places `moved` (N, 3), those with a `face` (N,) at `local` (N, 2) in it."""
    count = morph.n_surface
    gone = np.flatnonzero(face[:count] >= 0)
    stays = np.flatnonzero(face[:count] < 0)
    values = np.concatenate([np.ones(len(stays)), triangle_shape(local[gone]).ravel()])
    rows = np.concatenate([stays, np.repeat(gone, 6)])
    columns = np.concatenate([stays, triangles[face[gone]].ravel()])
    onto = sparse.csr_array((values, (rows, columns)), (count, count))
    own = replace(morph, B=sparse.csr_array(onto @ morph.B), offset=onto @ morph.offset, shift=np.zeros_like(moved))
    shift = moved - own.positions(P)
    shift[:count] = 0.0
    return replace(own, shift=shift)


def _sliding(
    mesh: TetMesh, faces: list[np.ndarray], triangles: np.ndarray, n_surface: int
) -> tuple[np.ndarray, np.ndarray]:
    """Which nodes (N,) may slide, and the normals (N, 3) of the surface there."""
    count = len(mesh.points)
    times = np.zeros(count, int)
    for face in faces:
        times[np.unique(face)] += 1
    slides = (times == 1) & (np.arange(count) < n_surface)
    for nodes in (*(own.nodes for own in mesh.covers.values()), *mesh.caps.values()):
        slides[nodes] = False
    regions = np.zeros(count, int)
    for elements in mesh.regions.values():
        regions[np.unique(mesh.tets[elements])] += 1
    slides &= regions < 2
    tangents = np.einsum("kij,fid->fkjd", triangle_gradient(NODES_OF_TRIANGLE), mesh.points[triangles])
    normals = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    mean = np.zeros((count, 3))
    np.add.at(mean, triangles, normals)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    along = np.einsum("fkd,fkd->fk", normals, mean[triangles])
    # Turning by half as much away from the mean.
    slides[triangles[along < np.sqrt((1.0 + _SMOOTH) / 2.0)]] = False
    return slides, mean


def _around(cells: np.ndarray, count: int) -> _Around:
    """The cells (M, n) around every one of `count` nodes."""
    order = np.argsort(cells, axis=None, kind="stable")
    return _Around(np.searchsorted(cells.ravel()[order], np.arange(count + 1)), order // cells.shape[1])


@numba.njit(cache=True, nogil=True)
def _sweep(points, face, local, surface, tets, start, visits, quality, elements):
    """Move the nodes of poor elements in their order; places and `quality` change. Returns whether any did."""
    kind = surface[0]
    any_moved, nodes, group, by = False, np.empty((10, 3)), np.empty(_MOST, np.int64), np.empty(3)
    before, best_after, faces, best_faces = np.empty((_MOST, 5)), np.empty((_MOST, 5)), group.copy(), group.copy()
    for e in elements:
        if quality[e] >= ENOUGH:
            break
        length = edge_length(points, tets[e])
        for node in tets[e]:
            if kind[node] == _STAYS:
                continue
            around = visits[start[node] : start[node + 1]].copy()
            sort_by_quality(around, quality)
            size = _group(node, around, tets, kind, group)
            best, step = worst_of(points, tets, around, nodes, -np.inf), LONGEST * length
            ways = len(WAYS) if kind[node] == _INSIDE else len(_ROUND)
            while step > SHORTEST * length and best < ENOUGH:
                better = False
                _take(points, face, local, group, size, before, faces)
                for way in range(ways):
                    _direction(way, node, surface, by)
                    for k in range(size):
                        share = step if k == 0 else 0.5 * step
                        _move(group[k], share, by, points, face, local, surface)
                    worst = worst_of(points, tets, around, nodes, best + GAIN)
                    if worst > best + GAIN:
                        best, better = worst, True
                        _take(points, face, local, group, size, best_after, best_faces)
                    _put(points, face, local, group, size, before, faces)
                if better:
                    any_moved = True
                    _put(points, face, local, group, size, best_after, best_faces)
                else:
                    step /= 2.0
            for k in range(len(around)):
                quality[around[k]] = worst_of(points, tets, around[k : k + 1], nodes, -np.inf)
    return any_moved


@numba.njit(cache=True, nogil=True)
def _group(node, around, tets, kind, group):
    """A node and, of a corner, those in the middle of its edges that may move; returns how many they are."""
    group[0], size = node, 1
    for e in around:
        for k in range(6):
            if tets[e, TET_EDGES[k, 0]] != node and tets[e, TET_EDGES[k, 1]] != node:
                continue
            middle = tets[e, 4 + k]
            known = kind[middle] == _STAYS or size == len(group)
            for g in range(1, size):
                known |= group[g] == middle
            if not known:
                group[size] = middle
                size += 1
    return size


@numba.njit(cache=True, nogil=True)
def _take(points, face, local, group, size, kept, faces):
    """Remember where the nodes of a group are: places, local coordinates, and faces."""
    for k in range(size):
        node = group[k]
        faces[k] = face[node]
        for i in range(3):
            kept[k, i] = points[node, i]
        for i in range(2):
            kept[k, 3 + i] = local[node, i]


@numba.njit(cache=True, nogil=True)
def _put(points, face, local, group, size, kept, faces):
    """Move the nodes of a group to where they were when they were remembered."""
    for k in range(size):
        node = group[k]
        face[node] = faces[k]
        for i in range(3):
            points[node, i] = kept[k, i]
        for i in range(2):
            local[node, i] = kept[k, 3 + i]


@numba.njit(cache=True, nogil=True)
def _direction(way, node, surface, by):
    """The direction of a trial: of a node on a surface, one within it."""
    kind, normal = surface[0], surface[1]
    if kind[node] == _INSIDE:
        for i in range(3):
            by[i] = WAYS[way, i]
        return
    x, y, z = normal[node, 0], normal[node, 1], normal[node, 2]
    # A base of the plane across the normal (Duff et al. 2017, Journal of Computer Graphics Techniques 6 (1), 1–8).
    sign = 1.0 if z >= 0.0 else -1.0
    a = -1.0 / (sign + z)
    b = x * y * a
    c, s = _ROUND[way, 0], _ROUND[way, 1]
    by[0] = c * (1.0 + sign * x * x * a) + s * b
    by[1] = c * sign * b + s * (sign + y * y * a)
    by[2] = -c * sign * x - s * y


@numba.njit(cache=True, nogil=True)
def _move(node, step, by, points, face, local, surface):
    """Move a node by a step; one on a surface to the nearest place of the triangles that were around it at first."""
    kind, _, original, triangles, start, visits = surface
    px, py, pz = points[node, 0] + step * by[0], points[node, 1] + step * by[1], points[node, 2] + step * by[2]
    if kind[node] == _INSIDE:
        points[node, 0], points[node, 1], points[node, 2] = px, py, pz
        return
    least = np.inf
    for at in range(start[node], start[node + 1]):
        f, x, y = visits[at], 1.0 / 3.0, 1.0 / 3.0
        rx, ry, rz = px, py, pz
        for iteration in range(_ITERATIONS):
            w = 1.0 - x - y
            rx, ry, rz = px, py, pz
            ax = ay = az = bx = by_ = bz = 0.0
            for k in range(6):
                if k == 0:
                    value, first, second = w * (2.0 * w - 1.0), 1.0 - 4.0 * w, 1.0 - 4.0 * w
                elif k == 1:
                    value, first, second = x * (2.0 * x - 1.0), 4.0 * x - 1.0, 0.0
                elif k == 2:
                    value, first, second = y * (2.0 * y - 1.0), 0.0, 4.0 * y - 1.0
                elif k == 3:
                    value, first, second = 4.0 * w * x, 4.0 * (w - x), -4.0 * x
                elif k == 4:
                    value, first, second = 4.0 * x * y, 4.0 * y, 4.0 * x
                else:
                    value, first, second = 4.0 * w * y, -4.0 * y, 4.0 * (w - y)
                nx, ny, nz = original[triangles[f, k], 0], original[triangles[f, k], 1], original[triangles[f, k], 2]
                rx, ry, rz = rx - value * nx, ry - value * ny, rz - value * nz
                ax, ay, az = ax + first * nx, ay + first * ny, az + first * nz
                bx, by_, bz = bx + second * nx, by_ + second * ny, bz + second * nz
            if iteration == _ITERATIONS - 1:
                break
            aa, ab, bb = ax * ax + ay * ay + az * az, ax * bx + ay * by_ + az * bz, bx * bx + by_ * by_ + bz * bz
            ra, rb = rx * ax + ry * ay + rz * az, rx * bx + ry * by_ + rz * bz
            determinant = max(aa * bb - ab * ab, 1e-12 * aa * bb)
            x, y = max(x + (bb * ra - ab * rb) / determinant, 0.0), max(y + (aa * rb - ab * ra) / determinant, 0.0)
            if x + y > 1.0:
                # To the nearest place of the third side, in local coordinates.
                x = min(max(0.5 * (1.0 + x - y), 0.0), 1.0)
                y = 1.0 - x
        away = rx * rx + ry * ry + rz * rz
        if away < least:
            least, face[node], local[node, 0], local[node, 1] = away, f, x, y
            points[node, 0], points[node, 1], points[node, 2] = px - rx, py - ry, pz - rz
