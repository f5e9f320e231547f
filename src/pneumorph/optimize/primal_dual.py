"""Quadratic programs of smooth steps, by a primal–dual method.

min slope·Ψ + ½‖W Ψ‖² + ½ pull ‖z‖² over Ψ = S z with z in a box and c + J Ψ ≤ 0.

Steps z and multipliers move in turn (Chambolle & Pock 2011), each time beyond where they would go by themselves (Condat
2013). An iteration costs a product with J, one with its transpose, and two with S. What makes it fast is that rows are
divided by their lengths: those of walls and of stretch differ by a factor of a hundred. In the first programs of steps
from runs, 100 iterations leave 0.2 to 1 % of the gain, and 6 to 14 % where nearly all of a bellows is at its limits.
Methods with a factorisation of M + JᵀDJ, such as interior points, would have to do with two or three of them: one takes
as long as 130 iterations with 7,000 variables, and as 230 with 28,000.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from pneumorph.interrupts import stop_if_asked
from pneumorph.optimize.products import SparseRows, push_on, step_on
from pneumorph.optimize.smoothing import Smoothing

SAFETY = 1.1
"""Safety factor on the largest eigenvalue from the power method, which is a lower bound."""


@dataclass(frozen=True)
class PrimalDualSettings:
    """How the method moves."""

    dense: float = 3.0
    """Length of rows of all variables, where that of others is 1: their multipliers have to turn the whole gradient."""

    beyond: float = 1.8
    """How far each iteration goes, as a multiple of where it would go by itself; below 2 it converges."""

    rounds: int = 8
    """Of the power method, for the length of steps."""


PRIMAL_DUAL = PrimalDualSettings()


class Pair(NamedTuple):
    """Raw variables z (n,), multipliers λ (m,) of the rows c + J Ψ ≤ 0, and W Ψ (k,)."""

    z: np.ndarray
    multiplier: np.ndarray
    bent: np.ndarray


@dataclass(frozen=True, eq=False)
class Program:
    """A quadratic program of a smooth step.

    Attributes
    ----------
    smooth : Smoothing
        S.
    slope : (n,) array
        Of the objective, of which the mean absolute value is about 1.
    factors : (k, n) array
        W.
    pull : float
    jacobian, known : csr (m, n) and (m,) array
        J and c.
    lower, upper : (n,) arrays
        The box of z.
    dense : int
        How many of the last rows are of all variables.
    """

    smooth: Smoothing
    slope: np.ndarray
    factors: np.ndarray
    pull: float
    jacobian: sparse.csr_array
    known: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    dense: int = 0


class Ending(NamedTuple):
    """When iterations end.

    Attributes
    ----------
    iterations : int
        Most of them.
    still : float
        They end where no variable moves farther than this in an iteration, mm,
    steady : float
        or by more than this part of the largest variable, and
    met : (m,) array, optional
        no row is exceeded by more than this; by default by what a motion by `still` along it changes.
    """

    iterations: int
    still: float = 0.0
    steady: float = 0.0
    met: np.ndarray | None = None


def improved(
    program: Program,
    begin: Pair,
    balance: float,
    ending: Ending,
    settings: PrimalDualSettings = PRIMAL_DUAL,
) -> Pair:
    """Go on towards the solution of a program.

    Parameters
    ----------
    program : Program
    begin : Pair
    balance : float
        Of the motions of multipliers and steps: how fast multipliers change with what is exceeded, in units of the
        slope for 1 mm by which a row of length 1 is exceeded.
    ending : Ending
    settings : PrimalDualSettings
    """
    smooth = program.smooth
    limits = len(program.known)
    whole = sparse.csr_array(sparse.vstack([program.jacobian, program.factors]), dtype=float)
    length = np.maximum(np.sqrt(np.asarray(whole.power(2).sum(axis=1)).ravel()), 1e-12)
    length[limits - program.dense : limits] /= settings.dense
    rows = SparseRows.of(sparse.csr_array(sparse.diags_array(1.0 / length) @ whole))
    known = np.concatenate([program.known, np.zeros(len(length) - limits)]) / length
    diagonal, norm = _scaled(smooth, rows, settings.rounds)
    rise, fall = balance / norm, diagonal / (balance * norm)
    small = np.full(len(length), rise * ending.still)
    if ending.met is not None:
        small[:limits], small[limits:] = rise * ending.met / length[:limits], np.finfo(float).max
    shrink, bend = 1.0 / (1.0 + fall * program.pull), 1.0 / (1.0 + rise / length[limits:] ** 2)
    slope = smooth.transpose(program.slope)
    z, ahead = begin.z.copy(), np.empty_like(begin.z)
    dual = np.concatenate([begin.multiplier, begin.bent]) * length
    # No limit has been looked at.
    farther = np.column_stack([np.zeros(len(length)), np.maximum(rows.moduli().times(np.ones(rows.width)), 1e-12)])
    point, moved = np.zeros_like(z), 0.0
    for _ in range(ending.iterations):
        stop_if_asked()
        downhill = slope + smooth.transpose(rows.transposed_times(dual))
        far, largest = step_on(z, downhill, fall, shrink, program.lower, program.upper, settings.beyond, ahead)
        point, before = smooth.apply(ahead), point
        moved += float(np.abs(point - before).max(initial=0.0))
        pushed = push_on(*rows[:3], known, point, limits, rise, bend, settings.beyond, small, dual, farther, moved)
        if far <= max(ending.still, ending.steady * largest) and not pushed:
            break
    return Pair(
        np.clip(z, program.lower, program.upper), dual[:limits] / length[:limits], dual[limits:] / length[limits:]
    )


def _scaled(smooth: Smoothing, rows: SparseRows, rounds: int) -> tuple[np.ndarray, float]:
    """A diagonal D (n,), and the largest singular value of J·S·D^½ by the power method, with `SAFETY`; J are rows."""
    sums = smooth.moduli.transpose(rows.moduli().transposed_times(np.ones(len(rows.start) - 1)))
    root = 1.0 / np.sqrt(np.maximum(sums, 1e-12))
    vector, largest = np.full(len(root), 1.0 / np.sqrt(max(len(root), 1))), 0.0
    for _ in range(rounds):
        image = root * smooth.transpose(rows.transposed_times(rows.times(smooth.apply(root * vector))))
        largest = float(np.linalg.norm(image))
        if largest == 0.0:
            return root**2, 1.0
        vector = image / largest
    return root**2, float(np.sqrt(SAFETY * largest))
