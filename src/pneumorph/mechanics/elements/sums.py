"""Sums over elements of functions of their nodes, with derivatives: for volumes, sections and faces.

They are evaluated in chunks of fixed sizes, so that they are compiled once for all meshes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.element import cap_triangles, triangle_volumes
from pneumorph.mechanics.elements.points import add_rows
from pneumorph.mechanics.elements.terms import Connectivity, Values

Measure = Callable[..., Array]
"""A function of nodes X (E, a, 3), displacements u, element data (E, k), weights (E,), and further arguments."""


def summed(measure: Measure, elements: Connectivity, X: np.ndarray, u: np.ndarray, *given: Values) -> np.ndarray:
    """The sum over all elements, for nodes X (N, 3) displaced by u.

    Parameters
    ----------
    measure : Measure
    elements : Connectivity
        Of the elements.
    X, u : (N, 3) array
        Nodes and their displacements, mm.
    *given
        Further arguments of the function.
    """
    at, moved = elements.gathered(X), elements.gathered(u)
    if not len(at):
        return np.zeros(jax.eval_shape(measure, at, moved, elements.data, elements.weight, *given).shape)
    parts = [
        np.asarray(_value(measure, at[chunk], moved[chunk], elements.data[chunk], elements.weight[chunk], given))
        for chunk in elements.chunks()
    ]
    return sum(parts[1:], parts[0])


def pulled_back(
    measure: Measure, elements: Connectivity, X: np.ndarray, u: np.ndarray, cotangents: np.ndarray, *given: Values
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (k, N, 3) of cotangent·sum by X and by u, for k cotangents at once.

    Parameters
    ----------
    measure : Measure
    elements : Connectivity
        Of the elements.
    X, u : (N, 3) array
        Nodes and their displacements, mm.
    cotangents : (k, ...) array
        Of the sum.
    *given
        Further arguments of the function.
    """
    at, moved = elements.gathered(X), elements.gathered(u)
    by_X, by_u = np.zeros((2, len(cotangents), *X.shape))
    for chunk in elements.chunks():
        arguments = at[chunk], moved[chunk], elements.data[chunk], elements.weight[chunk], given
        for parts, out in zip(_back(measure, *arguments, cotangents), (by_X, by_u), strict=True):
            for part, one in zip(np.array(parts), out, strict=True):
                add_rows(part, elements.nodes[chunk], one)
    return by_X, by_u


@partial(jax.jit, static_argnums=0)
def _value(measure: Measure, X: Values, u: Values, data: Values, weight: Values, given: tuple) -> Array:
    return measure(X, u, data, weight, *given)


@partial(jax.jit, static_argnums=0)
def _back(measure: Measure, X: Values, u: Values, data: Values, weight: Values, given: tuple, cotangents: Values):
    _, back = jax.vjp(lambda X, u: measure(X, u, data, weight, *given), X, u)
    return jax.vmap(back)(cotangents)


def cap_volumes(X: Values, u: Values, data: Values, weight: Values) -> Array:
    """What caps (E, 4, 3) over ports add to the volumes of chambers (C,), mm³; see `volumes`.

    Parameters
    ----------
    X, u : (E, 4, 3) arrays
        Nodes of the caps and their displacements, mm.
    data : (E, C) array
        Shares in the volumes of chambers.
    weight : (E,) array
        1, or 0 for padding.
    """
    return (weight * triangle_volumes(cap_triangles(jnp.asarray(X + u)))) @ jnp.asarray(data)


def volumes(X: Values, u: Values, data: Values, weight: Values) -> Array:
    """Chamber volumes (C,) in mm³ by the divergence theorem; of part of a body, its share of them.

    Mirror planes go through the origin, so the cut face of a chamber has x·n = 0 and adds nothing. The cuts of a sector
    are images in a rotation about the origin: what one adds the other takes away.

    Parameters
    ----------
    X, u : (E, 6, 3) array
        Nodes of the chambers' triangles and their displacements, mm.
    data : (E, C) array
        Shares of the triangles in the chambers.
    weight : (E,) array
        0 for padding, else 1.
    """
    return (weight * triangle_volumes(X + u)) @ jnp.asarray(data)
