"""The chain of rigid links that a design is in programs of rigid bodies."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.analysis import Explorer
from pneumorph.atomic import write_bytes
from pneumorph.errors import ComputationError, ProblemError, writing
from pneumorph.interface.reach import bounds_of
from pneumorph.mechanics import NoEquilibrium
from pneumorph.objective import measure_features
from pneumorph.objective.features import equidistant
from pneumorph.output.formats.mujoco import mujoco_model
from pneumorph.surrogate.chain import Chain, fitted_chain
from pneumorph.surrogate.states import States

SECTIONS = 8
"""Stations on the axis, besides its ends: then a joint turns by a ninth of what the tip does."""


def export_chain(path: Path, explorer: Explorer, bounds: Mapping[str, Any]) -> Chain:
    """Write a model for MuJoCo, and return what it is made of.

    Parameters
    ----------
    path : of the file.
    explorer : of the design, under the loads of a task.
    bounds : {chamber: "0:60 kPa"}
        By default those of the tasks.

    Raises
    ------
    ProblemError
        If the axis is bent, motions of the tip are held, a bound makes no sense, or the file cannot be written.
    ComputationError
        If there is no stable state at pressures within the bounds.
    """
    problem = explorer.problem
    if problem.solid is None and problem.tubes.axis is not None:
        raise ProblemError(f"{path}: a chain of links is along z; this body has a bent axis")
    given = bounds_of(problem, bounds)
    at, answer, _ = explorer.solved({}, dict.fromkeys(given, 0.0))
    if isinstance(answer, NoEquilibrium):
        raise ComputationError(f"without pressure: {answer.reason}")
    grams = float(measure_features(at.model, at.X, answer.state, shift=np.asarray(at.loads.shift)).mass)
    length, radius = float(at.X[:, 2].max()), float(np.hypot(at.X[:, 0], at.X[:, 1]).max())
    slabs = equidistant(SECTIONS, length)
    chain = fitted_chain(States(explorer, given, SECTIONS), np.array([0.0, *slabs.middle, length]))
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, mujoco_model(chain, problem.title, 1e-6 * grams, radius).encode())
    return chain


def chain_words(chain: Chain) -> str:
    """How near the chain is to the body."""
    mm, rad = chain.off.max(axis=0)
    return (
        f"a chain of {len(chain.rest)} joints: at {len(chain.off)} exact states its tip is off by at most {mm:.2g} mm "
        f"of {chain.spans[0]:.3g} mm and {np.degrees(rad):.2g}° of {np.degrees(chain.spans[1]):.3g}°; a force across "
        f"the tip moves it by {100 * chain.sideways:.0f} % of what it moves the body's"
    )
