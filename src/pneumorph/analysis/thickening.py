"""What more rubber at a place of a body's surfaces does to a motion: the shape gradient, by area."""

from __future__ import annotations

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.analysis.surface_motions import offset
from pneumorph.doing import doing
from pneumorph.mesh import Morph
from pneumorph.mesh.tets import TRIANGLE_EDGES, chambers_of
from pneumorph.problem import Problem
from pneumorph.problem.components import MOTIONS
from pneumorph.sensitivity import motion_slopes

CORNERS = 3
"""The first nodes of a six-node triangle."""


@doing("finding what more rubber does to motions")
def thickenings(problem: Problem, disc: Discretisation, analysis: Analysis) -> dict[str, dict[str, np.ndarray]]:
    """The changes (N,) of the motions that tasks are about, by task and motion, in mm or rad per mm³.

    Of a part of a body, rubber at one place of the whole; its images add as much. See `thickening`.

    Parameters
    ----------
    problem : whose tasks are looked at.
    disc, analysis : a body of it, or a part of it, with its states.
    """
    found: dict[str, dict[str, np.ndarray]] = {}
    for task in problem.task:
        if asked := list(task.objective.tip_motions):
            at, state = analysis.configurations[task.name], analysis.equilibria[task.name].state
            slopes = motion_slopes(at, disc.tangents[task.name], state).X / disc.model.copies
            found[task.name] = {motion: thickening(disc.morph, at.X, slopes[MOTIONS.index(motion)]) for motion in asked}
    return found


def thickening(morph: Morph, X: np.ndarray, by_X: np.ndarray) -> np.ndarray:
    """The change (N,) of a motion per volume of rubber that is added at nodes of the surfaces, per mm³; elsewhere 0.

    At a corner node it is that of a layer as thick as the corner's linear shape function, over the volume of the layer:
    that of quadratic ones is zero at corners. Mid-side nodes have the mean of their corners. Nodes at edges of two
    surfaces have what the last one has.

    Parameters
    ----------
    morph, X : the mesh of a body or a part of it, and where its nodes are (N, 3), mm.
    by_X : (N, 3) derivatives of the motion by all nodes.
    """
    mesh, by_surface = morph.mesh.at(X), np.zeros_like(X)
    by_surface[: morph.n_surface] = morph.on_surface(by_X)
    change = np.zeros(len(X))
    for face in [name for name in mesh.faces if name == "exterior" or chambers_of(name)]:
        triangles = mesh.faces[face]
        by_node = np.einsum("ni,ni->n", by_surface, offset(mesh, face))
        edges = triangles[:, TRIANGLE_EDGES]
        # Every edge of a closed surface is in two triangles, at its rim in one: each node counts once.
        mids, first = np.unique(triangles[:, CORNERS:], return_index=True)
        ends = edges.reshape(-1, 2)[first]
        layer, area = by_node.copy(), np.zeros(len(X))
        np.add.at(layer, ends, 0.5 * by_node[mids][:, None])
        places = X[triangles[:, :CORNERS]]
        areas = 0.5 * np.linalg.norm(np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]), axis=1)
        np.add.at(area, triangles[:, :CORNERS], areas[:, None] / CORNERS)
        corners = np.unique(triangles[:, :CORNERS])
        change[corners] = layer[corners] / area[corners]
        change[mids] = change[ends].mean(axis=1)
    return change
