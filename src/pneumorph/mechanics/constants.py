"""The constants of materials as parameters of their rubbers' energies, and models with others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pneumorph.mechanics.assembly.build import with_groups
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements.solid import Solid
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mechanics.setup import rubber_of
from pneumorph.problem.constants import constants, with_constants
from pneumorph.problem.material import Material

STEP = 1e-4
"""Relative change of a constant whose central difference is taken. Parameters are proportional to constants, for which
that is exact but for rounding; the energy of earlier pulls is not, whose difference has an error of 1e-8."""


def parameters_by_constants(material: Material) -> dict[str, np.ndarray]:
    """What the parameters (m,) of `rubber_of(material)` change by per relative change of each constant.

    Parameters
    ----------
    material : of which elastic rubber is meant, in its state.
    """
    slopes = {}
    for name, value in constants(material).items():
        ways = (with_constants(material, {name: (1.0 + way) * value}) for way in (STEP, -STEP))
        ahead, behind = (np.array(rubber_of(each).parameters) for each in ways)
        slopes[name] = (ahead - behind) / (2.0 * STEP)
    return slopes


def with_rubbers(model: Model, rubbers: Mapping[str, Rubber]) -> Model:
    """The model with other constants of its rubbers; a `Tangent` of the model serves it too.

    Parameters
    ----------
    model : of rubbers whose states have no memory.
    rubbers : by region, those of the same energies that take the place of its own.
    """
    changed = {name: rubbers.get(name, own) for name, own in model.rubbers.items()}
    groups, left = [], iter(changed.values())
    for group in model.potential.groups:
        energies = (
            replace(energy, parameters=np.array(next(left).parameters)) if isinstance(energy, Solid) else energy
            for energy in group.energies
        )
        groups.append(group._replace(energies=tuple(energies)))
    return replace(with_groups(model, groups), rubbers=changed)
