"""How far motions are from those on infinitely fine meshes: an estimate by the adjoint on a refined mesh.

Every element is divided into eight, so a state u of the mesh is also one of the refined mesh, where its residual R is
not zero. With the adjoint z of a motion m of the tip there, the motion on the refined mesh is m(u) − zᵀR to first
order: a linear solution in place of the whole search (Becker and Rannacher 2001, Acta Numerica 10, 1–102). What
further refinement adds is taken from the order with which errors fall.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.mechanics import Configuration, State, Tangent, displacement, model_of
from pneumorph.mechanics.solve.balance import residual_at
from pneumorph.mesh.refine import Refined, refine
from pneumorph.problem import Problem
from pneumorph.sensitivity import tip_motion_adjoints

ORDER = 1.2
"""Order in the size of elements with which errors of motions are taken to fall. It is 4 for smooth solutions, but at
the clamped base and at inner edges of chambers displacements go like r^λ with λ of about 0.6, and errors of motions
fall with 2λ. If they fall with 4, the estimate is 1.7 times the error; if with 1, 0.9 times."""

BEYOND = 1.0 / (1.0 - 2.0**-ORDER)
"""The whole error over the part of it that one refinement removes."""


MOST = 80_000
"""Elements of refined meshes that are small enough for the end of a run, in time and memory."""


@dataclass(frozen=True)
class MeshError:
    """Motions (6,) of the tip on a mesh, mm and rad, and what they would be more on infinitely fine meshes."""

    motion: np.ndarray
    missing: np.ndarray

    @property
    def corrected(self) -> np.ndarray:
        """The estimate (6,) of the motions without the error of the mesh."""
        return self.motion + self.missing


def mesh_errors(problem: Problem, disc: Discretisation, analysis: Analysis) -> dict[str, MeshError]:
    """The error of the tip's motion by the mesh in every task: one factorisation of the refined mesh for each.

    Parameters
    ----------
    problem : of the design.
    disc, analysis : its mesh and its states.

    Raises
    ------
    ValueError
        If it has sheets or fibres, of which the parts of faces are not refined.
    """
    fine = refine(disc.morph.mesh.at(analysis.X))
    model = model_of(problem, fine.mesh)
    errors = {}
    for name, at in analysis.configurations.items():
        state = on_refined(disc, fine, at, analysis.equilibria[name].state)
        there = replace(at, model=model, X=fine.mesh.points)
        motion, adjoints = tip_motion_adjoints(there, Tangent(model), state)
        residual = residual_at(there, model.vector(state))
        errors[name] = MeshError(motion, -BEYOND * (adjoints @ residual))
    return errors


def finest_motions(problem: Problem, disc: Discretisation, analysis: Analysis) -> dict[str, tuple[float, ...]]:
    """Estimates of the tip's motions in every task without the error of the mesh, where they take little time.

    Parameters
    ----------
    problem : of the design.
    disc, analysis : its mesh and its states.
    """
    if disc.model.reinforcements or 8 * disc.model.elements > MOST:
        return {}
    errors = mesh_errors(problem, disc, analysis)
    return {name: tuple(map(float, error.corrected)) for name, error in errors.items()}


def on_refined(disc: Discretisation, fine: Refined, at: Configuration, state: State) -> State:
    """A state of a mesh as one of the refined mesh."""
    model, u = disc.model, fine.P @ displacement(disc.model.tip, at.X, state)
    if not model.mixed:
        return state._replace(u=u)
    coarse = np.asarray(state.hydrostatic).reshape(len(model.rubbers), -1)
    pi = np.zeros((len(coarse), len(u)))
    pi[:, : coarse.shape[1]] = coarse
    # π is linear between corners; mid-side nodes of the coarser mesh are corners of the finer one.
    pi[:, fine.mids] = coarse[:, fine.ends].mean(axis=2)
    return state._replace(u=u, hydrostatic=pi.ravel())
