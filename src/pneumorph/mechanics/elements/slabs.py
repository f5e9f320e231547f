"""Moments of slabs of a body over the undeformed volume of its tetrahedra, with derivatives: Numba kernels.

The weight in a slab is cos² of the distance from its middle, so that means change smoothly when nodes are moved into a
slab or out of it. The 16 moments are Σw, Σw P, Σw x and Σw x ⊗ P: P is the undeformed place of a point relative to the
middle of the slab on the z axis, x its deformed place.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pneumorph.mechanics.elements.element import TET_DN, TET_N, TET_WEIGHT
from pneumorph.mechanics.elements.points import FLAGS, inverse
from pneumorph.mechanics.elements.terms import Connectivity

_PLACES, _SLOPES, _SHARE = np.array(TET_N), np.array(TET_DN), float(TET_WEIGHT)


def slab_moments(elements: Connectivity, X: np.ndarray, u: np.ndarray, middles: np.ndarray, half: float) -> np.ndarray:
    """The moments (S, 16) of slabs.

    Parameters
    ----------
    elements : Connectivity
        Of tetrahedra.
    X, u : (N, 3) array
        Nodes and their displacements, mm.
    middles : (S,) array
        Heights of the middles of the slabs, mm.
    half : float
        Half of the thickness of each, mm.
    """
    moments = np.zeros((len(middles), 16))
    if len(middles):
        _moments(X, u, elements.nodes[: elements.count], middles, half, moments)
    return moments


def slab_moments_pulled_back(
    elements: Connectivity, X: np.ndarray, u: np.ndarray, middles: np.ndarray, half: float, cotangents: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (k, N, 3) of cotangents·moments by X and by u.

    Parameters
    ----------
    elements, X, u, middles, half
        As for `slab_moments`.
    cotangents : (k, S, 16) array
    """
    by_X, by_u = np.zeros((2, len(cotangents), *X.shape))
    used = cotangents.any(axis=2)
    _pull_back(X, u, elements.nodes[: elements.count], middles, half, cotangents, used, by_X, by_u)
    return by_X, by_u


@numba.njit(cache=True, fastmath=FLAGS)
def _at(X, u, nodes, q, P, x, J):
    """Write the place of a point, its deformed place and J = ∂X/∂ξ to P, x (3,) and J (3, 3)."""
    P[:], x[:], J[:] = 0.0, 0.0, 0.0
    for a in range(10):
        share = _PLACES[q, a]
        for i in range(3):
            place = X[nodes[a], i]
            P[i] += share * place
            x[i] += share * (place + u[nodes[a], i])
            for k in range(3):
                J[i, k] += place * _SLOPES[q, a, k]


@numba.njit(cache=True, fastmath=FLAGS)
def _moments(X, u, nodes, middles, half, moments):
    """Add the moments of all elements to `moments`."""
    P, x, J, A = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for e in range(nodes.shape[0]):
        for q in range(4):
            _at(X, u, nodes[e], q, P, x, J)
            height, volume = P[2], _SHARE * inverse(J, A)
            for s in range(middles.shape[0]):
                away = (height - middles[s]) / half
                if abs(away) >= 1.0:
                    continue
                w, out = volume * math.cos(0.5 * math.pi * away) ** 2, moments[s]
                P[2] = height - middles[s]
                out[0] += w
                for i in range(3):
                    out[1 + i] += w * P[i]
                    out[4 + i] += w * x[i]
                    for j in range(3):
                        out[7 + 3 * i + j] += w * x[i] * P[j]


@numba.njit(cache=True, fastmath=FLAGS)
def _pull_back(X, u, nodes, middles, half, cotangents, used, by_X, by_u):
    """Add the derivatives; `used` (k, S) says which cotangents are not zero."""
    P, x, J, A = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    by_place, by_moved = np.empty(3), np.empty(3)
    for e in range(nodes.shape[0]):
        for q in range(4):
            _at(X, u, nodes[e], q, P, x, J)
            height, volume = P[2], _SHARE * inverse(J, A)
            for s in range(middles.shape[0]):
                away = (height - middles[s]) / half
                if abs(away) >= 1.0:
                    continue
                share = math.cos(0.5 * math.pi * away) ** 2
                slope = -0.5 * math.pi / half * math.sin(math.pi * away)
                P[2] = height - middles[s]
                for k in range(cotangents.shape[0]):
                    if not used[k, s]:
                        continue
                    bar = cotangents[k, s]
                    value = bar[0]
                    for i in range(3):
                        by_place[i], by_moved[i] = bar[1 + i], bar[4 + i]
                        value += bar[1 + i] * P[i] + bar[4 + i] * x[i]
                    for i in range(3):
                        for j in range(3):
                            product = bar[7 + 3 * i + j]
                            by_place[j] += product * x[i]
                            by_moved[i] += product * P[j]
                            value += product * x[i] * P[j]
                    for i in range(3):
                        by_moved[i] *= volume * share
                        by_place[i] = volume * share * by_place[i] + by_moved[i]
                    by_place[2] += volume * slope * value
                    grown = volume * share * value
                    for a in range(10):
                        node, part = nodes[e, a], _PLACES[q, a]
                        for i in range(3):
                            # ∂ det J/∂J = det J A⊤
                            stretched = (
                                A[0, i] * _SLOPES[q, a, 0] + A[1, i] * _SLOPES[q, a, 1] + A[2, i] * _SLOPES[q, a, 2]
                            )
                            by_X[k, node, i] += part * by_place[i] + grown * stretched
                            by_u[k, node, i] += part * by_moved[i]
