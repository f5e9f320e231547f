"""Friction on obstacles, smoothed and lagged as in incremental potential contact (Li et al. 2020), as terms of Π.

    D = μ Σ λ_q f(|t_q|),   f(y) = y²/ε − y³/3ε² for y < ε, else y − ε/3,   t = (I − n⊗n)(y − a)

with the normal force λ, the normal n of the obstacle and the anchor a of every sample point, which
`solve/friction_sweep.py` keeps from one step to the next, and the place y of the point as the obstacle sees it
(`pose.py`). So friction is at most μλ, is that where a point has slipped by ε or more, and has a continuous derivative
where it sticks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.contact.implicit import posed
from pneumorph.mechanics.contact.pose import in_frame
from pneumorph.mechanics.contact.samples import SAMPLE_N
from pneumorph.mechanics.contact.shapes import length_of
from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.terms import Loads, Local, Values


class Grip(NamedTuple):
    """What friction depends on at the sample points (F, 7) of a surface, where an obstacle is in its place.

    Attributes
    ----------
    force : (F, 7) normal forces λ, N.
    anchor : (F, 7, 3) places from which points slip, mm.
    normal : (F, 7, 3) unit vectors away from the obstacle.
    """

    force: np.ndarray
    anchor: np.ndarray
    normal: np.ndarray

    def slip(self, places: np.ndarray) -> np.ndarray:
        """How far points (F, 7, 3) have slipped along the obstacle."""
        away = places - self.anchor
        return away - np.sum(away * self.normal, axis=-1, keepdims=True) * self.normal

    def traction(self, places: np.ndarray, reach: float) -> np.ndarray:
        """Friction (F, 7, 3) over μ at points (F, 7, 3): λ f′(|t|) t/|t|, in N."""
        slip = self.slip(places)
        size = np.linalg.norm(slip, axis=-1)
        share = np.where(size < reach, (2.0 - size / reach) / reach, 1.0 / np.maximum(size, reach))
        return (self.force * share)[..., None] * slip

    def data(self) -> np.ndarray:
        """The same as data (F, 49) of elements."""
        return np.concatenate([self.force[..., None], self.anchor, self.normal], axis=-1).reshape(len(self.force), -1)


@partial(register_dataclass, data_fields=["coefficient", "reach", "number", "center", "object"], meta_fields=["free"])
@dataclass(frozen=True, eq=False)
class Friction(ElementEnergy):
    """D of one obstacle: the coefficient μ, the slip ε in mm, its centre, and its rows as in a `Barrier`.

    The data of a face are those of a `Grip`.
    """

    coefficient: Values
    reach: Values
    number: Values = 0
    center: Values = (0.0, 0.0, 0.0)
    object: Values = 0
    free: bool = False

    @property
    def drags(self) -> int:
        return int(self.number)

    def energies(self, local: Local, loads: Loads) -> Array:
        grip = jnp.asarray(local.data).reshape(local.X.shape[0], -1, 7)
        force, anchor, normal = grip[..., 0], grip[..., 1:4], grip[..., 4:]
        places = jnp.einsum("qa,eai->eqi", jnp.asarray(SAMPLE_N), local.X + local.u)
        away = in_frame(places, jnp.asarray(self.center), posed(self, local, loads)) - anchor
        slip = away - jnp.sum(away * normal, axis=-1, keepdims=True) * normal
        return self.coefficient * jnp.sum(force * smoothed(slip, self.reach), axis=1)


def smoothed(slip: Values, reach: Values) -> Array:
    """f(|t|) in mm of slips t (…, 3)."""
    square, size = jnp.sum(slip * slip, axis=-1), length_of(slip)
    return jnp.where(size < reach, square / reach - square * size / (3.0 * reach**2), size - reach / 3.0)
