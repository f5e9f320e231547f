"""A chamber that is sealed with gas."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from pneumorph import units
from pneumorph.problem.table import InvalidKey, Quantity, Table

ATMOSPHERE = 0.101325
"""Absolute pressure of the standard atmosphere, MPa."""

BELOW_VACUUM = (
    "is below a vacuum: gauge pressures are above the atmosphere's, so none is less than -101.325 kPa; raise it"
)
"""Why a gauge pressure below minus the atmosphere's is refused."""

Pressure = Annotated[float, Quantity(units.PRESSURE)]


class Gas(Table):
    """Gas that a chamber is sealed with: its pressure follows from the volume, in every task.

    The amount of gas is that which has `pressure` when the body is at rest.
    """

    pressure: Pressure = 0.0
    """Gauge pressure of the gas while the body is at rest."""
    exponent: Annotated[float, Field(ge=1.0, le=5.0 / 3.0)] = 1.0
    """Exponent γ of p V^γ = const: 1 for slow changes (isothermal), 1.4 for fast ones of air (adiabatic)."""
    atmosphere: Annotated[float, Quantity(units.PRESSURE, "not negative")] = ATMOSPHERE
    """Absolute pressure around the body, to which gauge pressures are relative."""

    @model_validator(mode="after")
    def _some_gas(self) -> Gas:
        if self.pressure + self.atmosphere <= 0.0:
            raise InvalidKey("pressure", "is below a vacuum; make it larger than minus the atmosphere's")
        return self
