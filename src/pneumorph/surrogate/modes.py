"""How the surfaces of a body look at any pressures: a few modes (proper orthogonal decomposition), of which there are
amounts that are polynomials of the pressures.

A mode has displacements and stretches of all nodes. Modes are the principal directions of what the known states look
like and of its derivatives by the pressures, where displacements and stretches are parts of their largest ones. So
amounts have derivatives too, and the polynomials need few states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mesh import TetMesh
from pneumorph.mesh.tets import is_cut
from pneumorph.results.fields import skin_of
from pneumorph.surrogate.polynomials import chosen, fitted, values_of
from pneumorph.surrogate.states import Sample

MOST_MODES = 40

SHARE = 0.1
"""What modes leave of the known states, as a part of the error that is allowed."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of S nodes, m of them.

    Attributes
    ----------
    modes : (m, S, 4)
        Displacements in mm, and stretches, by an amount of one.
    index, coefficients : (t, C), (t, m)
        Polynomials of the amounts, see `polynomials`.
    """

    modes: np.ndarray
    index: np.ndarray
    coefficients: np.ndarray

    def at(self, x: np.ndarray) -> np.ndarray:
        """What the surfaces look like (S, 4) at scaled pressures x (C,): displacements, and stretches above one."""
        return np.tensordot(values_of(x[None], self.index)[0] @ self.coefficients, self.modes, axes=1)


@dataclass(frozen=True, eq=False)
class Faces:
    """The surfaces of a body at rest.

    Attributes
    ----------
    points : (S, 3)
        Their nodes, mm.
    corners : {face: (n, 6)}
        Six-node triangles by their names in the mesh.
    """

    points: np.ndarray
    corners: dict[str, np.ndarray]


def modes_of(x: np.ndarray, size: np.ndarray, samples: list[Sample], tolerance: float) -> Modes | None:
    """The modes of samples that have been looked at; None where they have not.

    Parameters
    ----------
    x : (n, C)
        Their pressures, scaled to -1…1.
    size : (C,)
        The ranges of the pressures, MPa.
    samples : (n,) of Sample
    tolerance : float
        How exact they are to be, over the largest displacement.
    """
    seen = [(each.look, each.look_slopes) for each in samples if each.look is not None]
    if not seen:
        return None
    looks = np.array([look for look, _ in seen], float)
    slopes = np.array([by for _, by in seen], float) * (size / 2)[:, None, None]
    scale = np.maximum(np.abs(looks).max(axis=(0, 1)), 1e-9)
    scale[:3] = np.linalg.norm(looks[..., :3], axis=2).max() or 1.0
    count, chambers = x.shape
    flat = (looks / scale).reshape(count, -1)
    every = np.vstack([flat, (slopes / scale).reshape(count * chambers, -1)])
    _, turned = np.linalg.eigh(every @ every.T)
    found, left = [], flat.copy()
    for direction in turned.T[::-1][:MOST_MODES]:
        mode = direction @ every
        for other in found:
            mode -= (mode @ other) * other
        if not (length := np.linalg.norm(mode)) > 1e-12:
            break
        found.append(mode / length)
        left -= np.outer(left @ found[-1], found[-1])
        if np.linalg.norm(left.reshape(looks.shape)[..., :3], axis=2).max() < SHARE * tolerance:
            break
    if not found:
        return Modes(np.zeros((0, *looks.shape[1:])), np.zeros((1, chambers), int), np.zeros((1, 0)))
    basis = np.array(found)
    amounts = every @ basis.T
    values, by = amounts[:count], amounts[count:].reshape(count, chambers, -1)
    index = chosen(x, values, by)
    return Modes(basis.reshape(-1, *looks.shape[1:]) * scale, index, fitted(x, values, by, index))


def faces_of(mesh: TetMesh) -> Faces:
    """The surfaces of the mesh of a whole body."""
    skin = skin_of(mesh)
    faces = {name: np.searchsorted(skin, faces) for name, faces in mesh.faces.items() if not is_cut(name)}
    return Faces(mesh.points[skin], faces)
