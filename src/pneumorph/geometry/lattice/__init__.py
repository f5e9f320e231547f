"""Faces of a file as surfaces that lattices of control points displace."""

from pneumorph.geometry.lattice.start import deviations_of, lattice_body
from pneumorph.geometry.lattice.surface import LatticeSurface
from pneumorph.geometry.lattice.variables import lattice_space

__all__ = ["LatticeSurface", "deviations_of", "lattice_body", "lattice_space"]
