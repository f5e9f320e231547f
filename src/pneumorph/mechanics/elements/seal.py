"""Chambers whose open rim lies on a rigid plane, as that of a suction cup does.

Such a chamber is bounded by its walls and the plane. Its volume is ∫ h n·dA over the walls, with the height h above
the plane and its normal n; on a rim in the plane, where h = 0, the pressure does no work, so that it acts on walls and
plane alone. Elements are parts of the rim; each adds what this differs by from ⅓ ∫ x·dA over the walls.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.elements.element import TRIANGLE_WEIGHTS, cap_triangles, triangle_points
from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.plate import rotation
from pneumorph.mechanics.elements.terms import Loads, Local, Values


@register_dataclass
@dataclass(frozen=True, eq=False)
class SealPressure(ElementEnergy):
    """−Σ p_c V_c of what rims (E, 3 nodes: ends of an edge, and its middle) add; the data are their shares (C,).

    Attributes
    ----------
    point, normal : (3,)
        A point of the plane in its own place, mm, about which it turns, and its normal.
    number : int array
        Of the plane among the obstacles.
    """

    point: Values
    normal: Values
    number: Values

    def plane(self, shift: Values) -> tuple[Array, Array]:
        """Point and normal with the obstacles at poses (K, 6)."""
        pose = jnp.asarray(shift)[self.number]
        return self.point + pose[:3], rotation(pose[3:]) @ self.normal

    def energies(self, local: Local, loads: Loads) -> Array:
        return -(local.data @ loads.pressure) * _sealed(local.X + local.u, *self.plane(loads.shift))


def seal_volumes(X: Values, u: Values, data: Values, weight: Values, point: Values, normal: Values) -> Array:
    """What the rims (E, 3, 3) on a plane add to the volumes of chambers (C,), mm³; see `sums.volumes`.

    Parameters
    ----------
    X, u : (E, 3, 3) arrays
        Nodes of the rims and their displacements, mm.
    data : (E, C) array
        Shares in the volumes of chambers.
    weight : (E,) array
        1, or 0 for padding.
    point, normal : (3,) array
        Of the plane.
    """
    return (weight * _sealed(jnp.asarray(X + u), jnp.asarray(point), jnp.asarray(normal))) @ jnp.asarray(data)


def _sealed(rim: Array, point: Array, normal: Array) -> Array:
    """⅓ ∫ x·dA − ∫ h n·dA (E,) over the triangles between a point of the plane and parts of the rim."""
    apex = jnp.broadcast_to(point, (len(rim), 1, 3))
    place, area = triangle_points(cap_triangles(jnp.concatenate([apex, rim], axis=1)))
    height = jnp.einsum("i,iqs->qs", normal, place - point[:, None, None])
    through = jnp.einsum("i,iqs->qs", normal, area)
    return jnp.asarray(TRIANGLE_WEIGHTS) @ (jnp.sum(place * area, axis=0) / 3.0 - height * through)
