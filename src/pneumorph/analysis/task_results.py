"""The results of an analysed design, task by task."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.analysis.records import TaskResult, Vector
from pneumorph.mechanics import Model, rotation_vector
from pneumorph.objective import Features


def collect_task_results(disc: Discretisation, analysis: Analysis) -> dict[str, TaskResult]:
    """Collect the result of every task of an analysed design, by the task's name."""
    found = {}
    for name, equilibrium in analysis.equilibria.items():
        objective = disc.objectives[name]
        moved = objective.features(disc.model, analysis.configurations[name].X, equilibrium.state)
        translations, rotations = poses_of(disc.model, moved)
        found[name] = TaskResult(
            pressures=analysis.pressures[name],
            objective=analysis.values[name],
            errors={key: float(error(moved)) for key, error in objective.errors.items()},
            translation=vector(moved.translation),
            rotation=vector(moved.rotation),
            section_positions=tuple(map(vector, np.asarray(moved.section_position))),
            section_rotations=tuple(vector(rotation_vector(turn)) for turn in np.asarray(moved.section_rotation)),
            volumes=equilibrium.volumes,
            max_stretch=equilibrium.max_stretch,
            beyond_validity=disc.model.beyond_validity(equilibrium.stretches),
            stable=equilibrium.stable,
            region_stretches=by_region(equilibrium.stretches),
            contact={name: vector(on.force) for name, on in moved.contact.items()},
            contact_normal={name: float(on.normal) for name, on in moved.contact.items()},
            contact_area={name: float(on.area) for name, on in moved.contact.items()},
            pose_translations=translations,
            pose_rotations=rotations,
            self_intersecting=analysis.self_intersecting[name],
        )
    return found


def poses_of(model: Model, moved: Features) -> tuple[dict[str, Vector], dict[str, Vector]]:
    """Displacements and rotation vectors of free obstacles."""
    free = [] if model.contact is None else list(model.contact.free)
    poses = {name: np.asarray(moved.pose[name]) for name in free}
    return {name: vector(pose[:3]) for name, pose in poses.items()}, {
        name: vector(pose[3:]) for name, pose in poses.items()
    }


def by_region(stretches: Mapping[str, float]) -> Mapping[str, float]:
    """The largest stretch of every region of a body that has several."""
    return stretches if len(stretches) > 1 else {}


def vector(components) -> Vector:
    """Three components as Python floats."""
    return cast(Vector, tuple(map(float, np.asarray(components))))
