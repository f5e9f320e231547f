"""Local refinement: some elements are bisected at all their edges, others as far as the mesh would not fit together.

As in uniform refinement (`refine.py`), finer elements contain no more than a coarser one each: geometry, faces and
fields of the coarser mesh are those of the finer one too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from pneumorph.mesh.longest import Middles, divided, edges_of, middles_of
from pneumorph.mesh.morph import Morph, build_morph
from pneumorph.mesh.refine import LOCAL, NODES_OF_TRIANGLE, Parts, Refined, covered_parts
from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, TURNED, Covered, TetMesh, is_cut, tet_shape
from pneumorph.mesh.transfer import locate, quadrature_points

ENOUGH = 0.85
"""An element is divided where those at its place have been halved in size so much more often."""


@dataclass(frozen=True, eq=False)
class Bisected(Refined):
    """A mesh of which some elements are divided, and the element (M,) of the coarser one that each is part of."""

    owner: np.ndarray


def bisected(mesh: TetMesh, marked: np.ndarray) -> Bisected:
    """Divide elements into eight, and others as far as it is needed.

    Parameters
    ----------
    mesh : TetMesh
    marked : (m,) int
        The elements of which every edge is divided.
    """
    edges = edges_of(mesh.tets, TET_EDGES, mesh.points, mesh.tied, mesh.tets[marked, 4:])
    count = len(mesh.points)
    parts = divided(mesh.tets[:, :4], LOCAL[:4], TET_EDGES, edges)
    new = middles_of(parts, mesh.tets, TET_EDGES, edges, tet_shape)
    P = sparse.csr_array(sparse.vstack([sparse.eye_array(count), new.rows]))

    def quadratic(corners: np.ndarray) -> np.ndarray:
        """Six-node triangles with the given corners (n, 3)."""
        return np.concatenate([corners, new.of(corners, TRIANGLE_EDGES)], axis=1)

    def triangles(whole: np.ndarray) -> Parts:
        return divided(whole[:, :3], NODES_OF_TRIANGLE[:3], TRIANGLE_EDGES, edges)

    faces = {name: quadratic(triangles(face).corners) for name, face in mesh.faces.items()}
    images = np.arange(count)
    nodes, sources = mesh.tied
    images[sources] = nodes
    for name in faces:
        if is_cut(name) and name.endswith(" image"):
            # In the order of the first cut, seen from the other side.
            own = triangles(mesh.faces[name.removesuffix(" image")]).corners
            faces[name] = quadratic(images[own][:, TURNED[:3]])
    regions = {name: np.flatnonzero(np.isin(parts.owner, own)) for name, own in mesh.regions.items()}
    covers = {}
    for name, own in mesh.covers.items():
        of = triangles(own.nodes)
        covers[name] = covered_parts(own, of, quadratic(of.corners))
    caps = {name: _caps(own, new) for name, own in mesh.caps.items()}
    tets = np.concatenate([parts.corners, new.of(parts.corners, TET_EDGES)], axis=1)
    volumes = np.abs(np.linalg.det(parts.local[:, 1:] - parts.local[:, :1]))
    before = 0.0 if mesh.halved is None else mesh.halved[parts.owner]
    fine = TetMesh(P @ mesh.points, tets, faces, regions, covers, caps, before - np.log2(volumes) / 3.0)
    split = edges.halved()
    linear = _linear(mesh, len(fine.points), edges.middle[split], edges.ends(split))
    return Bisected(fine, P, linear, np.sort(edges.middle[split]), parts.owner)


def divided_morph(
    morph: Morph, P: np.ndarray, marked: np.ndarray, heights: Sequence[float] = ()
) -> tuple[Morph, Bisected]:
    """A morph some of whose elements are divided where they are for the control points P (n_points, 3).

    New nodes of surfaces lie on the faces of the elements that are divided, and follow the surfaces with these.

    Parameters
    ----------
    morph : Morph
    P : mm.
    marked : (m,) int
        The elements that are divided, see `bisected`.
    heights : see `build_morph`.

    Returns
    -------
    the morph, and its mesh with how fields are carried over to it.
    """
    fine = bisected(morph.at(P), marked)
    count, n_surface = morph.mesh.points.shape[0], morph.n_surface
    new = fine.P[count:]
    # What is between nodes of surfaces alone is on a surface.
    on_surface = np.bincount(new.nonzero()[0], new.nonzero()[1] >= n_surface, new.shape[0]) == 0
    outer = np.concatenate([np.arange(n_surface), count + np.flatnonzero(on_surface)])
    order = np.concatenate([outer, np.arange(n_surface, count), count + np.flatnonzero(~on_surface)])
    fine = _renumbered(fine, order)
    carry = fine.P[: len(outer), :n_surface]
    straight = fine.mesh.at(_straight(fine, morph.reference, order, count))
    own = build_morph(straight, carry @ morph.B, carry @ morph.offset, P, morph.size, {}, heights)
    shift = fine.mesh.points - own.mesh.points
    shift[: own.n_surface] = 0.0
    own = replace(own, shift=shift)
    return replace(own, mesh=own.at(P)), fine


def as_fine_as(morph: Morph, P: np.ndarray, mesh: TetMesh, heights: Sequence[float] = ()) -> Morph:
    """A morph whose elements are divided as often as those at the same places of another mesh were.

    Parameters
    ----------
    morph : Morph
    P : (n_points, 3) mm
        The control points at which both meshes are compared.
    mesh : TetMesh
        Of the same part of the body.
    heights : see `build_morph`.
    """
    while mesh.halved is not None:
        here = morph.at(P)
        element, _ = locate(mesh, quadrature_points(here.tets, here.points))
        wanted = mesh.halved[element].reshape(-1, len(here.tets)).mean(axis=0)
        marked = np.flatnonzero(wanted >= ENOUGH + (0.0 if here.halved is None else here.halved))
        if not len(marked):
            break
        morph, _ = divided_morph(morph, P, marked, heights)
    return morph


def _linear(mesh: TetMesh, count: int, middle: np.ndarray, ends: np.ndarray) -> sparse.csr_array:
    """See `Refined.linear`."""
    own = np.unique(mesh.tets[:, :4])
    entries = np.concatenate([np.ones(len(own)), np.full(2 * len(middle), 0.5)])
    places = np.concatenate([own, np.repeat(middle, 2)]), np.concatenate([own, ends.ravel()])
    return sparse.csr_array((entries, places), (count, len(mesh.points)))


def _caps(caps: np.ndarray, new: Middles) -> np.ndarray:
    """Divided where their curved edges are: nodes are a centre, both ends of the edge, and its middle."""
    edges = new.edges
    _, one, other, _ = caps.T
    at = edges.place(edges.key(one, other))
    halved = (at >= 0) & (edges.rank[at] >= 0)
    whole, (c, a, b, m) = caps[~halved], caps[halved].T
    return np.concatenate(
        [whole, np.column_stack([c, a, m, new.between(a, m)]), np.column_stack([c, m, b, new.between(m, b)])]
    )


def _renumbered(fine: Bisected, order: np.ndarray) -> Bisected:
    """With the nodes in another order (N,)."""
    number = np.empty(len(order), int)
    number[order] = np.arange(len(order))
    mesh = fine.mesh
    there = replace(
        mesh,
        points=mesh.points[order],
        tets=number[mesh.tets],
        faces={name: number[face] for name, face in mesh.faces.items()},
        covers={name: Covered(number[own.nodes], own.points) for name, own in mesh.covers.items()},
        caps={name: number[own] for name, own in mesh.caps.items()},
    )
    return Bisected(there, fine.P[order], fine.linear[order], number[fine.mids], fine.owner)


def _straight(fine: Bisected, reference: np.ndarray, order: np.ndarray, count: int) -> np.ndarray:
    """The places (N, 3) of nodes where edges are straight: those of the coarser mesh, and the middle of edges."""
    places = np.zeros_like(fine.mesh.points)
    old = order < count
    places[old] = reference[order[old]]
    ends = fine.mesh.tets[:, TET_EDGES]
    new = ~old[fine.mesh.tets[:, 4:]]
    places[fine.mesh.tets[:, 4:][new]] = places[ends[new]].mean(axis=1)
    return places
