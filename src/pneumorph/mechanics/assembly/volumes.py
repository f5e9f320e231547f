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
    """Volumes (C,) in mm³ of what is meshed, for nodes X (N, 3) displaced by u and obstacles at poses (K, 6)."""
    found = [sums.summed(measure, part, X, u, *given) for measure, part, given in volume_parts(model, shift)]
    return np.sum(found, axis=0)
