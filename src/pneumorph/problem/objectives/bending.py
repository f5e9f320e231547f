"""The axis across z about which an objective bends the body."""

from __future__ import annotations

import numpy as np

LEAST = np.radians(1.0)
"""Smallest angle that counts as bending."""


def longer(vector: np.ndarray, least: float) -> np.ndarray | None:
    """A vector if it is longer than the least length."""
    return vector if np.linalg.norm(vector) > least else None


def farthest(vectors: np.ndarray, least: float) -> np.ndarray | None:
    """The longest of vectors (n, 2), if it is longer than the least length."""
    return longer(vectors[np.argmax(np.linalg.norm(vectors, axis=1))], least)
