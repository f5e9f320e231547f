"""Propose a step: solve the sub-problem in the trust region, and bring the step within the limits on the shape."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pneumorph.limits.report import LimitReport
from pneumorph.optimize.iterate import Iterate
from pneumorph.optimize.model import Proxy
from pneumorph.optimize.radius import TrustRegion
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.step import Step
from pneumorph.optimize.stopping import worthwhile
from pneumorph.optimize.within import Within


@dataclass(frozen=True, eq=False)
class Proposal:
    """A step from the current iterate.

    Attributes
    ----------
    current : Iterate
    proxy : Proxy
        The model of the objective by which the step was found.
    radius : float
        Of the trust region in which it was found, in reference steps.
    step : Step
        The solution of the sub-problem.
    end : Within or LimitReport
        The design at its end once that satisfies the limits on the shape, or the report of a design that does not.
    """

    current: Iterate
    proxy: Proxy
    radius: float
    step: Step
    end: Within | LimitReport

    @property
    def within(self) -> Within:
        """The design at the end of the step, which satisfies the limits on the shape."""
        if not isinstance(self.end, Within):
            raise ValueError("the step leads to no design within the limits")
        return self.end

    @cached_property
    def change(self) -> np.ndarray:
        """The step (n,) within the limits, mm."""
        return self.within.phi - self.current.analysis.phi

    @cached_property
    def predicted_gain(self) -> float:
        """Of the step within the limits; −∞ if there is none."""
        if not isinstance(self.end, Within):
            return -np.inf
        return self.current.predicted_gain(self.proxy, self.change)

    @property
    def kept(self) -> float:
        """The share of its predicted gain that the step has kept when it was brought within the limits."""
        asked = self.current.predicted_gain(self.proxy, self.step.change)
        return self.predicted_gain / max(asked, self.predicted_gain)


def propose(setup: Setup, current: Iterate, region: TrustRegion) -> Proposal:
    """The step within the limits that promises most, in regions from the trust region down to one that it fills.

    A region is also too large if the predicted gain would end the run.
    """
    settings, proxy, radius = setup.settings, current.proxy(), region.radius
    phi, reference = current.analysis.phi, setup.reference
    states = current.states.bent(current.learnt.state_curvature, radius * reference)
    least = 0.0 if current.states.violated else worthwhile(setup, current)
    best = None
    while True:
        step = current.learnt.stepper.step(phi, proxy, radius * reference, states)
        # A longer way back would end in another kind of shape, of which the derivatives know nothing.
        end = setup.within(phi + step.change, radius * reference, states.kept(phi, step.change))
        proposal = Proposal(current, proxy, radius, step, end)
        if best is None or proposal.predicted_gain > best.predicted_gain:
            best = proposal
        fills = step.length >= settings.proposal.filled * radius * reference
        fits = fills and not -np.inf < proposal.predicted_gain < least
        if fits or radius * settings.radius.shrink < settings.radius.ordinary:
            return best
        radius *= settings.radius.shrink
