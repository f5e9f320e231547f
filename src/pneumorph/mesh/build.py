"""Mesh what closed surfaces bound; the mesh follows them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Protocol

import numpy as np
from scipy import sparse

from pneumorph.errors import MeshError
from pneumorph.geometry import Body, TriangulatedSurface, Triangulation
from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.morph import Morph, build_morph
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.mesh.relax import relax
from pneumorph.mesh.slide import slide
from pneumorph.mesh.tets import TetMesh
from pneumorph.mesh.volume import fill

_FINER = (1.0, 0.93, 0.86, 0.8, 0.65, 0.5)
"""Factors on the size in successive attempts. A slightly finer mesh suffices where chords just cross; half the size has
eight times as many elements."""
DECIMALS = 6
"""Decimals (of mm) to which control points are rounded while a body is meshed, so that rounding errors do not change
the mesh, which is moved to the exact surfaces afterwards."""
_WORST = 0.02
"""Quality (see `scaled_jacobian`) below which a mesh is rejected."""
_FEW = 1e-3
"""Share of elements below that quality up to which nodes slide along surfaces: smaller elements everywhere would cost
far more. Where there are more, the surfaces are too coarse, and nodes that slide would change the body."""
_SOUND = 0.1
"""Quality below which the edges that an element has on surfaces are divided: where curved triangles on both sides of a
wall come near each other, smaller ones are less curved."""
_MANY, _MORE = 0.05, 1.2
"""Share of elements below that quality, and growth of the number of all, from which nothing more is divided: smaller
elements everywhere cost as much."""
_LEAST = 1500
"""Number of elements from which on edges are divided: where there are few, smaller ones everywhere cost little, and are
as alike as the body is symmetric. Of a tube of 472 elements, some of them divided, how a spring changes the pressure at
which it balloons was ten times too small."""
_FLAT = 1e-9
"""Quality, of either sign, below which an element with straight edges counts as flat."""


class Mesher(Protocol):
    """Meshes all bodies of a run."""

    @property
    def size(self) -> float:
        """Edge length of the elements, mm."""
        ...

    @property
    def heights(self) -> Sequence[float]:
        """z of planes across the axis in which nodes stay, mm."""
        ...

    def mesh(self, body: Body, finest: float = 0.0) -> Morph:
        """Mesh a body; where that fails, with finer elements, but with none below `finest`, in mm."""
        ...


@dataclass(frozen=True, eq=False)
class Boundary(Triangulation):
    """Triangulated surfaces with what closes them and divides a body into regions, ready to be filled.

    Attributes
    ----------
    nodes : (n, 3) float
        Those of the surfaces, then others, such as those in cuts.
    solids : dict of (nt, 6) int
        The triangles that bound each region, normals outwards; a body of a single rubber is one region "".
    param : dict of (nf, 6, 2) float
        See `Morph.param`.
    """

    nodes: np.ndarray
    solids: dict[str, np.ndarray]
    param: dict[str, np.ndarray] = field(default_factory=dict)

    def followed(self, straight: TetMesh) -> tuple[TetMesh, sparse.csr_array, np.ndarray]:
        """The filled mesh, B and offset, where more of its nodes follow the surfaces."""
        return straight, self.B, self.offset


def mesh_within(
    bound: Callable[[Body, float, float, Sequence[np.ndarray]], Boundary],
    body: Body,
    size: float,
    finest: float = 0.0,
    beginnings: Sequence[float] = (0.0,),
    heights: Sequence[float] = (),
    times: int = 0,
) -> Morph:
    """Mesh a body with quadratic tetrahedra.

    If chords of a coarse triangulation cross, or an element is inverted when curved, finer ones are tried. Where few
    elements are poor, only edges of surfaces beside them are divided.

    Parameters
    ----------
    bound : function of the body, a factor on all edge lengths, one of the `beginnings`, and edges
        Returns the triangles of the body; raises MeshError where it cannot. Edges are those of surfaces that are
        divided, one set after another, given by the nodes (k,) in their middle.
    body : Body
    size : float
        Approximate edge length, mm.
    finest : float
        Edge length, mm, below which no finer triangulations are tried.
    beginnings : sequence of float
        Where a sector may begin, as far as tried; see `mesh.tube`.
    heights : sequence of float
        See `build_morph`.
    times : int
        How often edges of surfaces may be divided beside poor elements.

    Raises
    ------
    MeshError
        If no attempt gives a mesh without inverted or nearly flat elements.
    """
    exact = body.control_points()
    body = body.with_control_points(np.round(exact, DECIMALS))
    reason = MeshError("no attempt was made")
    factors = [factor for factor in _FINER if factor == 1.0 or factor * size >= finest]
    for finer, begin in product(factors, beginnings):
        best, least, divided, most = None, _WORST, [], 0.0
        for _ in range(times + 1):
            stop_if_asked()
            try:
                morph = _filled(bound(body, finer, begin, divided), exact, finer * size, heights)
            except MeshError as error:
                reason = error
                break
            quality = _quality(morph, exact)
            worst, count, poor = quality.min(), len(quality), morph.mesh.tets[quality < _SOUND]
            if worst > least:
                best, least = morph, worst
            elif best is not None:
                break
            reason = MeshError(f"the mesh has an element of quality {worst:.2g}")
            middles, most = _beside(morph, poor), most or _MORE * count
            if not len(middles) or len(poor) > _MANY * count or not _LEAST <= count <= most:
                break
            divided.append(middles)
        if best is not None:
            return replace(best, mesh=best.at(exact))
    raise MeshError(f"{reason}; surfaces may touch, or the mesh size of {size:g} mm may be too coarse for the walls")


def _filled(boundary: Boundary, exact: np.ndarray, size: float, heights: Sequence[float]) -> Morph:
    """The morph of a boundary that is filled with elements, with nodes moved where that makes them less poor."""
    straight = fill(boundary.solids, boundary.faces, boundary.nodes, size)
    # Elements that are inverted while straight may be sound when curved; those of no volume have no gradients.
    if np.abs(scaled_jacobian(straight.points, straight.tets)).min() < _FLAT:
        raise MeshError("the mesh has a flat element")
    straight, B, offset = boundary.followed(straight)
    morph = relax(build_morph(straight, B, offset, exact, size, boundary.param, heights), exact)
    if 0 < np.count_nonzero(_quality(morph, exact) <= _WORST) <= _FEW * len(morph.mesh.tets):
        morph = slide(morph, exact)
    return morph


def _beside(morph: Morph, poor: np.ndarray) -> np.ndarray:
    """Nodes in the middle of edges of surfaces that poor elements (n, 10) have, or at least touch."""
    one, other, middle = morph.surface_edges.T
    own = np.isin(middle, poor[:, 4:])
    return middle[own if own.any() else np.isin(one, poor[:, :4]) | np.isin(other, poor[:, :4])]


def _quality(morph: Morph, P: np.ndarray) -> np.ndarray:
    """Quality of the elements (M,) at the control points P (n_points, 3)."""
    return scaled_jacobian(morph.positions(P), morph.mesh.tets)


@dataclass(frozen=True)
class SurfaceMesher:
    """Meshes bodies whose surfaces are triangulated each on its own, with elements of about this size, mm."""

    size: float
    heights: Sequence[float] = ()

    def mesh(self, body: Body[TriangulatedSurface], finest: float = 0.0) -> Morph:
        """Mesh a body, see `mesh_within`."""
        return mesh_within(self._bound, body, self.size, finest)

    def _bound(self, body: Body[TriangulatedSurface], finer: float, *_: object) -> Boundary:
        parts = [surface.triangulation(finer * self.size) for surface in body.surfaces]
        faces: dict[str, np.ndarray] = {}
        first = 0
        for part in parts:
            faces |= {name: first + triangles for name, triangles in part.faces.items()}
            first += len(part.offset)
        B, offset = sparse.csr_array(sparse.block_diag([part.B for part in parts])), [part.offset for part in parts]
        offset = np.concatenate(offset)
        nodes = B @ body.control_points() + offset
        return Boundary(B, offset, faces, nodes, {"": np.concatenate(list(faces.values()))})
