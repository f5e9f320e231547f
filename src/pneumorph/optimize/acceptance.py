"""Whether a step is worth a trial, and whether a trial design is accepted: two chains of tests.

All iterates satisfy the limits on the shape, so acceptance needs no filter and no merit function (Wright & Tenny 2004,
"A feasible trust-region sequential quadratic programming algorithm").
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from pneumorph.analysis import Analysis, design_slopes
from pneumorph.optimize.buckling import buckles, lateral_excess
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.crossings import crossings_of, is_known
from pneumorph.optimize.iterate import AnalysedDesign, Iterate, with_gaps, with_lateral_stiffness
from pneumorph.optimize.proposal import Proposal
from pneumorph.optimize.radius import TrustRegion
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.stopping import scale, worthwhile
from pneumorph.optimize.trial import Trial
from pneumorph.optimize.within import Within


@dataclass(frozen=True, eq=False)
class Rejected:
    """A step is rejected.

    Attributes
    ----------
    region : TrustRegion
        In which the search goes on.
    current : Iterate
        The current iterate, with what the step has taught.
    reason : str
        Why, as a sentence; empty where nothing was tried that a user would want to know of.
    """

    region: TrustRegion
    current: Iterate
    reason: str = ""


@dataclass(frozen=True)
class Ended:
    """The run ends at the current iterate; `reason` is a sentence.

    `factorisations` are those of trials since then.
    """

    reason: str
    factorisations: int = 0


Verdict = Rejected | Ended | None
"""None: nothing speaks against the step."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A step that was proposed.

    Attributes
    ----------
    setup : Setup
    current : Iterate
    region : TrustRegion
        With the radius in which the step was found.
    asked : float
        The radius in which the sub-problem was solved first, in reference steps.
    proposal : Proposal
    clock : Clock
    """

    setup: Setup
    current: Iterate
    region: TrustRegion
    asked: float
    proposal: Proposal
    clock: Clock

    @property
    def length(self) -> float:
        """The radius, mm."""
        return self.region.radius * self.setup.reference

    def rejected(self, reason: str, factor: float | None = None, current: Iterate | None = None) -> Rejected:
        """The verdict after a trial in vain, by default with a region that is smaller by the usual factor."""
        factor = self.setup.settings.radius.shrink if factor is None else factor
        return Rejected(self.region.rejected(factor), current or self.current, reason)


@dataclass(frozen=True, eq=False)
class Tried(Attempt):
    """A step whose design was tried, with the `trial`; what is asked of it besides needs its equilibria."""

    trial: Trial

    @property
    def design(self) -> AnalysedDesign:
        """The trial design."""
        trial = self.trial
        if trial.analysis is None or trial.lateral is None:
            raise ValueError("the trial design has no equilibrium")
        return AnalysedDesign(trial.analysis, trial.disc, self.proposal.within.report, trial.lateral)

    @property
    def gain(self) -> float:
        """The actual gain: of the objective, on one mesh, or of the limits on states while these are violated."""
        states, trial = self.current.states, self.trial
        if states.violated:
            return states.worst() - max(trial.state_excess, 0.0)
        return trial.before - self.design.analysis.value

    @property
    def ratio(self) -> float:
        """The ratio of actual to predicted gain."""
        return self.gain / self.proposal.predicted_gain


def _within_shape_limits(attempt: Attempt) -> Verdict:
    """Rejects a step from which no short way leads within the limits on the shape."""
    end = attempt.proposal.end
    if isinstance(end, Within):
        return None
    violated = "; ".join(map(str, end.violated()))
    region = attempt.region.too_large(attempt.setup.settings.radius)
    return Rejected(region, attempt.current, f"limits could not be satisfied: {violated}")


def _predicts_a_gain(attempt: Attempt) -> Verdict:
    """Rejects a step that the limits have left no predicted gain."""
    if attempt.proposal.predicted_gain > 0:
        return None
    return Rejected(attempt.region.too_large(attempt.setup.settings.radius), attempt.current)


def _promises_enough(attempt: Attempt) -> Verdict:
    """Ends a run in which even the longest steps promise less than an equilibrium is worth."""
    setup, current, region, gain = attempt.setup, attempt.current, attempt.region, attempt.proposal.predicted_gain
    small = region.radius < setup.settings.radius.ordinary
    if small or current.states.violated or gain >= worthwhile(setup, current):
        return None
    if attempt.asked == region.radius < region.longest:
        # The objective may be far from where it changes much: a longer step may promise enough.
        return Rejected(region.longer(setup.settings.radius), current)
    size, first = scale(setup, current), current.learnt.first
    if abs(current.analysis.value) < size:
        begun_near = first > abs(current.learnt.objectives[0])
        whole = "that of a body at rest" if begun_near else "its initial value"
        return Ended(f"the objective has fallen to {current.analysis.value / first:.1g} of {whole}")
    share = 100 * gain / max(size, 1e-300)
    return Ended(f"a step of {attempt.length:.2g} mm promises no more than {share:.1g} % of the objective")


def _has_equilibria(tried: Tried) -> Verdict:
    """Rejects a design that has no state in some task, or none that was found."""
    trial, settings = tried.trial, tried.setup.settings
    if trial.analysis is not None:
        return None
    # A part without a state ends the way; from another design, or in other parts, one may lead a little farther.
    least, most = settings.radius.shrink**3, settings.radius.shrink
    return tried.rejected(trial.reason, min(max(trial.reached, least), most))


def _satisfies_state_limits(tried: Tried) -> Verdict:
    """Rejects a design whose states violate a limit, unless those of the current one do; the next expects it."""
    trial, current = tried.trial, tried.current
    if not trial.beyond_states or current.states.violated:
        return None
    curvature = current.states.curvature(trial.state_excess, tried.proposal.change)
    reason = f"it would be {100 * trial.state_excess:.2g} % beyond limits.{trial.state_limit}"
    return tried.rejected(reason, current=current.learning(state_curvature=curvature))


def _resists_lateral_buckling(tried: Tried) -> Verdict:
    """Rejects a design that buckles laterally; the next step is told how stiff the body is."""
    current, after = tried.current, tried.design.lateral
    if not buckles(current.lateral, after):
        return None
    if not current.lateral.at_rest:
        current = with_lateral_stiffness(tried.setup, current, tried.clock)
    curvature = current.states.curvature(lateral_excess(current.lateral, after), tried.proposal.change)
    current = current.learning(state_curvature=max(current.learnt.state_curvature, curvature))
    return tried.rejected("it would buckle laterally", current=current)


def _does_not_intersect_itself(tried: Tried) -> Verdict:
    """Rejects a design whose body intersects itself where the current one does not; the next step is told where."""
    setup, current, trial = tried.setup, tried.current, tried.trial
    if trial.crossed is None:
        return None
    crossings = crossings_of(trial.disc, trial.crossed)
    known = all(is_known(current.disc, current.learnt.crossings, each) for each in crossings)
    if known and tried.region.radius < setup.settings.radius.ordinary:
        return Ended(
            f"a step of {tried.length:.2g} mm would make the body self-intersect; with a table [contact] its "
            "surfaces come into contact instead"
        )
    return tried.rejected(trial.reason, current=with_gaps(setup, current, crossings, tried.clock))


def _leaves_obstacles_their_room(tried: Tried) -> Verdict:
    """Rejects a design whose undeformed body reaches into an obstacle in its place, where the current one does not.

    No path of states leads from there to what the task asks for. The limit on obstacles keeps surfaces out of them; the
    faces of a mesh may reach a little farther.
    """
    if _apart_at_rest(tried.design) or not _apart_at_rest(tried.current.design):
        return None
    if tried.region.radius < tried.setup.settings.radius.ordinary:
        return Ended(f"a step of {tried.length:.2g} mm would move the body at rest into an obstacle")
    return tried.rejected("the body at rest would reach into an obstacle")


def _apart_at_rest(design: AnalysedDesign) -> bool:
    contact = design.disc.model.contact
    return contact is None or contact.apart_at_rest(design.analysis.X)


def newly_intersects(before: Analysis, after: Analysis) -> bool:
    """Whether the body of a design intersects itself in a task in which that of another one does not."""
    return any(now and not before.self_intersecting[task] for task, now in after.self_intersecting.items())


def _gains_as_predicted(tried: Tried) -> Verdict:
    """Rejects a design that gains too little of what was predicted; its gradient corrects the model's curvature."""
    setup, current = tried.setup, tried.current
    if tried.ratio >= setup.settings.acceptance.ratio:
        return None
    with tried.clock.phase("gradient"):
        there = design_slopes(setup.problem, setup.space, tried.design.disc, tried.design.analysis)
    curvature = current.learnt.curvature.with_pair(tried.proposal.change, there.rest - current.slopes.rest)
    reason = f"the gain was {tried.ratio:.2f} of the predicted one"
    return tried.rejected(reason, current=current.learning(curvature=curvature))


PROPOSAL_TESTS = (_within_shape_limits, _predicts_a_gain, _promises_enough)
"""Before a trial: they cost nothing."""

STATE_TESTS = (
    _does_not_intersect_itself,
    _has_equilibria,
    _satisfies_state_limits,
    _resists_lateral_buckling,
    _leaves_obstacles_their_room,
)
"""After it, of what depends on the mesh most."""

ACCEPTANCE_TESTS = (*STATE_TESTS, _gains_as_predicted)
"""After it. The later ones rely on what the earlier ones have ascertained."""

Case = TypeVar("Case", bound=Attempt)


def first_objection(tests: Sequence[Callable[[Case], Verdict]], case: Case) -> Verdict:
    """The verdict of the first test that a step does not pass; None if it passes all."""
    return next((verdict for test in tests if (verdict := test(case)) is not None), None)


def judged(tried: Tried) -> Verdict:
    """The verdict on a step that was tried."""
    return first_objection(ACCEPTANCE_TESTS, tried)


def judged_on_larger_elements(tried: Tried) -> Verdict:
    """The same on elements larger than those asked for: what states stop there, smaller ones have to decide."""
    verdict = first_objection(STATE_TESTS, tried)
    if isinstance(verdict, Rejected):
        return Ended(f"a step on larger ones was rejected: {verdict.reason}")
    return verdict or _gains_as_predicted(tried)
