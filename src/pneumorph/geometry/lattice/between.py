"""Where solids of a body meet, within its rubber: such places are displaced by all of its surfaces together.

The displacement of a place is a mean of those by the lattices of all surfaces. Each is weighed by one over the square
of its distance from the place (Shepard 1968; with surfaces in place of points, Rvachev et al. 2001). On a surface the
mean is the displacement by its own lattice, so that nothing tears where an interface ends in a surface; and it is
linear in the control points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.cad.shells import quarters
from pneumorph.geometry.body import Body
from pneumorph.geometry.lattice.surface import LatticeSurface

Array = NDArray[np.float64]

_ON = 1e-6
"""Distance from a surface, relative to the box of the exterior, that counts as none."""


def shares(surfaces: Sequence[LatticeSurface], places: Array) -> Array:
    """The weight of each surface (s, n) in the displacement of places (n, 3) in the file; together they are one."""
    # Loads Numba, which most problems are read without.
    from pneumorph.cad.boxes import boxes_of, nearest

    box = surfaces[0].lattice
    near = _ON * float(np.linalg.norm(box.upper - box.lower))
    found = np.empty((len(surfaces), len(places)))
    for surface, into in zip(surfaces, found, strict=True):
        on = nearest(boxes_of(surface.outline, quarters(surface.patches)), places).place
        into[:] = 1.0 / (((places - on) ** 2).sum(axis=1) + near**2)
    return found / found.sum(axis=0)


def weights_between(body: Body[LatticeSurface], places: Array) -> sparse.csr_array:
    """B (n, n_points): places (n, 3) in the file move by B @ dP where control points move by dP."""
    if not len(places):
        return sparse.csr_array((0, body.n_points))
    parts = [
        sparse.diags_array(share) @ surface.lattice.weights(places)
        for share, surface in zip(shares(body.surfaces, places), body.surfaces, strict=True)
    ]
    return sparse.csr_array(sparse.hstack(parts))


def in_the_file(body: Body[LatticeSurface]) -> Array:
    """The control points (n_points, 3) in mm with which a body is as it is in the file."""
    return np.concatenate([surface.lattice.points() for surface in body.surfaces])


@dataclass(frozen=True, eq=False)
class Interface:
    """Where solids of a body meet.

    Attributes
    ----------
    body : Body
        Whose surfaces displace it.
    outline : (k, 3) float, and patches (m, 6) int
        As it is in the file, in six-node triangles, mm.
    """

    body: Body[LatticeSurface]
    outline: Array
    patches: NDArray[np.int64]

    def moved(self, places: Array) -> Array:
        """Where places (n, 3) in the file are moved, mm."""
        change = self.body.control_points() - in_the_file(self.body)
        shift = np.zeros_like(places)
        for share, surface, where in zip(
            shares(self.body.surfaces, places), self.body.surfaces, self.body.slices, strict=True
        ):
            shift += share[:, None] * (surface.lattice.weights(places) @ change[where])
        return places + shift

    def shell(self) -> tuple[Array, NDArray[np.int64]]:
        """Its nodes as they are displaced, mm, and flat triangles between them."""
        return self.moved(self.outline), quarters(self.patches)
