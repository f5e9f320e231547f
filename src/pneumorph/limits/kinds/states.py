"""Limits on the states of tasks: their words and bounds. Values and derivatives need equilibria: `optimize.states`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pneumorph.limits.limit import Limit

if TYPE_CHECKING:
    from pneumorph.problem import Limits


def _strain(limits: Limits) -> float | None:
    return None if limits.strain == "off" else limits.strain


def _margin(limits: Limits) -> float | None:
    # The pressure of an equilibrium is below that of the limit point ahead in any case.
    return None if limits.margin == 1.0 else limits.margin


STRAIN = Limit("strain", "strain", "", False, 0.005, "strain", _strain)
MARGIN = Limit("margin", "margin", "", True, 0.005, "margin", _margin)
