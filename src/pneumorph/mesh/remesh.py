"""When a morphed mesh should be replaced by a new one."""

from __future__ import annotations

import numpy as np

from pneumorph.mesh.morph import Morph
from pneumorph.mesh.quality import scaled_jacobian

_POOR = 0.15  # quality below which warm starts begin to fail
_STRETCH = 1.5  # growth of edges of the surface beyond which they are too coarse, if they are not short even so
_TURN = np.radians(75)


def needs_remesh(morph: Morph, P: np.ndarray) -> str | None:
    """The reason why the mesh no longer suits the body with control points P (n_points, 3), or None if it does.

    A mesh that was poor, or had sharply curved edges, when it was built is compared with its own initial state, so
    that a body that is hard to mesh is not remeshed for every design.
    """
    return poor(morph, P) or outgrown(morph, P)


def poor(morph: Morph, P: np.ndarray) -> str | None:
    """How poor elements are, if they are too poor; see `needs_remesh`."""
    fresh_quality, quality = (
        scaled_jacobian(points, morph.mesh.tets).min() for points in (morph.mesh.points, morph.positions(P))
    )
    if quality < min(_POOR, 0.5 * fresh_quality):
        return f"the worst element's quality fell from {fresh_quality:.2f} to {quality:.2f}"
    return None


def outgrown(morph: Morph, P: np.ndarray) -> str | None:
    """By how much the surfaces have outgrown their edges, if it is too much; see `needs_remesh`."""
    fresh, now = morph.mesh.points, morph.positions(P)
    fresh_length, fresh_turn = _edges(fresh, morph.surface_edges)
    length, turn = _edges(now, morph.surface_edges)
    stretch = float(np.quantile(length / np.maximum(fresh_length, morph.size), 0.99))
    if stretch > _STRETCH:
        return f"surface edges grew to {stretch:.2f} times the length they were made for"
    sharpest, fresh_sharpest = (float(np.quantile(angle, 0.99)) for angle in (turn, fresh_turn))
    if sharpest > max(_TURN, 1.4 * fresh_sharpest):
        return f"the surface turns by {np.degrees(sharpest):.0f}° along a single edge"
    return None


def _edges(points: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chord and turning angle of curved edges (first end, second end, mid-side node), taken as arcs of circles."""
    a, b, mid = (points[edges[:, k]] for k in range(3))
    chord = np.linalg.norm(b - a, axis=1)
    along = (b - a) / chord[:, None]
    offset = mid - (a + b) / 2
    offset -= np.einsum("ij,ij->i", offset, along)[:, None] * along
    return chord, 4 * np.arctan(2 * np.linalg.norm(offset, axis=1) / chord)
