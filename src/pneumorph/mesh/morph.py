"""Motion of the mesh with the surfaces: X = X_ref + s + E (B P + b − S_ref), affine until the body is remeshed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.tets import TET_EDGES, TET_RULE, TRIANGLE_EDGES, TetMesh, is_cut, tet_gradient
from pneumorph.symmetry.operations import NORMALS
from pneumorph.symmetry.part import onwards, turns_of


@dataclass(frozen=True, eq=False)
class Extension:
    """Extends values on surface nodes (n_surface, k) to `inner` nodes: all others but those held at 0 and images.

    Where it is complex, x and y are the parts of one number, which a rotation about z multiplies by a phase.
    """

    inner: np.ndarray
    coupling: sparse.csr_array
    factor: SuperLU

    def carry(self, surface: np.ndarray) -> np.ndarray:
        """Values on the inner nodes from those on the surface nodes."""
        stop_if_asked()
        return -self.factor.solve(np.ascontiguousarray(self.coupling @ self._seen(surface))).view(float)

    def back(self, inner: np.ndarray) -> np.ndarray:
        """The transpose of `carry`."""
        stop_if_asked()
        return -(self.coupling.conj().T @ self.factor.solve(self._seen(inner))).view(float)

    def _seen(self, values: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(values).view(self.coupling.dtype)


@dataclass(frozen=True, eq=False)
class Morph:
    """Node positions as an affine function of the control points.

    Surface nodes, including mid-side nodes, are B P and lie exactly on the surfaces; those where two rubbers meet are
    at a constant offset b from places on them. Their motion is extended into the volume by diffusion equations on the
    straight reference mesh, stiffer where elements are small: one for corners, with linear elements, and one for how
    far mid-side nodes are from the middle of their chords. A single one with quadratic elements moves mid-side nodes
    away from the middle of edges that stay straight, so that elements fold much sooner. Nodes in a mirror plane do not
    move normal to it; within it, those that are on no surface follow the others. Nodes in a plane across the axis where
    another rubber begins do not move along it either. Those in half-planes between rubbers (`mesh/tube/wedge.py`) count
    as surface nodes: where they are is linear in these, so B and b have rows for them. Of a sector, nodes of the second
    cut are images of those of the first, and nodes on the axis stay on it.

    Attributes
    ----------
    mesh : TetMesh
        The mesh at the control points for which it was built.
    B : (n_surface, n_points) sparse
        From control points to surface nodes, which are the first nodes of the mesh.
    offset : (n_surface, 3) float
        b, mm; zero on the surfaces.
    reference : (N, 3) float
        X_ref: the straight mesh, with mid-side nodes of the surface on their chords.
    size : float
        Edge length for which the mesh was built, mm: what was asked for, or of a finer attempt.
    param : dict of (nf, 6, 2) float
        (q, r) of the nodes of the tubes' triangles, by surface name (see `SurfaceMesh.param`).
    extensions : tuple of (components, Extension)
        One extension for all components; the component normal to a mirror plane, or to one across the axis, has its
        own. In a sector x and y have one, and z. They extend values at corners and deviations at mid-side nodes.
    chords : (N, N) sparse
        From values at corners to their means in the middle of edges.
    shift : (N, 3) float
        s, mm: how far nodes inside are from where the extension has them, see `relax.py`. It may change from design to
        design, while `mesh` stays as built.
    """

    mesh: TetMesh
    B: sparse.csr_array
    offset: np.ndarray
    reference: np.ndarray
    size: float
    param: dict[str, np.ndarray]
    extensions: tuple[tuple[np.ndarray, Extension], ...]
    chords: sparse.csr_array
    shift: np.ndarray

    @property
    def n_surface(self) -> int:
        """Number of surface nodes."""
        return len(self.B.indptr) - 1

    @cached_property
    def surface_edges(self) -> np.ndarray:
        """Both ends and the mid-side node of every surface edge, (n, 3)."""
        triangles = np.concatenate([face for name, face in self.mesh.faces.items() if not is_cut(name)])
        edges = np.concatenate([triangles[:, TRIANGLE_EDGES], triangles[:, 3:, None]], axis=2).reshape(-1, 3)
        return edges[np.unique(edges[:, 2], return_index=True)[1]]

    def positions(self, P: np.ndarray) -> np.ndarray:
        """Positions (N, 3) in mm of all nodes for the control points P (n_points, 3)."""
        return self.reference + self.shift + self.extend(self.B @ P + self.offset - self.reference[: self.n_surface])

    def push(self, dP: np.ndarray) -> np.ndarray:
        """Motion (N, 3) of all nodes for a motion dP (n_points, 3) of the control points."""
        return self.extend(self.B @ dP)

    def pullback(self, dX: np.ndarray) -> np.ndarray:
        """Transpose of `push`: the gradient (n_points, 3) for control points from that for nodes, dX (N, 3)."""
        return self.B.T @ self.on_surface(dX)

    def on_surface(self, dX: np.ndarray) -> np.ndarray:
        """Transpose of `extend`: the gradient (n_surface, 3) for surface nodes from that for all nodes, dX (N, 3)."""
        nodes, sources = self.mesh.tied
        own = dX + self.chords.T @ dX
        own[sources] += own[nodes] @ self._turn
        own[nodes] = 0.0
        surface = own[: self.n_surface].copy()
        for components, extension in self.extensions:
            surface[:, components] += extension.back(own[np.ix_(extension.inner, components)])
        return self._in_place(surface - self._surface_chords.T @ surface)

    def at(self, P: np.ndarray) -> TetMesh:
        """The mesh for the control points P."""
        return self.mesh.at(self.positions(P))

    def extend(self, surface: np.ndarray) -> np.ndarray:
        """Motion (N, 3) of all nodes for a motion (n_surface, 3) of the surface nodes."""
        everywhere, placed = np.zeros_like(self.reference), self._in_place(surface)
        everywhere[: self.n_surface] = surface = placed - self._surface_chords @ placed
        for components, extension in self.extensions:
            everywhere[np.ix_(extension.inner, components)] = extension.carry(surface[:, components])
        nodes, sources = self.mesh.tied
        everywhere[nodes] = everywhere[sources] @ self._turn.T
        return everywhere + self.chords @ everywhere

    def keeps(self, surface: np.ndarray) -> bool:
        """Whether a motion (n_surface, 3) of surface nodes is that of a part: it keeps mirror planes, axis and cuts."""
        nodes, sources = self.mesh.tied
        own = nodes < self.n_surface
        turned = surface[sources[own]] @ self._turn.T
        return np.allclose(self._in_place(surface), surface) and np.allclose(turned, surface[nodes[own]])

    @cached_property
    def _surface_chords(self) -> sparse.csr_array:
        return self.chords[: self.n_surface, : self.n_surface]

    @property
    def _turn(self) -> np.ndarray:
        """The rotation (3, 3) from the first cut of a sector to the second."""
        return onwards(turns_of(self.mesh.part))

    def _in_place(self, surface: np.ndarray) -> np.ndarray:
        """Values on surface nodes, with those components set to zero by which nodes would leave a plane or the axis."""
        kept = surface.copy()
        for plane in self.mesh.mirrors:
            nodes = self.mesh.mirror_nodes(plane)
            kept[nodes[nodes < self.n_surface], NORMALS[plane]] = 0.0
        axis = self.mesh.axis
        kept[axis[axis < self.n_surface], :2] = 0.0
        return kept


def between(begin: Morph, end: Morph, share: float) -> Morph:
    """The morph that is this share of the way from one to another with the same elements, whose nodes move straight."""
    B = sparse.csr_array(begin.B + share * (end.B - begin.B))
    offset, shift = (
        one + share * (other - one) for one, other in ((begin.offset, end.offset), (begin.shift, end.shift))
    )
    return replace(end, B=B, offset=offset, shift=shift)


def build_morph(
    straight: TetMesh,
    B: sparse.csr_array,
    offset: np.ndarray,
    P: np.ndarray,
    size: float,
    param: dict[str, np.ndarray],
    heights: Sequence[float] = (),
) -> Morph:
    """Build a morph by factorising the extension on a straight mesh whose first nodes are the surface nodes.

    Parameters
    ----------
    straight : TetMesh
        The mesh with straight edges; its first nodes are the surface nodes.
    B : (n_surface, n_points) sparse
        From control points to surface nodes.
    offset : (n_surface, 3) array
        b, mm.
    P : (n_points, 3) array
        The control points for which the mesh was made, mm.
    size : float
        Edge length of the mesh, mm.
    param : dict of (nf, 6, 2) array
        (q, r) of the nodes of the tubes' triangles, by surface name.
    heights : sequence of float
        Of planes across the axis in which nodes stay, mm.
    """
    stiffness = _stiffness(straight)
    n_surface = len(B.indptr) - 1
    inner = np.arange(n_surface, len(straight.points))
    if turns_of(straight.part) > 1:
        extensions = _of_sector(straight, stiffness, n_surface, inner)
    else:
        still = {NORMALS[plane]: straight.mirror_nodes(plane) for plane in straight.mirrors}
        if heights:
            still[2] = np.flatnonzero(np.isin(straight.points[:, 2], heights))
        along = np.delete(np.arange(3), list(still))
        extensions = [(along, _extension(stiffness, n_surface, inner))] if len(along) else []
        for normal, nodes in still.items():
            extensions.append((np.array([normal]), _extension(stiffness, n_surface, np.setdiff1d(inner, nodes))))
    reference, still = straight.points, np.zeros_like(straight.points)
    unplaced = Morph(straight, B, offset, reference, size, param, tuple(extensions), _chords(straight), still)
    return replace(unplaced, mesh=unplaced.at(P))


def _of_sector(
    straight: TetMesh, stiffness: sparse.csr_array, n_surface: int, inner: np.ndarray
) -> list[tuple[np.ndarray, Extension]]:
    """The extensions across and along the axis."""
    (nodes, sources), count = straight.tied, len(straight.points)
    own = np.setdiff1d(inner, nodes)
    extensions = []
    phase = np.exp(2j * np.pi / turns_of(straight.part))
    for components, image, free in (([0, 1], phase, np.setdiff1d(own, straight.axis)), ([2], 1.0, own)):
        values = np.ones(count, type(image))
        values[nodes] = image
        columns = np.arange(count)
        columns[nodes] = sources
        by = sparse.csr_array((values, (np.arange(count), columns)), (count, count))
        tied = sparse.csr_array(by.conj().T @ stiffness @ by)
        extensions.append((np.array(components), _extension(tied, n_surface, free)))
    return extensions


def _extension(stiffness: sparse.csr_array, n_surface: int, inner: np.ndarray) -> Extension:
    rows = stiffness[inner]
    factor = splu(
        sparse.csc_matrix(rows[:, inner]),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return Extension(inner, sparse.csr_array(rows[:, :n_surface]), factor)


def _stiffness(straight: TetMesh) -> sparse.csr_array:
    """Scalar diffusion, ∫∇a·∇b / V over every element: small elements, which can deform least, are the stiffest.

    Values at corners, with linear shape functions, and deviations at mid-side nodes do not act on each other.
    """
    corners = straight.points[straight.tets[:, :4]]
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    linear = np.vstack([-np.ones(3), np.eye(3)]) @ inverse
    bulges = tet_gradient(TET_RULE)[:, 4:] @ inverse[:, None]
    # Quadrature weights are V/4 each; 1/V cancels the volume.
    blocks = linear @ np.swapaxes(linear, 1, 2), np.einsum("egad,egbd->eab", bulges, bulges, optimize=True) / 4
    n, entries = len(straight.points), []
    for nodes, block in zip((straight.tets[:, :4], straight.tets[:, 4:]), blocks, strict=True):
        count = nodes.shape[1]
        entries.append((block.ravel(), np.repeat(nodes, count, axis=1).ravel(), np.tile(nodes, (1, count)).ravel()))
    values, rows, columns = (np.concatenate(each) for each in zip(*entries, strict=True))
    return sparse.csr_array((values, (rows, columns)), (n, n))


def _chords(mesh: TetMesh) -> sparse.csr_array:
    """From values at corners to their means in the middle of edges, (N, N)."""
    mids, first = np.unique(mesh.tets[:, 4:], return_index=True)
    ends = mesh.tets[:, TET_EDGES].reshape(-1, 2)[first]
    n = len(mesh.points)
    return sparse.csr_array((np.full(2 * len(mids), 0.5), (np.repeat(mids, 2), ends.ravel())), (n, n))
