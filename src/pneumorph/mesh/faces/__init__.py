"""Meshes of bodies from files."""

from pneumorph.mesh.faces.build import FacesMesher

__all__ = ["FacesMesher"]
