"""From a problem file to a mechanical model and its loads."""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics.equilibrium import loads
from pneumorph.mechanics.material import rubber
from pneumorph.mechanics.model import Model, model
from pneumorph.mechanics.plate import COMPONENTS
from pneumorph.mechanics.potential import Loads
from pneumorph.mesh.tets import TetMesh
from pneumorph.problem import Problem


def model_of(problem: Problem, mesh: TetMesh) -> Model:
    """The mechanical model of a meshed body: its rubber, clamped base, and plate or free tip."""
    material = problem.material
    solid = rubber(material.shear_modulus, material.bulk_modulus, material.density)
    return model(mesh, solid, plate=problem.end_effector.kind == "plate")


def loads_of(problem: Problem, model: Model, pressures: dict[str, float]) -> Loads:
    """The loads of a problem at the given chamber pressures (MPa)."""
    effector, gravity = problem.end_effector, problem.gravity
    spring = effector.spring
    return loads(
        model,
        pressures,
        acceleration=None if gravity is None else gravity.acceleration * np.asarray(gravity.direction),
        spring=np.array([0.0, 0.0, spring.axial, spring.bending_x, spring.bending_y, spring.torsion]),
        wrench=np.array([*effector.force, *effector.moment]),
    )


def held_of(problem: Problem) -> np.ndarray:
    """The plate's components (6,) bool that a guide holds."""
    return np.isin(COMPONENTS, problem.end_effector.hold)
