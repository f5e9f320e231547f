"""What a reached motion depends on: pressure, rubber, and what else the tip does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from pneumorph.problem.components import MOTIONS, is_turn
from pneumorph.problem.objectives.table import ObjectiveTable
from pneumorph.problem.objectives.words import Result, motion_amount, motion_word
from pneumorph.results import FineResult, MotionRates, SweepStep, TaskResult

STIFFER = 0.01
"""The relative change of the moduli of which the effect is told: small, since the derivative is that at this state."""

SMALL = 0.1
"""Errors of the mesh up to this part of a value are so small that its estimate is worth adding."""
NEARER = "which is most likely nearer to the truth"
ROUGH = "which is rough, since the error is so large: make mesh.size smaller"

LEAST = {"mm": 0.05, "°": 0.1, "N": 1e-3, "N·mm": 1e-2}
"""Motions of the tip and reactions below which they are not worth telling."""


def of_the_mesh(objective: ObjectiveTable, here: Result, fine: Result) -> Iterator[str]:
    """Sentences on how far what a task is about is from that on infinitely fine meshes.

    Parameters
    ----------
    objective : of the task.
    here, fine : its result, and the estimate on fine meshes.
    """
    motions = objective.tip_motions.items()
    about = [tuple(motion_amount(name, sign, each) for each in (here, fine)) for name, sign in motions]
    for one, other in about or [(objective.achieved(here), objective.achieved(fine))]:
        # A pressure is what it is on every mesh.
        if not about and one.value == other.value:
            continue
        small = abs(other.value - one.value) <= SMALL * abs(one.value)
        yield (
            f"{one.word} {one._replace(target=None).with_error(other)}: about {other} on a fine mesh, "
            f"{NEARER if small else ROUGH}"
        )
    if not about:
        place, turn = (
            float(np.linalg.norm(np.subtract(*pair)))
            for pair in ((fine.translation, here.translation), (fine.rotation, here.rotation))
        )
        yield f"on a fine mesh the tip would be about {place:.2g} mm and {np.degrees(turn):.2g}° away from here"


def of_the_asked(asked: float, share: float | None) -> str:
    """Whether the error of the mesh is as small as was asked for; both are relative."""
    told = f"the {100 * asked:.3g} % that mesh.error asks for"
    if share is None:
        return f"whether the error of the mesh is below {told} is not known"
    if share <= asked:
        return f"the error of the mesh is {100 * share:.2g} %, within {told}"
    return (
        f"the error of the mesh is {100 * share:.2g} %, more than {told}; make more designs "
        "with --resume, or ask for a smaller error"
    )


def of_sums(here: FineResult | TaskResult, fine: FineResult) -> Iterator[str]:
    """The same of the volumes of chambers, and of the forces on obstacles."""
    sums = {f"volume of {name}": (here.volumes[name], value, "mm³") for name, value in fine.volumes.items()}
    for name, value in fine.contact_normal.items():
        sums[f"normal force on {name}"] = here.contact_normal[name], value, "N"
    for word, (one, other, unit) in sums.items():
        yield f"{word} {one:.4g} ± {abs(other - one):.2g} {unit} (mesh)"


def of_step(step: SweepStep) -> str:
    """What mesh and rubber make uncertain in a step, of its motions and reactions; empty where neither is known."""
    fine, rubber = (
        None if place is None or turn is None else Moved(place, turn)
        for place, turn in (
            (step.fine_translation, step.fine_rotation),
            (step.rubber_translation, step.rubber_rotation),
        )
    )
    if fine is None and rubber is None:
        return ""
    said = []
    for name in MOTIONS:
        own = motion_amount(name, 1.0, step)
        if abs(own.value) >= LEAST[own.unit]:
            told = str(own) if fine is None else own.with_error(motion_amount(name, 1.0, fine))
            off = None if rubber is None else motion_amount(name, 1.0, rubber)
            said.append(f"{own.word} {told}{_by_rubber(off and abs(off.value), own.unit)}")
    for name, value in step.reaction.items():
        unit = "N·mm" if is_turn(name) else "N"
        if abs(value) >= LEAST[unit]:
            mesh = f" ± {abs(step.fine_reaction[name] - value):.2g} {unit} (mesh)" if fine else f" {unit}"
            said.append(f"{name} {value:.4g}{mesh}{_by_rubber(step.rubber_reaction.get(name), unit)}")
    return ", ".join(said)


def _by_rubber(off: float | None, unit: str) -> str:
    """One standard deviation by the rubber, to follow a value; empty where it is not known."""
    return "" if off is None else f" ± {off:.2g}{'' if unit == '°' else ' '}{unit} (rubber)"


class Moved(NamedTuple):
    """A state of the tip: mm and rad."""

    translation: Sequence[float]
    rotation: Sequence[float]


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


def of_rubber(objective: ObjectiveTable, rates: MotionRates, deviation: float | None) -> Iterator[str]:
    """Sentences on how far the motion of a task scatters with the rubber alone, to first order.

    Parameters
    ----------
    objective, rates : of the task.
    deviation : relative standard deviation of the moduli; None where nothing is known of it.
    """
    if deviation is None or rates.by_modulus is None:
        return
    for name, sign in objective.tip_motions.items():
        k, unit, size = MOTIONS.index(name), " mm", 1.0
        if is_turn(name):
            unit, size = "°", float(np.degrees(1.0))
        off = deviation * size * abs(rates.by_modulus[k])
        yield (
            f"{motion_word(name, sign)} ± {off:.2g}{unit} by the rubber alone, whose moduli are known to "
            f"± {100 * deviation:.2g} % (one standard deviation, to first order)"
        )
