"""Second-order corrections of trial designs that are beyond a limit on states.

The linearised limits of the design before the step, with what the trial has shown them to miss, ask for a motion of
surfaces and pressures from the trial: the smallest that meets them. This keeps most of a long step where limits are
curved (Fletcher 1982; Nocedal & Wright 2006, section 18.3). It is also what gets on where moved nodes inside or a new
mesh change a motion by as much for any step, so that shorter ones would never meet its limit.
"""

from __future__ import annotations

from dataclasses import replace

from pneumorph.optimize.acceptance import Tried
from pneumorph.optimize.trial import analyse_again
from pneumorph.optimize.within import Within


def corrected(tried: Tried) -> Tried:
    """The step with the correction, once more analysed; as it was if it needs none, or none promises enough.

    What is left of the predicted gain has to be more than a region smaller by the usual factor would leave.
    """
    setup, current, trial, proposal = tried.setup, tried.current, tried.trial, tried.proposal
    if trial.analysis is None or not trial.beyond_states or current.states.violated:
        return tried
    with tried.clock.phase("subproblem"):
        missed = trial.state_excess - current.states.worst(proposal.change)
        kept = current.states.missing(missed).to_meet(current.analysis.phi)
        end = setup.within(trial.analysis.phi, tried.length, kept)
    step = replace(proposal, end=end)
    least = setup.settings.radius.shrink * proposal.predicted_gain
    if not isinstance(end, Within) or step.predicted_gain < least or kept.at(end.phi).max() > kept.accuracy:
        return tried
    again = analyse_again(setup, current.number + 1, current.design, trial, end.phi, tried.clock)
    if again.analysis is None:
        return replace(tried, trial=replace(trial, factorisations=again.factorisations))
    return replace(tried, proposal=step, trial=again)
