"""Nodes inside moved so that poor elements become better, while surfaces and connectivity stay.

A mesh that follows its surfaces through several designs folds at a few elements first. Moving the nodes inside that
belong to these costs a hundredth of a new mesh, and states are carried over by the shape derivative alone.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numba
import numpy as np

from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.morph import Morph
from pneumorph.mesh.quality import of_element, scaled_jacobian
from pneumorph.mesh.tets import TetMesh, is_cut
from pneumorph.symmetry.operations import NORMALS
from pneumorph.symmetry.part import onwards, turns_of

ENOUGH = 0.25
"""Quality (see `scaled_jacobian`) from which an element is left alone."""
SWEEPS = 10
"""Most passes over all poor elements; they end before where none is improved."""
LONGEST, SHORTEST = 0.2, 0.005
"""First and last length of trial steps, relative to the element's edges."""
GAIN = 1e-6
"""Least gain in quality of a step that is taken, above rounding errors."""
SAME = 1e-9
"""Qualities that differ by less are the same: rounding must not decide which of two images is treated first."""

WAYS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if sum(map(abs, way)) in (1.0, 3.0)])
WAYS /= np.linalg.norm(WAYS, axis=1)[:, None]


def relax(morph: Morph, P: np.ndarray) -> Morph:
    """The morph with inner nodes shifted so that the worst elements are better at the control points P (n_points, 3).

    Nodes are moved one by one, to where the worst of the elements around them is best: by pattern search, as the
    smallest of many Jacobians has no derivative. No element becomes worse than the worst beside it was. Nodes on
    surfaces and between regions stay, those in a mirror plane stay in it, and those in a cut of a sector move with
    their images: where the surfaces are twisted, most poor elements are beside the cuts. If no element is poor, the
    same morph is returned.
    """
    points = morph.positions(P)
    mesh = morph.mesh.at(points)
    quality = scaled_jacobian(points, mesh.tets)
    if quality.min() >= ENOUGH:
        return morph
    free = free_inside(mesh, morph.n_surface)
    order = np.argsort(mesh.tets, axis=None, kind="stable")
    start = np.searchsorted(mesh.tets.ravel()[order], np.arange(len(points) + 1))
    moved = points.copy()
    ties = _ties(mesh)
    for _ in range(SWEEPS):
        stop_if_asked()
        if not _sweep(moved, mesh.tets, free, ties, start, order // 10, quality, worst_first(quality)):
            break
    return replace(morph, shift=morph.shift + moved - points)


def _ties(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What symmetry asks of nodes that move.

    Returns
    -------
    allowed : (N, 3) float
        1 for the components in which a node may move, 0 for those that would lead it out of its plane or off the axis.
    sources : (N,) int
        The node whose image each is, or itself.
    images : (N,) int
        The image of each, or -1.
    turn : (3, 3) float
        The rotation from nodes to images.
    """
    count = len(mesh.points)
    allowed, sources, images = np.ones((count, 3)), np.arange(count), np.full(count, -1)
    for plane in mesh.mirrors:
        allowed[mesh.mirror_nodes(plane), NORMALS[plane]] = 0.0
    allowed[mesh.axis, :2] = 0.0
    tied, first = mesh.tied
    sources[tied], images[first] = first, tied
    return allowed, sources, images, onwards(turns_of(mesh.part))


def free_inside(mesh: TetMesh, n_surface: int) -> np.ndarray:
    """Nodes (N,) bool that are on no surface of the body and inside a single region, but may be in cuts."""
    free = np.arange(len(mesh.points)) >= n_surface
    for name, triangles in mesh.faces.items():
        if not is_cut(name):
            free[triangles] = False
    times = np.zeros(len(mesh.points), int)
    for elements in mesh.regions.values():
        times[np.unique(mesh.tets[elements])] += 1
    return free & (times < 2)


def worst_first(quality: np.ndarray) -> np.ndarray:
    """The elements (M,), the worst first."""
    return np.argsort(np.rint(quality / SAME), kind="stable")


@numba.njit(cache=True, nogil=True)
def _sweep(points, tets, free, ties, start, visits, quality, elements):
    """Move the free nodes of poor elements in their order; `points` and `quality` change. Returns whether any did."""
    allowed, sources, images, _ = ties
    any_moved, nodes, place = False, np.empty((10, 3)), np.empty(3)
    for e in elements:
        if quality[e] >= ENOUGH:
            break
        length = edge_length(points, tets[e])
        for own in tets[e]:
            if not free[own]:
                continue
            node = sources[own]
            around = visits[start[node] : start[node + 1]].copy()
            if images[node] >= 0:
                around = np.concatenate((around, visits[start[images[node]] : start[images[node] + 1]]))
            sort_by_quality(around, quality)
            best, step = worst_of(points, tets, around, nodes, -np.inf), LONGEST * length
            while step > SHORTEST * length:
                better = False
                for i in range(3):
                    place[i] = points[node, i]
                for way in range(len(WAYS)):
                    for i in range(3):
                        points[node, i] = place[i] + step * allowed[node, i] * WAYS[way, i]
                    _carry_image(points, node, ties)
                    worst = worst_of(points, tets, around, nodes, best + GAIN)
                    if worst > best + GAIN:
                        best, better = worst, True
                        for i in range(3):
                            place[i] = points[node, i]
                for i in range(3):
                    points[node, i] = place[i]
                _carry_image(points, node, ties)
                any_moved |= better
                if not better:
                    step /= 2.0
            for k in range(len(around)):
                quality[around[k]] = worst_of(points, tets, around[k : k + 1], nodes, -np.inf)
    return any_moved


@numba.njit(cache=True, nogil=True)
def _carry_image(points, node, ties):
    """Move the image of a node, if it has one, to where it belongs."""
    _, _, images, turn = ties
    image = images[node]
    if image < 0:
        return
    for i in range(3):
        points[image, i] = turn[i, 0] * points[node, 0] + turn[i, 1] * points[node, 1] + turn[i, 2] * points[node, 2]


@numba.njit(cache=True, nogil=True)
def edge_length(points, nodes):
    """Between the first two corners of an element."""
    square = 0.0
    for i in range(3):
        square += (points[nodes[0], i] - points[nodes[1], i]) ** 2
    return np.sqrt(square)


@numba.njit(cache=True, nogil=True)
def sort_by_quality(elements, quality):
    """Sort a few elements in place, the worst first, since these decide about most steps.

    Those of the same quality keep their order. Numba's own sorting takes ten times as long to compile.
    """
    for k in range(1, len(elements)):
        e, at = elements[k], k
        grade = np.rint(quality[e] / SAME)
        while at > 0 and np.rint(quality[elements[at - 1]] / SAME) > grade:
            elements[at] = elements[at - 1]
            at -= 1
        elements[at] = e


@numba.njit(cache=True, nogil=True)
def worst_of(points, tets, elements, nodes, least):
    """The worst quality of some elements, or that of the first found which is no better than `least`."""
    worst = np.inf
    for e in elements:
        for a in range(10):
            for i in range(3):
                nodes[a, i] = points[tets[e, a], i]
        worst = min(worst, of_element(nodes))
        if worst <= least:
            break
    return worst
