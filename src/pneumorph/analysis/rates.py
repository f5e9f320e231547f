"""How fast the tip's motion changes with pressures and with the rubber's modulus, from adjoints at the equilibrium."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.doing import doing
from pneumorph.results import MotionRates
from pneumorph.sensitivity import by_known, motion_slopes


@doing("finding how motions change with pressure")
def motion_rates(disc: Discretisation, analysis: Analysis) -> Mapping[str, MotionRates]:
    """Derivatives of the tip's translation and rotation vector in every task, by one adjoint for each of the six.

    By pressures that are given; what is sealed or filled has none of its own.
    """
    rates = {}
    for name, equilibrium in analysis.equilibria.items():
        at = analysis.configurations[name]
        slopes = motion_slopes(at, disc.tangents[name], equilibrium.state)
        by_pressure = np.array([by_known(at, loads.pressure) for loads in slopes.loads])
        enclosed = () if at.enclosed is None else at.enclosed.chambers
        given = {each: k for k, each in enumerate(disc.model.chambers) if each not in enclosed}
        rates[name] = MotionRates(
            {chamber: tuple(map(float, by_pressure[:, k])) for chamber, k in given.items()},
            tuple(map(float, sum(slopes.moduli.values(), np.zeros(6)))),
        )
    return rates
