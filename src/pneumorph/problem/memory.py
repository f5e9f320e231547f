"""What a rubber remembers: the keys of [material] for creep, relaxation and softening."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, Strict

from pneumorph import units
from pneumorph.problem.table import Example, Quantity, Table

Number = Annotated[float, Strict()]

State = Literal["first pull", "relaxed", "softened", "softened and relaxed"]

MEMORY = ("relaxation", "softening", "state")
"""The keys of [material] that a rubber of the library may have beside its name."""


class RelaxingPart(Table):
    """A part of the moduli that relaxes: a term of a Prony series."""

    share: Annotated[Number, Field(gt=0, lt=1), Example("share = 0.1")]
    """Its share in the moduli of an infinitely fast pull, which are those of the material."""
    time: Annotated[float, Quantity(units.TIME, "positive")]
    """Its relaxation time: in a stretched rubber it falls to 1/e in that time."""


class Softening(Table):
    """Softening by earlier stretches, of Ogden and Roxburgh (1999): η = 1 − erf((W − ψ)/(m + β W))/r.

    The stress is η times that of the first pull wherever the energy ψ is below W, the largest so far.
    """

    r: Annotated[Number, Field(gt=1, le=1e6), Example("r = 2.0")]
    """The stress falls to at least 1 − 1/r of that of the first pull."""
    m: Annotated[float, Quantity(units.MODULUS, "positive"), Example('m = "5 kPa"')]
    """Energy density below W over which the stress falls; smaller ones soften small stretches more."""
    beta: Annotated[Number, Field(ge=0, le=1e3)] = 0.0
    """What m has more of, as a share of W."""
    stretch: Annotated[Number, Field(gt=1, le=20)] | None = None
    """Stretch in tension up to which the rubber has been pulled, in the state "softened"."""
