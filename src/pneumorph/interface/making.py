"""Files for manufacturing a design, with what the ports change in its motion, and what sagging negatives change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.analysis.ports import Port, with_and_without
from pneumorph.analysis.settling import settle
from pneumorph.geometry import Body
from pneumorph.mechanics import rubber_of
from pneumorph.problem import Problem
from pneumorph.problem.material import elastomer

if TYPE_CHECKING:
    from pneumorph.make import MadeFiles, Plan, PortEffect, Sag, SiliconePlan


Pressures = Mapping[str, Mapping[str, float]]


def make_design(problem: Problem, body: Body, pressures: Pressures, folder: Path, chord: float) -> MadeFiles:
    """Write all files for manufacturing a design; for errors see `Design.make`.

    Parameters
    ----------
    problem, body : of the design.
    pressures : {task: {chamber: MPa}}
    folder : where to write.
    chord : largest distance in mm between the surfaces and the triangles of 3MF and STL.
    """
    from pneumorph.make import make, make_faces

    if problem.solid is not None:
        return make_faces(problem, body, folder, chord)
    return make(body, folder, chord, problem, lambda plan: _effects(problem, body, pressures, plan), _sags)


def _effects(problem: Problem, body: Body, pressures: Pressures, plan: Plan) -> Sequence[PortEffect]:
    from pneumorph.make import PortEffect

    cured = 1.0 - plan.spec.shrinkage  # the plan is that of the larger mould
    ports = [Port(cured * stem.start, stem.direction, plan.spec.tube / 2.0) for stem in plan.stems if not stem.closed]
    length = cured * plan.length
    motions = with_and_without(problem, body, pressures, ports)
    size = np.linalg.norm
    return [
        PortEffect(
            task=task,
            moved=float(size(without.translation)),
            turned=float(size(without.rotation)),
            shift=float(size(tubes.translation - without.translation)),
            turn=float(size(tubes.rotation - without.rotation)),
            length=length,
        )
        for task, (without, tubes) in motions.items()
    ]


def _sags(plan: SiliconePlan) -> Sequence[Sag]:
    from pneumorph.make import grids, sag_of

    rubber = rubber_of(elastomer(plan.spec.silicone))
    sags = []
    for slab in plan.slabs:
        settled = {
            side: settle(rubber, grid.low, grid.high, grid.filled, grid.fixed)
            for side, grid in grids(plan, slab).items()
        }
        sags.append(sag_of(plan, slab, settled))
    return sags
