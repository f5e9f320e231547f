"""Exact states of a body at any pressures and loads, with their derivatives: what fast models are fitted to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from pneumorph.analysis import Explorer
from pneumorph.analysis.stiffness import turns_by_vector
from pneumorph.mechanics import Configuration, NoEquilibrium, State
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mesh import TetMesh, unfold
from pneumorph.objective.features import NO_SLABS, equidistant
from pneumorph.results import nodal_stretch
from pneumorph.results.fields import skin_of
from pneumorph.sensitivity import measured_of, response
from pneumorph.surrogate.inputs import acting_at, changed, usual_of

Bounds = Mapping[str, tuple[float, float]]
NO_LOADS: Bounds = MappingProxyType({})

FINEST = 16
"""Where a state is missing, the last stable one on the way there is found to this part of the way."""

STEP = 1e-3
"""mm, by which nodes are moved at most for the derivatives of stretches."""


@dataclass(frozen=True, eq=False)
class Sample:
    """A stable state.

    Attributes
    ----------
    pressures : (C,) MPa, and then the loads that vary, N and parts of gravity; C counts both.
    values : (k,)
        The tip's translation (mm) and rotation vector (rad), volumes (mm³), positions (mm) and rotation vectors (rad)
        of sections.
    slopes : (k, C) derivatives by the pressures, per MPa, and by the loads.
    compliance : (6, 6) in axes of space.
    look : (S, 4) or None
        Of the nodes on the surfaces, where they are asked for: displacements (mm), and by how much the largest stretch
        is above one.
    look_slopes : (C, S, 4) or None
        Their derivatives by the pressures, per MPa, and by the loads.
    """

    pressures: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    compliance: np.ndarray
    look: np.ndarray | None = None
    look_slopes: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Missing:
    """Pressures (C,) without a stable state, the reason, and the last sample on the way there."""

    pressures: np.ndarray
    reason: str
    last: Sample | None


class States:
    """Finds states one after another, each from the nearest that is known.

    Parameters
    ----------
    explorer : of the body.
    bounds : {chamber: (lower, upper)}, MPa.
    sections : int
        Number of sections along the body that are measured.
    looked : bool
        Whether samples have what the surfaces look like.
    loads : {name: (lower, upper)}
        Loads that vary too, of `inputs.FORCES` (N) and `inputs.GRAVITIES`.

    Attributes
    ----------
    names : chambers, and then loads.
    bounds : (C, 2) of all of them.
    at_once : how many states `all_searched` is to be asked for.
    solved, factorisations, dofs : what it took so far, and the size of the body's mesh.
    """

    at_once = 1

    def __init__(
        self, explorer: Explorer, bounds: Bounds, sections: int = 0, looked: bool = False, loads: Bounds = NO_LOADS
    ) -> None:
        self.names, self._loads = (*bounds, *loads), tuple(loads)
        self.bounds = np.array([*bounds.values(), *loads.values()], float).reshape(-1, 2)
        self._sections, self._looked, self._chambers = sections, looked, tuple(bounds)
        # Unlike pressures, so that all are solved on the same mesh whatever they are.
        odd = 0.5 + 0.4 * (np.arange(len(bounds)) + 1) / (len(bounds) + 1)
        low, high = self.bounds[: len(bounds)].T
        self._like = self._named(low + odd * (high - low))
        if loads:
            unlike = dict(zip(loads, self.bounds[len(bounds) :, 1] * np.linspace(0.5, 0.9, len(loads)), strict=True))
            explorer = explorer.with_loads_like(acting_at(explorer.under, unlike))
        self._explorer = explorer
        self._measured = None
        self.solved = self.factorisations = self.dofs = 0

    def at(self, pressures: np.ndarray, near: bool = False) -> Sample | str:
        """The state at pressures and loads (C,), or why there is none that is stable; see `Explorer.solved`."""
        count = len(self._chambers)
        given, under = self._named(pressures[:count]), None
        if self._loads:
            values = dict(zip(self._loads, np.asarray(pressures, float)[count:].tolist(), strict=True))
            under = acting_at(self._explorer.under, values)
        at, answer, tangent = self._explorer.solved(given, self._like, near, under)
        self.solved, self.dofs = self.solved + 1, at.model.size
        if isinstance(answer, NoEquilibrium):
            return "no state was found from those beside it" if near else answer.reason
        self.factorisations += answer.factorisations
        if self._explorer.skin(self._like).intersects_itself(at.X + answer.u):
            return "the body intersects itself"
        whole, state = self._explorer.whole(self._like), answer.state
        unstable = not answer.stable
        if whole is not None:
            unstable = unstable or whole.negative_pivots(at, state) > 0
            at, tangent, state = whole.configuration(at), whole.tangent, whole.state(state)
        if unstable:
            return "the state is not stable: the body would buckle"
        if self._measured is None:
            length = float(at.X[:, 2].max())
            slabs = equidistant(self._sections, length) if self._sections else NO_SLABS
            self._measured = measured_of(slabs, np.asarray(at.loads.shift))
        gravity = self._explorer.under.gravity
        acceleration = 0.0 if gravity is None else gravity.acceleration
        changes = [changed(at.loads, name, acceleration) for name in self._loads]
        found = response(at, tangent, state, self._measured, changes)
        spatial = np.eye(6)
        spatial[3:, 3:] = turns_by_vector(found.values[3:6])
        # In the order of our chambers; those without bounds have no pressure.
        columns = [at.model.chambers.index(name) for name in self._chambers]
        order = np.arange(len(found.values))
        keep = np.concatenate([order[:6], 6 + np.array(columns, int), order[6 + len(at.model.chambers) :]])
        compliance = spatial @ found.compliance @ spatial.T
        slopes = np.hstack([found.by_pressure[:, columns], found.by_change])[keep]
        inputs = [*columns, *range(len(at.model.chambers), len(found.moved))]
        look = self._look(at, state, found.moved[inputs]) if self._looked else (None, None)
        return Sample(pressures, found.values[keep], slopes, compliance, *look)

    @cached_property
    def mesh(self) -> TetMesh:
        """The mesh of the whole body."""
        return unfold(self._explorer.mesh(self._like)).mesh

    def _look(self, at: Configuration, state: State, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the surfaces look like, and its derivatives, from those (C, n) of the unknowns by the inputs."""
        mesh, skin = self.mesh, skin_of(self.mesh)
        placed = Displacement(at.model.tip, at.X, state)

        look = np.hstack([placed.u, nodal_stretch(mesh, placed.u)[:, None] - 1.0])[skin]
        slopes = []
        for change in moved:
            along = placed.along(at.model.state(change))
            by = STEP / max(float(np.abs(along).max()), 1e-300)
            further, before = (nodal_stretch(mesh, placed.u + sign * by * along) for sign in (1.0, -1.0))
            slopes.append(np.hstack([along, (further - before)[:, None] / (2.0 * by)])[skin])
        return look.astype(np.float32), np.array(slopes, np.float32)

    @property
    def usual(self) -> list[float]:
        """The values of the loads in the task."""
        return usual_of(self._explorer.under, self._loads)

    def all_searched(self, points: Sequence[np.ndarray], base: np.ndarray) -> list[Sample | Missing]:
        """What `searched` gives at each of these points."""
        return [self.searched(point, base) for point in points]

    def searched(self, pressures: np.ndarray, base: np.ndarray) -> Sample | Missing:
        """The same, and where there is no state, the last one on the way from `base` (C,) there."""
        found = self.at(pressures)
        if isinstance(found, Sample):
            return found
        reason, last, low, high = found, None, 0.0, 1.0
        while high - low > 1.0 / FINEST:
            middle = (low + high) / 2
            there = self.at(base + middle * (pressures - base), near=True)
            if isinstance(there, Sample):
                low, last = middle, there
            else:
                high, reason = middle, there
        return Missing(base + high * (pressures - base), reason, last)

    def _named(self, pressures: np.ndarray) -> dict[str, float]:
        return dict(zip(self._chambers, np.asarray(pressures, float).tolist(), strict=True))


def nearest_first(points: np.ndarray, known: np.ndarray, size: np.ndarray) -> list[np.ndarray]:
    """Points (n, C) in an order in which each is near to one before it or to one that is known (m, C)."""
    left, path = list(points), list(known)
    ordered = []
    while left:
        away = [min(float(np.linalg.norm((p - k) / size)) for k in path) for p in left] if path else [0.0] * len(left)
        ordered.append(left.pop(int(np.argmin(away))))
        path.append(ordered[-1])
    return ordered
