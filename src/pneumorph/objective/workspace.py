"""The workspace: what the tips of several tasks span together."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Workspace:
    """Minus the size of the convex hull of the tips of all tasks that have it, along `axes` of x, y, z: 0, 1, 2.

    `analysis/workspace.py` has its value and derivatives.
    """

    axes: tuple[int, ...]
