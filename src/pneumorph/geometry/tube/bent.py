"""Tubes about axes that are not straight, from those about z."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.problem.axis import Axis


def bent(surface: TubeSurface, axis: Axis) -> TubeSurface:
    """A tube about z, each of whose rows has one z, about an axis: cross-sections lie across it at the same lengths.

    Parameters stay. Between the parameters of the rows the cross-sections are interpolated by the tube's own splines,
    which changes places in the fourth order of the distance of rows, and at joints of arcs in the second.
    """
    at = surface.basis_r.greville
    values = surface.basis_r.matrix(at)
    rows = np.einsum("rj,jki->rki", values, surface.net)
    places, turns = axis.at(rows[:, 0, 2])
    wanted = places[:, None] + np.einsum("rij,rkj->rki", turns[..., :2], rows[..., :2])
    net = np.linalg.solve(values, wanted.reshape(len(at), -1)).reshape(wanted.shape)
    net[[0, -1]] = wanted[[0, -1]]
    # Right angles are exact.
    base, tip = np.where(np.abs(turns[[0, -1], :, 2]) < 1e-15, 0.0, turns[[0, -1], :, 2])
    for pole, row, beside, direction in zip(surface.poles, (0, -1), (1, -2), (base, tip), strict=True):
        if pole:
            net[beside] -= ((net[beside] - net[row]) @ direction)[:, None] * direction
    return replace(surface, net=net, directions=(tuple(base.tolist()), tuple(tip.tolist())))
