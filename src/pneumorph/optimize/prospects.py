"""Whether designs can bring states within their limits that the start violates, judged by its derivatives."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pneumorph.analysis import Analysis, Discretisation
from pneumorph.errors import Hopeless
from pneumorph.limits.kinds.states import MARGIN, STIFFNESSES, STRAIN
from pneumorph.limits.limit import Limit
from pneumorph.mechanics import rubbers_of
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.states import StateLimits, limited
from pneumorph.problem import Problem, Task
from pneumorph.problem.components import MOTIONS, is_turn
from pneumorph.results import TaskResult

SEEN = {"mm": 0.01, "rad": 2e-4}
"""Motions of a start that are more than what is left of its symmetry by a mesh."""


@dataclass(frozen=True)
class Shortfall:
    """A limit on states that the start violates.

    Attributes
    ----------
    limit : Limit
    bound, value : float
        In its unit; the value is that of the worst task.
    task : str
        Which one that is.
    motion : float
        By how much the surfaces have to move for it, mm: an estimate that is rather too small.
    """

    limit: Limit
    bound: float
    value: float
    task: str
    motion: float

    def __str__(self) -> str:
        value = f"{self.limit.told * self.value:.3g}{self.limit.suffix}"
        return (
            f"limits.{self.limit.name}: is {value} at the start, in task {self.task}, and must be "
            f"{self.limit.asked(self.bound)}"
        )


def shortfalls(setup: Setup, disc: Discretisation, analysis: Analysis, states: StateLimits) -> tuple[Shortfall, ...]:
    """The limits that the states of a start violate, and what they ask of its surfaces.

    Parameters
    ----------
    setup : of the run.
    disc, analysis : the mesh of the start, and its states.
    states : its limits, linearised by the variables of the setup.

    Raises
    ------
    Hopeless
        If surfaces would have to move by more than the body's own half width: that is another body.
    """
    found = []
    for limit, of, kind in limited(setup.problem):
        values = kind.values(disc, analysis, of)
        if not values:
            continue
        task, value = max(values.items(), key=lambda each: limit.excess(each[1], of.bound))
        own = [row for row, each in enumerate(states.limits) if each == limit]
        if limit.satisfied(value, of.bound) or not own:
            continue
        row = max(own, key=lambda each: states.value[each])
        motion = _motion(setup, analysis.phi, limit, float(states.value[row]), states.jacobian[row], of.bound)
        found.append(Shortfall(limit, of.bound, value, task, motion))
    width = _half_width(setup)
    for each in found:
        if each.motion > width:
            by = f"by about {each.motion:.2g} mm" if math.isfinite(each.motion) else "without end"
            raise Hopeless(
                f"{each}; its walls would have to move {by} for that, and the body is {2 * width:.3g} mm wide: "
                f"{_remedy(setup.problem, each)}"
            )
    return tuple(found)


def words(setup: Setup, found: Shortfall) -> str:
    """What a run says of a limit that its first designs are to satisfy."""
    designs = math.ceil(found.motion / (setup.settings.radius.largest * setup.reference))
    few = "1 design" if designs <= 1 else f"{designs} designs"
    far = f"by its derivatives surfaces move by about {found.motion:.2g} mm for it, in about {few}"
    return f"{found}; that comes first: {far}"


def _motion(setup: Setup, phi: np.ndarray, limit: Limit, c: float, slope: np.ndarray, bound: float) -> float:
    """How far all surfaces have to move, each where it helps most, in mm, for c to be 0, in parts of the bound.

    Pressures and data of sheets and fibres first change as far as they may. What is left is taken to fall as fast as it
    begins, and strain ever more slowly, as it is above that at rest.

    Parameters
    ----------
    setup : of the run.
    phi : (n,) the variables.
    limit : which is violated.
    c : what is to become 0.
    slope : (n,) its derivatives.
    bound : of the limit.
    """
    space = setup.space
    rest = slice(space.n_shape, space.n)
    room = np.where(slope > 0.0, phi - space.lower, space.upper - phi)[rest]
    left = c - float(np.abs(slope[rest]) @ np.maximum(room, 0.0))
    if left <= 0.0:
        return 0.0
    rate = float(np.abs(setup.smooth.transpose(np.where(np.arange(space.n) < space.n_shape, slope, 0.0))).sum())
    if rate == 0.0:
        return math.inf
    if limit is not STRAIN:
        return left / rate
    least = _strain_at_rest(setup.problem) / bound - 1.0
    return math.inf if least >= 0.0 else (left - least) / rate * math.log((left - least) / -least)


def _strain_at_rest(problem: Problem) -> float:
    """The stretch of 1 over the smallest range of a rubber."""
    ranges = (rubber.valid_stretch for rubber in rubbers_of(problem).values())
    return max((1.0 / each for each in ranges if each), default=0.0)


def _half_width(setup: Setup) -> float:
    """Half of the body's lesser extent across its axis, mm."""
    points = setup.space.reference.control_points()
    return 0.5 * float(np.ptp(points[:, :2], axis=0).min())


def _remedy(problem: Problem, found: Shortfall) -> str:
    index, task = next((i, each) for i, each in enumerate(problem.task) if each.name == found.task)
    kept = "lower it" if found.limit.at_least else "raise it"
    stiff = found.limit in STIFFNESSES.values()
    acting = [name for name, pressure in task.pressure.items() if pressure.start and not stiff]
    # A motion is to be larger, what else is at least so large is to be farther from ballooning.
    change = "raise" if found.limit.name.startswith("at_least") else "lower"
    milder = f", {change} task[{index}].pressure.{acting[0]}" if acting else ""
    stronger = (
        "begin with thicker walls or a stiffer rubber"
        if stiff or found.limit in (STRAIN, MARGIN)
        else "change the body"
    )
    return f"{kept}{milder}, or {stronger}"


def backwards(problem: Problem, task: Task, start: TaskResult) -> Iterator[str]:
    """A sentence for each motion of the start that goes the other way than its task asks."""
    done: dict[str, float] = dict(zip(MOTIONS, (*start.translation, *start.rotation), strict=True))
    for motion, asked in task.objective.asked_motions.items():
        if done[motion] * asked.value < 0.0 and abs(done[motion]) > SEEN["rad" if is_turn(motion) else "mm"]:
            helix = motion == "twist" and problem.solid is None and problem.tubes.ripple is not None
            other = "body.ripple.lobes with the other sign" if helix else "another body to start from"
            yield f"{motion} goes the other way at first, and designs have to turn it round; try {other}"
