"""Air that flows through a tube into a chamber, or out of it.

Steady flow of an ideal gas at constant temperature through a smooth tube of length L and diameter d, with the mass flow
per area G, between the absolute pressures p₁ > p₂ at its ends:

    p₁² − p₂² = G² R T (f L/d + 2 ln(p₁/p₂) + ζ)

with the friction factor f(G d/μ) of laminar and turbulent flow (Churchill 1977) and ζ of the entrance and the exit.
With a small G this is the law of Hagen and Poiseuille. G does not grow any more once the air leaves the tube at √(R T).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi, sqrt
from typing import cast

from scipy.optimize import brentq

from pneumorph import units
from pneumorph.errors import ProblemError

GAS = 287.05e6 * 293.15
"""R T of dry air at 20 °C, mm²/s²."""
VISCOSITY = 1.81e-11
"""Of air at 20 °C, MPa·s."""
ENDS = 1.5
"""ζ: half a dynamic pressure is lost at a sharp entrance, one at the exit."""
STANDARD_DENSITY = 1.204e-12
"""Of air at 20 °C and standard atmospheric pressure, t/mm³: volumes of air per time are told at this density."""
TURBULENT = 2300.0
"""Reynolds number above which flow in tubes is not laminar."""


@dataclass(frozen=True)
class Tube:
    """A tube of a diameter and a length, mm."""

    diameter: float
    length: float

    @property
    def area(self) -> float:
        """Of its cross-section, mm²."""
        return pi * self.diameter**2 / 4

    def flow(self, here: float, there: float) -> float:
        """Mass flow from one end to the other, t/s; negative if the air comes back.

        Parameters
        ----------
        here, there : float
            Absolute pressures at its ends, MPa, above zero.
        """
        if here == there:
            return 0.0
        if here < there:
            return -self.flow(there, here)
        there = max(there, self._sonic(here))
        push, ends = here**2 - there**2, 2 * log(here / there) + ENDS

        laminar = push * self.diameter**2 / (64 * VISCOSITY * GAS * self.length)
        largest = min(laminar, sqrt(push / (GAS * ends)))

        def beyond(share: float) -> float:
            G = share * largest
            return (self._rubbing(G) + G**2 * GAS * ends) / push - 1

        # Without losses at the ends or without friction there would be at least this flow.
        return self.area * largest * cast(float, brentq(beyond, 0.0, 1.0 + 1e-9, xtol=1e-13))

    def reynolds(self, flow: float) -> float:
        """Reynolds number of a mass flow in t/s."""
        return abs(flow) / self.area * self.diameter / VISCOSITY

    def _rubbing(self, G: float) -> float:
        """G² R T f L/d, MPa²."""
        number = G * self.diameter / VISCOSITY
        return G**2 * GAS * friction_factor(number) * self.length / self.diameter if number > 0.0 else 0.0

    def _sonic(self, here: float) -> float:
        """The pressure at the exit below which the flow from absolute pressure `here` does not grow."""

        def missing(share: float) -> float:
            G = share * here / sqrt(GAS)
            f = friction_factor(G * self.diameter / VISCOSITY)
            return 1 / share**2 - 1 - f * self.length / self.diameter + 2 * log(share) - ENDS

        # At almost no pressure friction rules, and at that of the other end nothing is lost.
        return here * cast(float, brentq(missing, 1e-6, 1.0))


def friction_factor(reynolds: float) -> float:
    """Darcy's friction factor of a smooth tube, for laminar and turbulent flow (Churchill 1977, Chem. Eng. 84:91)."""
    if reynolds < 1.0:
        return 64.0 / reynolds
    turbulent = (2.457 * log((reynolds / 7.0) ** 0.9)) ** 16 if reynolds > 7.0 else 0.0
    return 8.0 * ((8.0 / reynolds) ** 12 + (turbulent + (37530.0 / reynolds) ** 16) ** -1.5) ** (1 / 12)


def read_tube(text: str) -> Tube:
    """A tube from "2 mm x 1 m".

    Raises
    ------
    ProblemError
        If it is not a diameter and a length.
    """
    parts = text.replace("×", "x").split("x")
    if len(parts) != 2:
        raise ProblemError(f'tube: "{text}" is not a diameter and a length; write e.g. "2 mm x 1 m"')
    try:
        diameter, length = (units.parse(part.strip(), units.LENGTH) for part in parts)
    except ValueError as error:
        raise ProblemError(f'tube: "{text}": {error}') from None
    if not min(diameter, length) > 0.0:
        raise ProblemError(f'tube: "{text}" has a size that is not above zero; write e.g. "2 mm x 1 m"')
    return Tube(diameter, length)
