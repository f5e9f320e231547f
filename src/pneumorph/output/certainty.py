"""What a reached motion depends on: pressure, rubber, and what else the tip does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pneumorph.problem.components import MOTIONS
from pneumorph.problem.objectives.table import ObjectiveTable
from pneumorph.problem.objectives.words import motion_amount, motion_word
from pneumorph.results import MotionRates, TaskResult

STIFFER = 0.01
"""The relative change of the moduli of which the effect is told: small, since the derivative is that at this state."""

LEAST = {"mm": 0.05, "°": 0.1}
"""Motions of the tip below which they are not worth telling."""


def of_the_mesh(objective: ObjectiveTable, motion: Sequence[float], finer: Sequence[float]) -> Iterator[str]:
    """A sentence for each motion of a task, or one for the tip: how far it is from that on infinitely fine meshes.

    Parameters
    ----------
    objective : of the task.
    motion, finer : translation (mm) and rotation vector (rad) of the tip (6,), and the estimate on fine meshes.
    """
    for name, sign in objective.tip_motions.items():
        k, unit = MOTIONS.index(name), " mm" if name in MOTIONS[:3] else "°"
        size = sign * (1.0 if unit == " mm" else float(np.degrees(1.0)))
        here, there = size * motion[k], size * finer[k]
        off = f"{abs(there - here):.2g}{unit}"
        yield f"{motion_word(name, sign)} {here:.2f} ± {off} (mesh): about {there:.2f}{unit} on a fine mesh"
    if not objective.tip_motions:
        off = np.array(finer) - np.array(motion)
        place, turn = np.linalg.norm(off[:3]), np.degrees(np.linalg.norm(off[3:]))
        yield f"on a fine mesh the tip is about {place:.2g} mm and {turn:.2g}° from where it is here"


def certainty(objective: ObjectiveTable, result: TaskResult, rates: MotionRates) -> Iterator[str]:
    """Sentences on the motion of a task: how it changes with pressures and rubber, and the tip's other motions."""
    for name, sign in objective.tip_motions.items():
        k, unit = MOTIONS.index(name), " mm" if name in MOTIONS[:3] else "°"
        size = sign * (1.0 if unit == " mm" else float(np.degrees(1.0)))
        by = [f"{1e-3 * size * rate[k]:+.3g}{unit}/kPa of {chamber}" for chamber, rate in rates.by_pressure.items()]
        if rates.by_modulus is not None:
            changed = STIFFER * size * rates.by_modulus[k]
            by.append(f"{changed:+.3g}{unit} with {100 * STIFFER:.0f} % stiffer rubber at this state")
        if by:
            yield f"{motion_word(name, sign)} changes by {', '.join(by)}"
    if objective.tip_motions:
        others = [motion_amount(name, 1.0, result) for name in MOTIONS if name not in objective.tip_motions]
        large = [f"{other.word} of {other}" for other in others if abs(other.value) >= LEAST[other.unit]]
        if large:
            yield f"the tip also moves: {', '.join(large)}"
