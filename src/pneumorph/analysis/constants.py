"""The constants of a problem's rubbers: what they do to a body to first order, and bodies of rubbers with others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics import Configuration, Model, State, parameters_by_constants, rubber_of, with_rubbers
from pneumorph.problem import Problem
from pneumorph.problem.constants import constants, named, with_constants
from pneumorph.problem.covariance import root_of
from pneumorph.problem.material import Material
from pneumorph.problem.materials import materials
from pneumorph.sensitivity import parameter_forces


@dataclass(frozen=True, eq=False)
class Constants:
    """The constants of a region's rubber.

    Attributes
    ----------
    names : sequence of c str
        As `problem.constants.named` has them.
    parameters : (c, m)
        What the parameters of the rubber's energy change by per relative change of each.
    errors : (r, c)
        Relative changes by one standard deviation of each independent error of the fit; r = 0 without a covariance.
    """

    names: tuple[str, ...]
    parameters: np.ndarray
    errors: np.ndarray


def rubbers_in(problem: Problem) -> dict[str, Material]:
    """The materials of a problem by the regions of its model: "" where there is only one."""
    known = materials(problem)
    return {name if len(known) > 1 else "": material for name, material in known.items()}


def constants_in(problem: Problem) -> dict[str, Constants]:
    """The constants of all rubbers of a problem, by region."""
    return {region: constants_of(region, material) for region, material in rubbers_in(problem).items()}


def fitted_in(problem: Problem) -> dict[str, Constants]:
    """The constants of the rubbers of which the fit's covariance is known."""
    return {region: each for region, each in constants_in(problem).items() if len(each.errors)}


def constants_of(region: str, material: Material) -> Constants:
    """The constants of a material."""
    slopes = parameters_by_constants(material)
    errors = np.zeros((0, len(slopes)))
    if material.covariance:
        # The bulk modulus is not fitted.
        root = root_of(material.covariance)
        errors = np.hstack([root, np.zeros((len(root), 1))])
    return Constants(tuple(named(region, name) for name in slopes), np.array(list(slopes.values())), errors)


def forces_by_constants(at: Configuration, state: State, known: Mapping[str, Constants]) -> dict[str, np.ndarray]:
    """What the forces R (n,) change by per relative change of every constant, (c, n) by region.

    Parameters
    ----------
    at, state : the equilibrium.
    known : the constants of the model's rubbers.
    """
    by_parameters = parameter_forces(at, state) if known else {}
    return {region: each.parameters @ by_parameters[region] for region, each in known.items()}


def with_changed(model: Model, problem: Problem, changes: Mapping[str, float]) -> Model:
    """The model of a body whose rubbers have other constants.

    Parameters
    ----------
    model : of a body of the problem.
    problem : with the materials from which constants differ.
    changes : relative, by names.
    """
    return with_rubbers(model, {name: rubber_of(each) for name, each in changed(problem, changes).items()})


def changed(problem: Problem, changes: Mapping[str, float]) -> dict[str, Material]:
    """The materials by region with relative changes of constants by their names; values are not checked."""
    found = {}
    for region, material in rubbers_in(problem).items():
        own = constants(material)
        values = {name: (1.0 + changes.get(named(region, name), 0.0)) * value for name, value in own.items()}
        found[region] = with_constants(material, values)
    return found
