"""Energy balance of an actuator: the work of the pressure is stored in the rubber and springs, or done on forces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Model,
    NoEquilibrium,
    Tangent,
    build_loads,
    configure,
    model_of,
    solve,
)
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.solve.balance import unloaded
from pneumorph.mesh.tube import mesh_body
from pneumorph.verify.actuator import PRESSURE, linear_actuator
from pneumorph.verify.verdict import Verdict, relative

SIZE = 5.0
"""Edge length of the mesh, mm. It may be coarse, since the balances hold exactly on every mesh."""

AXIAL = np.arange(6) == 2


def energy_balance(size: float = SIZE) -> Iterator[Verdict]:
    """The starting tube inflated to 60 kPa, with a free tip and with a spring: ∫p dV against the stored energy."""
    actuator = start(size)
    for word, spring in (("free tip", 0.0), ("spring of 4 N/mm", 4.0)):
        full = actuator.equilibrium(PRESSURE, spring=spring)
        # ∫p dV = pV − ∫V dp, and V is a smooth function of p.
        within = integral(lambda p, k=spring: actuator.equilibrium(p, spring=k).volumes["A"], PRESSURE)
        done = PRESSURE * full.volumes["A"] - within
        stored = actuator.potential(unloaded(actuator.at(PRESSURE, spring=spring)), full)
        yield relative(f"{word}: stored energy, N·mm", stored, done, 1e-6)


def blocked_force(size: float = SIZE) -> Iterator[Verdict]:
    """The starting tube at 60 kPa: its work from blocked to free, and the forces on springs."""
    actuator = start(size)
    free, blocked = actuator.equilibrium(PRESSURE), actuator.equilibrium(PRESSURE, blocked=AXIAL)
    force = float(blocked.reaction[2])
    at = actuator.at(PRESSURE)
    drop = actuator.potential(at, blocked) - actuator.potential(at, free)
    # Against a dead force f the plate comes to rest at d(f); the area below that curve is the work.
    work = integral(lambda f: float(actuator.equilibrium(PRESSURE, force=-f).plate[2]), force)
    yield relative("fall of Π from blocked to free, N·mm", drop, work, 1e-6)
    spring = 0.5 * force / float(actuator.equilibrium(PRESSURE, force=-0.5 * force).plate[2])
    pushed = spring * float(actuator.equilibrium(PRESSURE, spring=spring).plate[2])
    yield relative("force on the spring that meets half the blocked force, N", pushed, 0.5 * force, 1e-7)
    pushed = 1e6 * float(actuator.equilibrium(PRESSURE, spring=1e6).plate[2])
    yield relative("force on a spring of 10⁶ N/mm, N", pushed, force, 1e-5)


@dataclass(frozen=True)
class Actuator:
    """A meshed actuator with one chamber, A."""

    model: Model
    X: np.ndarray
    tangent: Tangent

    def at(
        self, pressure: float, spring: float = 0.0, force: float = 0.0, blocked: np.ndarray | None = None
    ) -> Configuration:
        """The configuration under pressure, an axial spring and an axial dead force.

        Parameters
        ----------
        pressure : float
            MPa.
        spring : float
            Axial, N/mm.
        force : float
            Axial dead force, N.
        blocked : (6,) bool, optional
            Components of the plate that are held.
        """
        acting = build_loads(self.model, {"A": pressure}, spring=spring * AXIAL, wrench=force * AXIAL)
        return configure(self.model, self.X, acting, blocked)

    def equilibrium(self, pressure: float, **rest) -> Equilibrium:
        """The equilibrium under the loads of `at`; ComputationError if there is none."""
        answer = solve(self.at(pressure, **rest), self.tangent)
        if isinstance(answer, NoEquilibrium):
            raise ComputationError(answer.reason)
        return answer

    def potential(self, at: Configuration, equilibrium: Equilibrium) -> float:
        """Π of a state under the loads of the configuration `at`, N·mm."""
        return kernels.total(self.model.potential, at.X, equilibrium.state, at.loads)


def start(size: float) -> Actuator:
    """The meshed starting body of the linear actuator."""
    problem = linear_actuator()
    mesh = mesh_body(body_of(problem), size).mesh
    built = model_of(problem, mesh)
    return Actuator(built, mesh.points, Tangent(built))


def integral(function: Callable[[float], float], end: float) -> float:
    """The integral from 0 to `end` by Gauss quadrature with six points."""
    x, weights = np.polynomial.legendre.leggauss(6)
    return 0.5 * end * sum(w * function(0.5 * end * (1 + t)) for t, w in zip(x, weights, strict=True))
