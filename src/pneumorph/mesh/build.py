"""From a body to a mesh that follows it."""

from __future__ import annotations

import numpy as np

from pneumorph.errors import MeshError
from pneumorph.geometry import Body
from pneumorph.mesh.cut import with_cut
from pneumorph.mesh.morph import Morph, build_morph
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.mesh.surface import surface_mesh
from pneumorph.mesh.volume import fill

_TURN = np.radians(45)
_FINER = (1.0, 0.93, 0.86, 0.8, 0.65, 0.5)
"""Factors on turning angle and size in successive tries: where chords just cross a little finer will do, and half the
size has eight times the elements."""
_SEEN = 6
"""Decimals of the control points' mm that are seen while a body is meshed: rounding errors must not decide how. The
mesh is then moved to the exact places."""
_WORST = 0.02
"""Quality below which a mesh counts as failed."""


def mesh_body(body: Body, size: float, mirror: str | None = None) -> Morph:
    """Mesh a body, or the half at y ≥ 0 or x ≥ 0 of a symmetric one, with quadratic tetrahedra of about the given edge.

    Where chords of a coarse triangulation cross, or curving the elements inverts one, finer triangulations are tried.

    Parameters
    ----------
    body : Body
    size : float
        Edge length, mm; edges are shorter where the surfaces turn sharply.
    mirror : "xz" or "yz", optional
        The plane that cuts a symmetric body in two.

    Raises
    ------
    MeshError
        If no try gives a mesh without inverted or nearly flat elements.
    """
    exact = body.control_points()
    P = np.round(exact, _SEEN)
    body = body.with_control_points(P)
    reason = MeshError("never tried")
    for finer in _FINER:
        surface = surface_mesh(body, finer * size, finer * _TURN, mirror)
        faces, nodes = surface.faces, surface.B @ P
        try:
            if mirror is not None:
                faces, nodes = with_cut(faces, nodes, mirror, finer * size)
            straight = fill(faces, nodes, finer * size)
        except MeshError as error:
            reason = error
            continue
        result = build_morph(straight, surface.B, exact, size, surface.param)
        worst = scaled_jacobian(result.mesh.points, result.mesh.tets).min()
        if worst > _WORST:
            return result
        reason = MeshError(f"the mesh has an element of quality {worst:.2g}")
    raise MeshError(f"{reason}; surfaces may touch, or the mesh size of {size:g} mm may be too coarse for the walls")
