"""Limits on the states of tasks: their words and bounds. Values and derivatives need equilibria: `optimize.states`."""

from pneumorph.limits.limit import Limit

STRAIN = Limit("strain", "strain", "", False, 0.005, "strain", lambda limits: limits.strain)
MARGIN = Limit("margin", "margin", "", True, 0.005, "margin", lambda limits: limits.margin)
