"""Rings of vertices along a surface, from its base to its tip, and the strips of triangles between them.

All in the parameters (q, r): where lines are dense enough for the edge length and the curvature, and where lines and
rings have to be because a region begins or ends there, or a plane cuts the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pneumorph.errors import MeshError
from pneumorph.geometry.tube.lining import Lining
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.mesh.tube.interfaces import steps_through

_SAMPLES_PER_SPAN = 4  # points per knot span at which lengths and turns are measured
_GRADATION = 0.4  # mm by which edge lengths may grow per mm along the surface
SAME = 1e-9  # parameters nearer than this are one
_HOT_SPOT_POWER = 4  # exponent of the mean over the other direction: high, but no single hot spot decides for a line


@dataclass(frozen=True)
class Ring:
    """A closed row of vertices: on the tube at r, or on a disc at the fraction s of the distance from centre to rim.

    Where a layer ends in the disc, rings are at the given fractions of its depth, and the disc is within its copy.
    """

    q: np.ndarray
    r: float
    s: float = 1.0
    depth: float = 0.0


@dataclass(frozen=True)
class Around:
    """The lines along which rings of vertices are joined: q starts at the `seam`.

    Of 2 or 4 `parts` that are mirror images, each begins and ends with lines in mirror planes. Other lines are those at
    the `edges` of wedges. Of a number of `turns`, each is the image of the one before.
    """

    seam: float
    parts: int
    edges: list[float]
    turns: int

    @property
    def alike(self) -> int:
        """Into how many parts rings are divided that have as many vertices: four, or one for every turn."""
        return 4 if self.turns == 1 else self.turns

    def through(self, q: np.ndarray, places: Sequence[float]) -> np.ndarray:
        """A ring of parameters, moved so that one is at each of the places."""
        at = self.seam + (np.array(places) - self.seam) % 1.0
        at = at[(at > self.seam + SAME) & (at < self.seam + 1.0 - SAME)]
        if self.parts == 1:
            return _through(np.append(q, self.seam + 1.0), at)[:-1]
        half, moved = len(q) // 2, q.copy()
        if len(at):
            # Symmetric about one plane: no part of a tube is so about two.
            moved[: half + 1] = _through(q[: half + 1], at[at < self.seam + 0.5])
            moved[half + 1 :] = 2 * self.seam + 1 - moved[1:half][::-1]
        return moved

    def thinned(self, q: np.ndarray, count: int) -> np.ndarray:
        """``count`` parameters distributed like those of a ring."""
        fewer = np.interp(np.arange(count) / count, np.arange(len(q) + 1) / len(q), np.append(q, q[0] + 1.0))
        return self.through(fewer, self.edges) if count > 1 else fewer

    def joints(self, q: np.ndarray) -> np.ndarray:
        """The numbers along a ring of the vertices at all lines, or where like parts begin; first 0, last len(q)."""
        if not self.edges or len(q) == 1:
            return np.arange(self.alike + 1) * len(q) // self.alike
        at = [len(q) // 2] if self.parts == 2 else []
        for place in self.edges:
            near = np.abs((q - place + 0.5) % 1.0 - 0.5)
            at.append(int(near.argmin()))
        return np.unique([0, *at, len(q)])


def tube_rings(
    surface: TubeSurface,
    size: float,
    turn: float,
    around: Around,
    linings: Sequence[Lining],
    crossed: Sequence[float],
) -> list[Ring]:
    """Rings of the tube; towards a pole they have fewer vertices, as their circumference shrinks.

    Parameters
    ----------
    surface : TubeSurface
    size : float
        Edge length, mm.
    turn : float
        Largest angle by which the surface turns along an edge, rad.
    around : Around
        The lines along which rings are joined.
    linings : sequence of Lining
        Layers; where one begins or ends there is a ring.
    crossed : sequence of float
        Other values of r at which there is a ring.
    """
    seam, parts, turns, alike = around.seam, around.parts, around.turns, around.alike
    q = _lines(surface, "q", size, turn, seam, alike)
    if turns > 1:
        # The same in every turn, to the last digit.
        first = np.mean(q.reshape(turns, -1) - np.arange(turns)[:, None] / turns, axis=0)
        first += seam - first[0]
        q = np.concatenate([first + number / turns for number in range(turns)])
    if parts > 1:
        # Symmetric about the plane, to the last digit.
        q[1:] = (q[1:] + (2 * seam + 1) - q[:0:-1]) / 2
    if parts == 4:
        # Reflections in two planes are together a half turn.
        first, second = np.split(q, 2)
        first = (first + second - 0.5) / 2
        q = np.concatenate([first, first + 0.5])
    r = _lines(surface, "r", size, turn)
    q = around.through(q, [*around.edges, *(end for lining in linings for end in lining.q or ())])
    r = _through(r, np.array([end for lining in linings for end in lining.r if 0.0 < end < 1.0] + list(crossed)))
    count = np.full(len(r), len(q))
    at_base, at_tip = surface.poles
    if at_base or at_tip:
        closed = surface.sample(np.linspace(0, 1, 4 * len(q) + 1), r)
        girth = np.linalg.norm(np.diff(closed, axis=1), axis=2).sum(axis=1)
        wanted = np.maximum(_least(alike), alike * np.round(girth / (alike * size)).astype(int))
        inwards = [range(1, len(r) - 1)] if at_base else []
        inwards += [range(len(r) - 2, 0, -1)] if at_tip else []
        for rows in inwards:
            for j in rows:
                if wanted[j] >= len(q):
                    break
                count[j] = wanted[j]
        count[0], count[-1] = (1 if pole else len(q) for pole in surface.poles)
    return [Ring(around.thinned(q, n), float(rj)) for n, rj in zip(count, r, strict=True)]


def _through(lines: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Parameters of lines, moved so that one is at each of the places, while the first and the last stay."""
    places = np.unique(places)
    nearest = 1 + np.abs(lines[1:-1] - places[:, None]).argmin(axis=1)
    if not len(places):
        return lines
    if (np.diff(nearest) < 1).any():
        raise MeshError("edges of regions are nearer to each other than the elements are long")
    return np.interp(np.arange(len(lines)), [0, *nearest, len(lines) - 1], [lines[0], *places, lines[-1]])


def disc_rings(
    surface: TubeSurface, rim: Ring, size: float, around: Around, lining: Lining | None = None
) -> list[Ring]:
    """Rings of an end disc, from the one next to the rim to the centre; a layer that ends in it has its own.

    Parameters
    ----------
    surface : TubeSurface
        With a flat end there.
    rim : Ring
        That of the tube at this end.
    size : float
        Edge length, mm.
    around : Around
        The lines along which rings are joined.
    lining : Lining, optional
        The layer that ends in the disc.
    """
    if lining is not None:
        steps = steps_through(lining, size)
        through = [replace(rim, depth=k / steps) for k in range(1, steps + 1)]
        within = replace(surface, net=surface.net + lining.offset)
        return [*through, *(replace(ring, depth=1.0) for ring in disc_rings(within, rim, size, around))]
    points = surface.points(np.append(rim.q, rim.q[0]), np.full(len(rim.q) + 1, rim.r))
    girth = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    steps = max(1, round(girth / (2 * np.pi * size)))
    rings, count, alike = [], len(rim.q), around.alike
    for k in range(steps - 1, 0, -1):
        wanted = alike * round(girth * k / steps / (alike * size))
        count = min(count, max(_least(alike), wanted, alike * round(count / (2 * alike))))
        rings.append(Ring(around.thinned(rim.q, count), rim.r, k / steps))
    return [*rings, Ring(np.zeros(1), rim.r, 0.0)]


def _least(alike: int) -> int:
    """The smallest number of vertices of a ring: eight, or the next multiple of its parts."""
    return -(-8 // alike) * alike


def _lines(
    surface: TubeSurface, direction: str, size: float, turn: float, start: float = 0.0, alike: int = 2
) -> np.ndarray:
    """Parameters of the grid lines at equal increments of max(arc length / size, turning angle / turn).

    In q they begin at `start` and exclude the end of the period; in r they include both ends. The number of steps is a
    multiple of `alike`.
    """
    along_q = direction == "q"
    q, r = (np.linspace(0, 1, _SAMPLES_PER_SPAN * basis.spans + 1) for basis in (surface.basis_q, surface.basis_r))
    q = start + q
    first = surface.sample(q, r, dq=1) if along_q else surface.sample(q, r, dr=1)
    second = surface.sample(q, r, dq=2) if along_q else surface.sample(q, r, dr=2)
    speed = np.linalg.norm(first, axis=-1)
    tiny = 1e-9 * speed.max()
    turning = np.linalg.norm(np.cross(first, second), axis=-1) / (speed**2 + tiny**2)
    axis, t = (0, q) if along_q else (1, r)
    density = np.mean(np.maximum(speed / size, turning / turn) ** _HOT_SPOT_POWER, axis=axis) ** (1 / _HOT_SPOT_POWER)
    speed = np.mean(speed**_HOT_SPOT_POWER, axis=axis) ** (1 / _HOT_SPOT_POWER) + tiny

    way = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(t))])
    apart = np.abs(way[:, None] - way)
    if along_q:
        apart = np.minimum(apart, way[-1] - apart)
    step = np.min(speed / density + _GRADATION * apart, axis=1)
    density = speed / step
    steps = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(t))])
    count = max(_least(alike) if along_q else 4, alike * round(steps[-1] / alike))
    lines = np.interp(np.linspace(0, steps[-1], count + 1), steps, t)
    return lines[:-1] if along_q else lines


def strip(below: np.ndarray, above: np.ndarray, parity: int) -> np.ndarray:
    """Triangles between two rings, (n, 3, 2): corners as (0 on the lower or 1 on the upper ring, index in the ring).

    `below` and `above` are the numbers of vertices between which the rings are joined, first 0, last those of all.
    """
    lower, upper = int(below[-1]), int(above[-1])
    if upper == 1:
        return np.array([[(0, i), (0, i + 1), (1, 0)] for i in range(lower)])
    if lower == 1:
        return np.array([[(0, 0), (1, i + 1), (1, i)] for i in range(upper)])
    if lower == upper:
        # Alternating diagonals keep the mirror symmetries of the grid.
        rising = [[[(0, 0), (0, 1), (1, 1)], [(0, 0), (1, 1), (1, 0)]]]
        falling = [[[(0, 0), (0, 1), (1, 0)], [(0, 1), (1, 1), (1, 0)]]]
        cells = np.concatenate([rising if (i + parity) % 2 == 0 else falling for i in range(lower)])
        cells[..., 1] += np.arange(lower)[:, None, None]
        return cells.reshape(-1, 3, 2)
    sections = [
        _section(b - a, d - c, mirrored=bool(k % 2))
        for k, ((a, b), (c, d)) in enumerate(zip(pairwise(below.tolist()), pairwise(above.tolist()), strict=True))
    ]
    for k, section in enumerate(sections):
        section[..., 1] += np.where(section[..., 0] == 0, below[k], above[k])
    return np.concatenate(sections)


def _section(lower: int, upper: int, mirrored: bool) -> np.ndarray:
    """A part of a strip between rings of different counts; adjacent ones are mirror images."""
    i = j = 0
    triangles = []
    while i < lower or j < upper:
        # Advance on the ring that is behind; in a tie on the one with more vertices, so that base and tip are alike.
        behind = (2 * i + 1) * upper - (2 * j + 1) * lower - (lower > upper)
        if j == upper or (i < lower and behind < 0):
            triangles.append([(0, i), (0, i + 1), (1, j)])
            i += 1
        else:
            triangles.append([(0, i), (1, j + 1), (1, j)])
            j += 1
    section = np.array(triangles)
    if mirrored:
        section[..., 1] = np.where(section[..., 0] == 0, lower, upper) - section[..., 1]
        section = section[:, ::-1]
    return section
