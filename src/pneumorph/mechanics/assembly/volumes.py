"""The volumes of chambers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements import sums
from pneumorph.mechanics.elements.seal import seal_volumes
from pneumorph.mechanics.elements.terms import Connectivity


def volume_parts(model: Model, shift: np.ndarray | None) -> Iterator[tuple[sums.Measure, Connectivity, tuple]]:
    """The sums that make the volumes of chambers (C,), with obstacles at poses (K, 6): of walls, caps and seals."""
    yield sums.volumes, model.cavities, ()
    if model.caps.count:
        yield sums.cap_volumes, model.caps, ()
    for seal in model.seals:
        assert shift is not None
        yield seal_volumes, seal.connectivity, seal.energy.plane(shift)  # pyright: ignore[reportAttributeAccessIssue]


def volumes_of(model: Model, X: np.ndarray, u: np.ndarray, shift: np.ndarray | None) -> np.ndarray:
    """Volumes (C,) of the chambers in what is meshed, mm³.

    Parameters
    ----------
    model : Model
    X, u : (N, 3) arrays
        Undeformed positions of the nodes, and their displacements, mm.
    shift : (K, 6) array or None
        Poses of obstacles, on which the rims of sealed chambers lie, mm and rad.
    """
    volumes = [sums.summed(measure, part, X, u, *given) for measure, part, given in volume_parts(model, shift)]
    return np.sum(volumes, axis=0)
