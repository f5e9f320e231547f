"""Meshes of quadratic tetrahedra that follow the exact surfaces of a body."""

import pneumorph.kept  # noqa: F401 (before anything of Numba)
from pneumorph.mesh.build import Mesher, SurfaceMesher
from pneumorph.mesh.morph import Morph, between
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.mesh.relax import relax
from pneumorph.mesh.remesh import needs_remesh, poor
from pneumorph.mesh.slide import slide
from pneumorph.mesh.tets import Covered, TetMesh
from pneumorph.mesh.transfer import transfer
from pneumorph.mesh.unfold import Unfolded, unfold

__all__ = [
    "Covered",
    "Mesher",
    "Morph",
    "SurfaceMesher",
    "TetMesh",
    "Unfolded",
    "between",
    "needs_remesh",
    "poor",
    "relax",
    "scaled_jacobian",
    "slide",
    "transfer",
    "unfold",
]
