"""Files for manufacturing a design, with what the ports change in its motion, and what sagging negatives change."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.analysis.ports import Port, with_and_without
from pneumorph.analysis.settling import settle
from pneumorph.interface.design import Design
from pneumorph.mechanics import rubber_of
from pneumorph.problem.material import elastomer

if TYPE_CHECKING:
    from pneumorph.make import MadeFiles, Plan, PortEffect, Sag, SiliconePlan


def make_design(design: Design, folder: Path, chord: float) -> MadeFiles:
    """See `Design.make`."""
    from pneumorph.make import make

    return make(design.body, folder, chord, design.problem, lambda plan: _effects(design, plan), _sags)


def _effects(design: Design, plan: Plan) -> Sequence[PortEffect]:
    from pneumorph.make import PortEffect

    cured = 1.0 - plan.spec.shrinkage  # the plan is that of the larger mould
    ports = [Port(cured * stem.start, stem.direction, plan.spec.tube / 2.0) for stem in plan.stems if not stem.closed]
    length = cured * plan.length
    motions = with_and_without(design.problem, design.body, design.pressures, ports)
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
    found = []
    for slab in plan.slabs:
        settled = {
            side: settle(rubber, grid.low, grid.high, grid.filled, grid.held)
            for side, grid in grids(plan, slab).items()
        }
        found.append(sag_of(plan, slab, settled))
    return found
