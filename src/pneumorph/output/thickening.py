"""A picture of what more rubber at every place of a body's surfaces does to its motions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from pneumorph.mesh.tets import TetMesh
from pneumorph.output.bodies import Row
from pneumorph.output.cuts import view_of
from pneumorph.output.render import images
from pneumorph.output.report_shapes import PATCH
from pneumorph.output.scenes import MOST, Scene
from pneumorph.output.view import Colours, Shape
from pneumorph.problem import Problem

STOPS = ("#2166ac", "#92c5de", "#f0f0f0", "#f4a582", "#b2182b")
"""Colours from less motion to more."""


def thickening_figure(problem: Problem, mesh: TetMesh, changes: Mapping[str, np.ndarray], unit: str) -> Figure:
    """The body at rest, once for every motion.

    Parameters
    ----------
    problem : whose body it is.
    mesh : of the whole body at rest.
    changes : of motions (N,) per mm³ of rubber that is added at nodes of surfaces, by the words for the motions.
    unit : of the motions.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    view, still = view_of(problem), np.zeros_like(mesh.points)
    scenes = [Scene(words, Shape(mesh, still, PATCH * change, inside=False), view) for words, change in changes.items()]
    skin = np.unique(np.concatenate([face.ravel() for face in mesh.faces.values()]))
    most = max(float(np.quantile(np.abs(PATCH * change[skin]), MOST)) for change in changes.values()) or 1.0
    colours = Colours(f"{unit} more by 0.1 mm of rubber on 1 cm²", STOPS)
    row = Row(scenes, (-most, most), problem.title, colours)
    return row.figure(images(row.job))
