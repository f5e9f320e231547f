"""Triangulations of tubes, and meshes of the bodies that they bound."""

from pneumorph.mesh.tube.build import mesh_body

__all__ = ["mesh_body"]
