"""Faces of a file as surfaces that lattices of control points displace."""

from pneumorph.geometry.lattice.start import lattice_body, lattice_space
from pneumorph.geometry.lattice.surface import LatticeSurface

__all__ = ["LatticeSurface", "lattice_body", "lattice_space"]
