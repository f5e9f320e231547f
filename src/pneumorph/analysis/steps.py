"""The record of a step of a sweep, from an equilibrium or from the reason why there is none."""

from __future__ import annotations

import numpy as np

from pneumorph.analysis.collect import by_region, poses_of, vector
from pneumorph.mechanics import (
    COMPONENTS,
    Configuration,
    Equilibrium,
    NoEquilibrium,
    Skin,
    Whole,
    contact_forces,
    settled,
)
from pneumorph.mechanics.assembly.enclosed import amounts
from pneumorph.objective import measure_features
from pneumorph.results.sweeps import SweepStep


def step_of(
    task: str,
    pressures: dict[str, float],
    at: Configuration,
    answer: Equilibrium | NoEquilibrium,
    skin: Skin,
    whole: Whole | None = None,
) -> SweepStep:
    """The record of an equilibrium, or of none.

    Parameters
    ----------
    task : name of the task.
    pressures : {chamber: MPa}
    at : what was solved.
    answer : the equilibrium, or why there is none.
    skin : the surface of the whole body.
    whole : the whole body, where part of it was solved and motions without its symmetry are to be looked at too.
    """
    filled = {} if at.enclosed is None else at.enclosed.liquids
    if isinstance(answer, NoEquilibrium):
        return SweepStep(
            task,
            pressures,
            filled=filled,
            converged=False,
            reason=answer.reason,
            buckled=answer.buckled,
            limit=answer.limit,
            holds=_holds(at),
        )
    motion = measure_features(at.model, at.X, answer.state, shift=np.asarray(at.loads.shift))
    touched = contact_forces(settled(at, answer), answer.state)
    translations, rotations = poses_of(at.model, motion)
    return SweepStep(
        task=task,
        pressures={**pressures, **answer.enclosed},
        translation=vector(motion.translation),
        rotation=vector(motion.rotation),
        reaction=reaction_of(at, answer.reaction, answer.plate),
        volumes=answer.volumes,
        max_stretch=answer.max_stretch,
        beyond_validity=at.model.beyond_validity(answer.stretches),
        stable=answer.stable and (whole is None or whole.negative_pivots(at, answer.state) == 0),
        region_stretches=by_region(answer.stretches),
        contact={name: vector(force) for name, force in touched.on.items()},
        contact_normal=touched.normal,
        contact_area=touched.area,
        pull=touched.pull,
        self_contact=touched.own,
        pose_translations=translations,
        pose_rotations=rotations,
        self_intersecting=skin.intersects_itself(at.X + answer.u),
        buckled=answer.buckled,
        holds=_holds(at),
        gas=amounts(at.model, at.X, at.enclosed),
        filled=filled,
    )


def _holds(at: Configuration) -> dict[str, float]:
    """Where motions of the plate are held, if not where they are at rest."""
    held = np.where(at.blocked, at.loads.held, 0.0)
    return {name: float(value) for name, value in zip(COMPONENTS, held, strict=True) if value}


def reaction_of(at: Configuration, on_blocks: np.ndarray, plate: np.ndarray) -> dict[str, float]:
    """Force (N) or torque (N·mm) that the actuator exerts on the blocks and springs at its plate, by component."""
    spring = at.model.copies * np.asarray(at.loads.spring)
    exerted = on_blocks + spring * plate
    return {
        name: float(exerted[index]) for index, name in enumerate(COMPONENTS) if at.blocked[index] or spring[index] > 0.0
    }
