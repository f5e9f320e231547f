"""Faces of a file on which something thin lies: the points at which it is integrated, and its direction there."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from pneumorph.cad.faces import TURNED, Faces
from pneumorph.cad.parts import Parts, Where
from pneumorph.cad.shells import place
from pneumorph.errors import MeshError
from pneumorph.mesh.tets import RULE, Covered, triangle_gradient
from pneumorph.problem.reinforcement import EXTERIOR

_ACROSS = 1e-3
"""Least part of a direction that lies in a face, relative to all of it."""


@dataclass(frozen=True)
class FaceCover:
    """What covers faces.

    Attributes
    ----------
    name : str
        What lies on them.
    surfaces : sequence of str
        "exterior" or names of chambers, without base and tip.
    on : sequence of Where, or None
        The faces, in place of whole surfaces.
    along : (float, float, float)
        The unit vector that is laid on the faces as the direction from base to tip.
    directed : bool
        Whether that matters.
    """

    name: str
    surfaces: tuple[str, ...]
    on: tuple[Where, ...] | None
    along: tuple[float, float, float]
    directed: bool


Choice = Callable[[Where], np.ndarray]


def covered(faces: Faces, parts: Parts, covers: Iterable[FaceCover], on: Choice) -> dict[str, Covered]:
    """What is covered, by the names of the covers.

    Directions are constants of the faces as they are in the file; they move as these do.

    Parameters
    ----------
    faces : Faces
    parts : Parts
        Which of them are what.
    covers : iterable of FaceCover
    on : function
        The triangles (k, 6) of the faces somewhere.

    Raises
    ------
    MeshError
        If a direction is normal to a face; a sentence whose subject is the file.
    """
    return {cover.name: _covered(faces, parts, cover, on) for cover in covers}


def _covered(faces: Faces, parts: Parts, cover: FaceCover, on: Choice) -> Covered:
    if cover.on is None:
        names = [each if each == EXTERIOR else f"chamber {each}" for each in cover.surfaces]
        nodes = np.concatenate([faces.triangles[parts.triangles[name]] for name in names])
    else:
        nodes = np.unique(np.concatenate([on(where) for where in cover.on]), axis=0)
    # As on tubes, normals of the faces of chambers point away from what is in them.
    walls = [own for name, own in parts.triangles.items() if name.startswith("chamber ")]
    walls = {tuple(six) for own in walls for six in faces.triangles[own].tolist()}
    inner = np.array([tuple(six) in walls for six in nodes.tolist()], bool)
    nodes[inner] = nodes[inner][:, TURNED]
    tangents = np.einsum("eai,qak->eqik", faces.points[nodes], triangle_gradient(RULE))
    local = np.einsum("eqki,i->eqk", np.linalg.pinv(tangents), np.array(cover.along))
    within = np.linalg.norm(np.einsum("eqik,eqk->eqi", tangents, local), axis=2)
    if cover.directed and within.min(initial=1.0) < _ACROSS:
        where = place(faces.points[nodes[within.min(axis=1).argmin(), 0]])
        raise MeshError(
            f'has a face at {where} that is normal to the direction of "{cover.name}"; choose other faces by on, or '
            "another direction by along"
        )
    local[within < _ACROSS] = (1.0, 0.0)
    count = len(nodes)
    places = np.broadcast_to(RULE, (count, *RULE.shape))
    weights = np.full((count, len(RULE), 1), 1.0 / 6.0)
    return Covered(nodes, np.concatenate([places, weights, local], axis=-1))
