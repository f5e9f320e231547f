"""Where stable states are: a union of boxes of pressures, each from no pressure to a corner.

It is assumed that what is unstable stays so if all pressures are raised further. Wherever a state is missing, the boxes
that hold it are cut below it in one pressure each.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

THIN = 1e-3
"""Boxes that are thinner, over the range of a pressure, are left out."""


@dataclass(frozen=True, eq=False)
class Domain:
    """Boxes of pressures (MPa) of C chambers.

    Attributes
    ----------
    bounds : (C, 2)
    corners : (K, C)
    """

    bounds: np.ndarray
    corners: np.ndarray

    @property
    def base(self) -> np.ndarray:
        """No pressure (C,), or what is nearest to it."""
        return np.clip(0.0, *self.bounds.T)

    @property
    def size(self) -> np.ndarray:
        return np.ptp(self.bounds, axis=1)

    def holds(self, pressures: np.ndarray) -> np.ndarray:
        """Whether (n,) pressures (n, C) are in the domain."""
        low, high = self._ends()
        tiny, p = 1e-9 * self.size, np.asarray(pressures)[:, None]
        return np.any(np.all((p >= low - tiny) & (p <= high + tiny), axis=2), axis=1)

    def cut(self, stable: np.ndarray, missing: np.ndarray) -> Domain:
        """Without what lies beyond pressures (C,) without a state; on the way there `stable` (C,) are the last."""
        low, high = self._ends()
        tiny = 1e-9 * self.size
        within = np.all((missing >= low - tiny) & (missing <= high + tiny), axis=1)
        kept = list(self.corners[~within])
        for corner in self.corners[within]:
            for c in range(len(corner)):
                if abs(stable[c] - self.base[c]) > THIN * self.size[c]:
                    kept.append(np.where(np.arange(len(corner)) == c, stable[c], corner))
        return Domain(self.bounds, _outermost(np.array(kept).reshape(-1, len(missing)), self.base))

    def with_corners(self, corners: np.ndarray) -> Domain:
        """With other boxes, of which those within others are left out."""
        return Domain(self.bounds, _outermost(np.asarray(corners), self.base))

    def drawn(self, count: int, rng: np.random.Generator, dense: bool = False) -> np.ndarray:
        """Random pressures (count, C), uniform in it, or denser towards the bounds."""
        found: list[np.ndarray] = []
        while len(found) < count:
            part = rng.random(len(self.bounds))
            p = self.bounds[:, 0] + self.size * ((1 - np.cos(np.pi * part)) / 2 if dense else part)
            if self.holds(p[None])[0]:
                found.append(p)
        return np.array(found)

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        base = np.broadcast_to(self.base, self.corners.shape)
        return np.minimum(self.corners, base), np.maximum(self.corners, base)


def whole(bounds: np.ndarray) -> Domain:
    """All pressures within bounds (C, 2): a box for every way from no pressure to a corner of them."""
    ends = [[end for end in (low, high) if end != min(max(0.0, low), high)] for low, high in bounds]
    return Domain(bounds, np.array(list(product(*ends))))


def _outermost(corners: np.ndarray, base: np.ndarray) -> np.ndarray:
    """The corners whose boxes are not within others."""
    kept: list[np.ndarray] = []
    for corner in sorted(corners, key=lambda each: -float(np.abs(each - base).sum())):
        low, high = np.minimum(corner, base), np.maximum(corner, base)
        if not any(np.all((low >= np.minimum(k, base)) & (high <= np.maximum(k, base))) for k in kept):
            kept.append(corner)
    return np.array(kept).reshape(-1, len(base))
