"""Chambers whose pressure is unknown: filled to a given volume, or sealed with an amount of gas.

Such a pressure p is the multiplier of a constraint on the volume of its chamber,

    V(X + u) = v(p),    v = V₀ + ΔV            of a chamber with ΔV of a liquid more than at rest,
                        v = V₀ ((p₀ + a) / (p + a))^(1/γ)    of gas that is at p₀ when the body is at rest,

with the volume V₀ at rest, the pressure a of the atmosphere, and γ = 1 for an isothermal and 1.4 for an adiabatic
change of air. Both are stationary points of one potential, Π(u) − p V + ∫v dp. A correction solves the bordered system

    [  K   −f ] [dx]   [ −R  ]
    [ −fᵀ   v′] [dp] = [V − v],    f = ∂V/∂x,

by back-solves with K alone: of the Schur complement S = v′ − fᵀK⁻¹f there are as many rows as there are such chambers.
By the inertia of both (Haynsworth 1968), K with the gas's own stiffness, or K in motions that keep the volumes, has as
many negative eigenvalues as K and S together, less one for each chamber.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements import sums
from pneumorph.mechanics.elements.kinematics import State

STANDARD = 0.101325
"""Absolute pressure at which amounts of gas are told, MPa: that of the standard atmosphere."""


@dataclass(frozen=True, eq=False)
class Enclosed:
    """What encloses the pressures of k chambers.

    Attributes
    ----------
    chambers : tuple of str
        Their names.
    added : (k,) mm³
        Volume of liquid beyond that at rest; not used for gas.
    gas : (k,) bool
        Whether a chamber is sealed with gas.
    filling : (k,) MPa
        Gauge pressure p₀ of the gas when the body is at rest.
    exponent : (k,) γ
    atmosphere : (k,) MPa
    """

    chambers: tuple[str, ...]
    added: np.ndarray
    gas: np.ndarray
    filling: np.ndarray
    exponent: np.ndarray
    atmosphere: np.ndarray

    @property
    def liquids(self) -> dict[str, float]:
        """Volume of liquid in mm³ beyond that at rest, of the chambers that are filled with some."""
        return {name: float(self.added[k]) for k, name in enumerate(self.chambers) if not self.gas[k]}

    def part(self, fraction: float) -> Enclosed:
        """With a fraction of what is filled in, as loads are raised."""
        return replace(self, added=fraction * self.added, filling=fraction * self.filling)

    def towards(self, other: Enclosed, fraction: float) -> Enclosed:
        """A fraction of the way to another one, of the same chambers."""
        return replace(
            other,
            added=self.added + fraction * (other.added - self.added),
            filling=self.filling + fraction * (other.filling - self.filling),
        )

    def rows(self, model: Model) -> np.ndarray:
        """Where its chambers are (k,) among those of a model."""
        return np.array([model.chambers.index(name) for name in self.chambers], dtype=int)

    def volumes(self, rest: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        """v (k,) in mm³ at pressures (k,) in MPa, of chambers with the volumes `rest` (k,) in mm³ at rest."""
        return np.where(self.gas, rest * self._ratio(pressure), rest + self.added)

    def pressures(self, rest: np.ndarray, volumes: np.ndarray) -> np.ndarray:
        """Those (k,) in MPa of gas in volumes (k,): the inverse of `volumes`; of liquids they mean nothing."""
        ratio = rest / np.maximum(volumes, 1e-9 * rest)
        return (self.filling + self.atmosphere) * ratio**self.exponent - self.atmosphere

    def slopes(self, rest: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        """v′ (k,) in mm³/MPa; see `volumes`."""
        stiff = self.exponent * (pressure + self.atmosphere)
        return np.where(self.gas, -self.volumes(rest, pressure) / stiff, 0.0)

    def by_rest(self, pressure: np.ndarray) -> np.ndarray:
        """∂v/∂V₀ (k,)."""
        return np.where(self.gas, self._ratio(pressure), 1.0)

    def _ratio(self, pressure: np.ndarray) -> np.ndarray:
        ratio = (self.filling + self.atmosphere) / np.maximum(pressure + self.atmosphere, 1e-9 * self.atmosphere)
        return ratio ** (1.0 / self.exponent)


def amounts(model: Model, X: np.ndarray, given: Enclosed | None) -> dict[str, float]:
    """The gas in chambers that are sealed with some, as its volume in mm³ at `STANDARD` pressure."""
    if given is None:
        return {}
    at_rest = model.copies * volumes_of(model, X, model.state(np.zeros(model.size)))[given.rows(model)]
    volumes = at_rest * (given.filling + given.atmosphere) / STANDARD
    return {name: float(volumes[k]) for k, name in enumerate(given.chambers) if given.gas[k]}


def volumes_of(model: Model, X: np.ndarray, state: State) -> np.ndarray:
    """Volumes (C,) in mm³ of the chambers of what is meshed."""
    u = Displacement(model.tip, X, state).u
    return sums.summed(sums.volumes, model.cavities, X, u) + sums.summed(sums.cap_volumes, model.caps, X, u)


def volume_slopes(model: Model, X: np.ndarray, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Their derivatives by the nodes (C, N, 3) and by the unknowns (C, n), with those that are constrained."""
    nodes, units = Displacement(model.tip, X, state), np.eye(len(model.chambers))
    by_X, by_u = sums.pulled_back(sums.volumes, model.cavities, X, nodes.u, units)
    if model.caps.count:
        one, other = sums.pulled_back(sums.cap_volumes, model.caps, X, nodes.u, units)
        by_X, by_u = by_X + one, by_u + other
    by_X = np.array([own + nodes.pulled_to_nodes(each) for own, each in zip(by_X, by_u, strict=True)])
    return by_X, np.array([model.vector(nodes.pulled(each)) for each in by_u])
