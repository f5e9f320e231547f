"""What changes with the moduli of a rubber at an equilibrium: motions, volumes and what blocks bear, to first order.

A factor s of the moduli multiplies the rubber's part R_s of the residual, so the state changes by −K⁻¹R_s per ln s: one
back-solve for each rubber gives everything.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.mechanics.assembly.products import load_product, tangent_product
from pneumorph.mechanics.solve.balance import supported
from pneumorph.mechanics.solve.border import border_at
from pneumorph.sensitivity.motion import rubber_forces
from pneumorph.sensitivity.response import measured_of

_MEASURED = measured_of()


@dataclass(frozen=True, eq=False)
class Stiffer:
    """Derivatives at an equilibrium by the logarithm of the moduli of a rubber.

    Attributes
    ----------
    motion : (6,)
        Of the tip's translation (mm) and rotation vector (rad).
    volumes : {chamber: mm³}
        Of the volumes of the whole body's chambers.
    exerted : (6,)
        Of what the whole body exerts on blocks of its plate, N and N·mm; 0 where it is not blocked.
    """

    motion: np.ndarray
    volumes: Mapping[str, float]
    exerted: np.ndarray


def by_moduli(at: Configuration, tangent: Tangent, state: State) -> dict[str, Stiffer]:
    """The derivatives by the moduli of every rubber, by the names of their regions.

    Parameters
    ----------
    at, tangent, state : an equilibrium, with the pressures that were found.
    """
    model, X, loads = at.model, at.X, at.loads
    _, _, seeds = replace(_MEASURED, shift=np.asarray(loads.shift)).jacobian(model, X, state)
    rows = np.array([supported(at, model.vector(seed)) for seed in seeds])
    forces = {name: model.vector(each) for name, each in rubber_forces(at, state).items()}
    moved = -tangent.solve_at(at, state, np.array([supported(at, each) for each in forces.values()]).T)
    border = None if at.enclosed is None else border_at(at, tangent, state)
    found = {}
    for number, (name, force) in enumerate(forces.items()):
        change, more = moved[:, number], type(loads)(*(np.zeros(np.shape(each)) for each in loads))
        if border is not None and at.enclosed is not None:
            both, pressure = border.solution(change), np.zeros(len(model.chambers))
            change, pressure[at.enclosed.rows(model)] = both[: model.size], both[model.size :]
            more = more._replace(pressure=pressure)
        by_state = tangent_product(model.potential, X, state, loads, model.state(change))
        by_loads = load_product(model.potential, X, state, loads, more)
        exerted = -model.copies * (force + model.vector(by_state) + model.vector(by_loads))[-6:]
        of_chambers = dict(zip(sorted(model.chambers), (rows[6:] @ change).tolist(), strict=True))
        found[name] = Stiffer(rows[:6] @ change, of_chambers, np.where(at.blocked & ~model.odd, exerted, 0.0))
    return found
