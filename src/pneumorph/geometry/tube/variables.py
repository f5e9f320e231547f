"""The design variables of a body of tubes: which coordinates of control points are fixed, tied and bounded.

The exterior's ends keep their z; all points of a chamber's flat end have the same z; rings in planes between
rubbers keep theirs (see `level.py`); a pole is one point, and the row next to it has the same z, without which the end
would be a cone. At the ends of an axis that is not straight, z is along it. Where half-planes between rubbers cut
surfaces, variables are along these and normal to them instead of along x and y, and columns in them keep their distance
(see `wedge.py`). Bounds keep surfaces to their sides of such planes and half-planes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.geometry.body import Body
from pneumorph.geometry.design_space import DesignSpace, ShapeVariables, build_space, tied_coordinates
from pneumorph.geometry.tube.images import images
from pneumorph.geometry.tube.level import Sides, sides_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import UPWARDS, TubeSurface, turn_to
from pneumorph.geometry.tube.wedge import Cones, cones_of
from pneumorph.problem.body import Symmetry
from pneumorph.symmetry.basis import column_squares, symmetric_basis
from pneumorph.symmetry.operations import operations

if TYPE_CHECKING:
    from pneumorph.problem import BodySpec, Problem

Array = NDArray[np.float64]


def build_design_space(problem: Problem, body: Body) -> DesignSpace:
    """Build the design variables of a problem with the starting body `body`."""
    sides, cones = sides_of(problem), cones_of(problem, body)
    each = list(zip(body.surfaces, sides, cones, strict=True))
    blocks = [_variable_of_coordinate(*one) for one in each]
    counts = [int(block.max()) + 1 for block in blocks]
    shifts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    variable = np.concatenate(
        [np.where(block >= 0, block + shift, -1).ravel() for block, shift in zip(blocks, shifts, strict=True)]
    )
    turn = _turn(np.concatenate([_frames(*one) for one in zip(body.surfaces, cones, strict=True)]))
    own = tied_coordinates(turn.T @ body.control_points().ravel(), variable)
    L, offset, shape = sparse.csr_matrix(turn @ own.L), turn @ own.offset, own.start
    if problem.tubes.symmetry != Symmetry():
        L, offset, shape = _symmetric(problem.tubes, L, offset, shape)
    low, high = (np.concatenate([_limits(*one, name).ravel() for one in each]) for name in ("low", "high"))
    least, most = _bounds(sparse.csr_matrix(turn.T @ L), turn.T @ offset, low, high)

    return build_space(problem, body, ShapeVariables(L, offset, shape, least, most))


def _frames(surface: TubeSurface, cones: Cones) -> Array:
    """The frames (n_points, 3, 3) in which coordinates of control points are variables, as unit vectors in columns."""
    angle = cones.angle
    cosine, sine = (np.where(np.abs(part) < 1e-15, 0.0, part) for part in (np.cos(angle), np.sin(angle)))
    frames = np.zeros((*angle.shape, 3, 3))
    frames[..., 0, 0], frames[..., 0, 1], frames[..., 1, 0], frames[..., 1, 1] = cosine, -sine, sine, cosine
    frames[..., 2, 2] = 1.0
    for rows, direction in zip(([0, 1], [-1, -2]), surface.directions, strict=True):
        if direction != UPWARDS:
            frames[rows] = turn_to(direction)
    return frames.reshape(-1, 3, 3)


def _turn(frames: Array) -> sparse.csr_matrix:
    """From coordinates of control points in their frames (n_points, 3, 3) to x, y and z, (3·n, 3·n)."""
    point, row, column = np.nonzero(frames)
    places = (3 * point + row, 3 * point + column)
    return sparse.csr_matrix((frames[point, row, column], places), shape=(3 * len(frames), 3 * len(frames)))


def _limits(surface: TubeSurface, sides: Sides, cones: Cones, name: str) -> Array:
    """Bounds (n_r, n_q, 3) of the control points of a surface in their frames, the lower or the upper ones."""
    across, along = (
        getattr(cones, name),
        np.broadcast_to(getattr(sides, name)[:, None, None], (*surface.net.shape[:2], 1)),
    )
    return np.concatenate([across, along], axis=2)


def _bounds(L: sparse.csr_matrix, offset: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Least and largest values of the shape variables with which coordinates L Φ + offset keep their bounds."""
    # A variable that moves a bounded coordinate is the only one, and moves images by its own amount, perhaps backwards
    # or, on mirror planes, in part.
    row, column = L.nonzero()
    share = np.asarray(L[row, column]).ravel()
    some = (np.isfinite(low) | np.isfinite(high))[row] & (np.abs(share) > 1e-9)
    row, column, share = row[some], column[some], share[some]
    ends = [(bound[row] - offset[row]) / share for bound in (low, high)]
    count = len(column_squares(L))
    least, most = np.full(count, -np.inf), np.full(count, np.inf)
    np.maximum.at(least, column, np.minimum(*ends))
    np.minimum.at(most, column, np.maximum(*ends))
    return least, most


def _symmetric(
    spec: BodySpec, L: sparse.csr_matrix, offset: Array, shape: Array
) -> tuple[sparse.csr_matrix, Array, Array]:
    """The map from the independent variables of a symmetric body: its L, offset and starting values."""
    group, start = operations(spec.symmetry), starting_body(spec)
    basis, projector = symmetric_basis(L, group, [images(start, each, spec.length) for each in group])
    # The operations leave the body's centre fixed, so they are applied to coordinates relative to it.
    middle = np.tile([0.0, 0.0, spec.length / 2.0], len(offset) // 3)
    centre = (L.T @ middle) / column_squares(L)
    shape = centre + projector @ (shape - centre)
    independent = (basis.T @ shape) / column_squares(basis)
    return sparse.csr_matrix(L @ basis), offset + L @ (shape - basis @ independent), independent


def _variable_of_coordinate(surface: TubeSurface, sides: Sides, cones: Cones) -> NDArray[np.int64]:
    """Index of the variable of each coordinate of a net in its frames, (n_r, n_q, 3); -1 if the coordinate is fixed."""
    group = np.arange(surface.net.size).reshape(surface.net.shape)
    for pole, row, beside in zip(surface.poles, (0, -1), (1, -2), strict=True):
        if pole:
            group[row] = group[row, 0]
            group[beside, :, 2] = group[row, 0, 2]
            if not surface.cavity:
                group[[row, beside], :, 2] = -1
        else:
            group[row, :, 2] = group[row, 0, 2] if surface.cavity else -1
    group[..., 2] = np.where(np.isin(group[..., 2], group[sides.fixed, :, 2]), -1, group[..., 2])
    group[..., :2][cones.fixed] = -1
    names, numbers = np.unique(group, return_inverse=True)
    return numbers.reshape(group.shape) - int(names[0] < 0)
