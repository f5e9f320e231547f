"""Triangulations of tubes, and meshes of the bodies that they bound."""

from pneumorph.mesh.tube.build import TubeMesher, mesh_body

__all__ = ["TubeMesher", "mesh_body"]
