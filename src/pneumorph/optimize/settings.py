"""Settings of the design loop, each with its reason. Regions are in reference steps, multiples of `optimizer.step`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class RadiusSettings:
    """How the trust region changes; the scheme is algorithm 4.1 of Nocedal & Wright, Numerical Optimization (2006)."""

    expand: float = 2.0
    """Growth after a very good step, as in algorithm 4.1."""

    shrink: float = 0.5
    """What is left of the region after a rejected or a poor step. Algorithm 4.1 leaves a quarter; half allows a longer
    step where one would do, for one more trial where not."""

    good: float = 0.7
    """Ratio of actual to predicted gain above which the region grows; algorithm 4.1 has ¾."""

    fair: float = 0.4
    """Ratio below which the region shrinks; algorithm 4.1 has ¼. A ratio below 1 comes from the objective's curvature,
    so a poor one foretells a rejected step, which costs a whole equilibrium."""

    well_kept: float = 0.5
    """The region grows only if a step keeps this share of its predicted gain when it is brought within the limits."""

    poorly_kept: float = 0.25
    """It shrinks if the step has kept less than this share: the limits are then too far from linear in it."""

    smallest: float = 1 / 32
    """Below this region the search for a better design ends: after five halvings, each of which cost a trial."""

    largest: float = 3.0
    """Three times the usual step of 0.2 mm, where states are not predicted farther than that at once."""

    ordinary: float = 0.5
    """Half of the step that was asked for. To this size a region grows back from design to design whatever made it
    small, for what was in the way may not matter to the next design. In smaller regions nothing is concluded from a
    small predicted gain, and the sub-problem is not tried for better promises."""


@dataclass(frozen=True)
class ProposalSettings:
    """Which regions the sub-problem is solved in before a trial."""

    filled: float = 0.3
    """A step shorter than this part of its region is ended by the linearised limits. In a smaller region they are
    closer to the true ones, and the step may be thirty times longer."""

    long: float = 0.6
    """Only a step of at least this part of its region shows that the region is too small; twice `filled`."""


@dataclass(frozen=True)
class MotionSettings:
    """How the least smooth motion that satisfies linearised limits is computed."""

    balances: tuple[float, ...] = (2.0, 30.0)
    """Of multipliers and motions, which have one scale where nothing but the motion's own length counts. With the
    first, many rows that ask for nearly the same are met by no longer a motion than needed; where some are not met with
    it, such as those of curvature near poles, iterations go on with the second."""

    iterations: int = 100
    """Most iterations with each. A motion that is stopped early is linearised again like any other."""

    steady: float = 0.01
    """They end where no variable moves by more than this part of the largest one, and rows are met."""


@dataclass(frozen=True)
class RepairSettings:
    """How a design is brought within its limits: by motions, each with newly linearised limits, between certificates.

    Limits may come back within their bounds after more motions and certificates in vain than these; a shorter step
    costs less than those.
    """

    motion: MotionSettings = field(default_factory=MotionSettings)

    accuracy: float = 0.5
    """Fraction of the margins to which limits are met at samples; the rest is for the accuracy of the certificate."""

    met: float = 0.25
    """Fraction of the margins to which a motion meets the linearised limits: half of `accuracy`, which the limits
    themselves are to meet after it."""

    farthest: float = 1.0
    """How far a motion may move a raw variable, as a part of how far the repair may, or of the smallest wall or fold if
    that is less; half as far where a limit is exceeded by its bound. In longer motions limits are far from linear, and
    surfaces may meet whose distance is in no row."""

    motions: int = 16
    """Most motions between two certificates."""

    motions_in_vain: int = 5
    """A search for a design ends after so many motions in a row that make no progress."""

    certificates: int = 7
    """Most certificates; each costs about as much as several motions."""

    certificates_in_vain: int = 2
    """The repair ends after so many certificates that show no progress."""

    progress: float = 0.98
    """Less than this fraction of the least excess before is progress."""

    slight: float = 0.01
    """A certificate that finds limits exceeded by less than this part of their bounds is not in vain: such places are
    few, between samples, and others each time."""

    hopeless: float = 100.0
    """Motions end where a limit is exceeded by this multiple of its bound. A motion may well exceed one by ten times:
    what is quadratic in the control points, such as stretch, then comes down by three quarters with each of the
    next."""

    widest: float = 0.02
    """Largest growth of a margin at a time, as a part of the bound: twice `slight`."""

    reach: float = 0.1
    """Distances up to this far (mm) within their bound are kept as limits during motions: half of a usual step."""

    straight: float = 0.015
    """Distances are linearised again after motions longer than this part of the smallest wall or fold. Until then what
    two walls move along each other changes their distance by less than 0.05 % of it, a quarter of its margin."""

    least: float = -0.05
    """So are other measures above this value, in parts of their bounds, where 0 is the bound."""


@dataclass(frozen=True)
class AcceptanceSettings:
    """When a trial design is accepted."""

    ratio: float = 0.05
    """Least ratio of actual to predicted gain: η of algorithm 4.1, for which theorem 4.6 there asks 0 < η < ¼."""


@dataclass(frozen=True)
class StoppingSettings:
    """When a run ends before the number of designs that was asked for."""

    optimality: float = 0.02
    """Part of the objective's gradient that the limits may leave in an optimal design: a first-order step could gain at
    most this part of what it could gain without limits."""

    designs: int = 5
    """The run has stalled when this many designs ..."""

    progress: float = 0.005
    """... together improve the objective by less than this fraction of it. A step that promises less than its share of
    that, a thousandth, is not worth an equilibrium."""

    reached: float = 1e-3
    """Share of the distance from the targets at the start, or at rest if that is farther, below which they are reached:
    a tenth of what makers of soft robots can measure. Objectives with targets are squares of such distances."""

    negligible: float = 1e-3
    """Of the first objective: below that the fraction is one of this. Once a target is met nothing is left to gain."""


@dataclass(frozen=True)
class TrialSettings:
    """What is spent on the equilibria of a trial design."""

    most_in_contact: int = 40
    """Most factorisations for a task with contact, where what touches changes on the way."""

    most_on_new_mesh: int = 20
    """Most factorisations for a task on a new mesh, to which the state of the same design was carried over."""

    most: int = 8
    """Most factorisations for a task in a part of a step, where prediction leaves 1 to 5 of them: what is not found
    with these is found in shorter parts."""

    stride: float = 3.0
    """Length of the first part of a step, in reference steps, until it is learnt, and at most where the mesh will not
    serve to the end. Nodes of the mesh are moved in parts of this length, too."""

    longest: float = 6.0
    """To which it may grow, and the trust region with it. Six usual steps are more than half of a wall of 2 mm."""

    few: int = 4
    """Most factorisations for a task of a part after which the next one may be longer, or that of the next step."""

    many: int = 6
    """More of them make the first part of the next step shorter. Two parts take at least five."""

    growth: float = 1.5
    """How many times longer the next part is after one with few factorisations, or shorter after one with many."""

    roughest: float = 5.0
    """Residual of a predicted state, over κ/μ and the applied forces, above which a search without contact does not
    begin: it hardly ever ends."""

    halvings: int = 2
    """How often, on the way to a design, a part is halved whose states are not found."""

    bearable: float = 0.002
    """Where no new mesh can be made, one is kept whose worst element has a quality above this: flatter elements break
    warm starts."""

    sound: float = 0.05
    """A mesh of this quality is kept where a new one would need elements smaller than `finer`."""

    finer: float = 0.8
    """Smallest elements of a new mesh, over `mesh.size` or over those of the mesh, while that is sound. Half the size
    has eight times as many: a design would take longer than all before."""


@dataclass(frozen=True)
class CoarseSettings:
    """How long a run stays on elements larger than those asked for, see `coarse.py`."""

    factor: float = 1.5
    """Their size over the one asked for. There are a third to a quarter as many; motions are some per cent smaller."""

    share: float = 0.75
    """Share of a run's designs that are on them. The others come near the limits on states again, which depend on the
    mesh."""

    fewest: int = 8
    """Runs of fewer designs have none of them, since hardly any would be left on those asked for."""

    least: int = 1500
    """Larger elements below which there are none: most of the time goes into steps then, not into states, and on so few
    elements steps gain less than they could. On 1,191 of them `twisting` is at 225° after 25 designs, not 279°."""

    misfit: float = 0.1
    """Share of what targets were missed by at first, below which smaller elements decide."""

    most: int = 12
    """Most factorisations for a task on the smaller ones, to which the state of the same design is carried over: where
    it is found that takes two to nine, and an earlier shape is nearer than a state that takes many."""

    left: float = 6.0
    """Designs for which there has to be time: the first one on a new mesh takes as long as two or three."""


@dataclass(frozen=True)
class LoopSettings:
    """All settings of the design loop."""

    radius: RadiusSettings = field(default_factory=RadiusSettings)
    proposal: ProposalSettings = field(default_factory=ProposalSettings)
    repair: RepairSettings = field(default_factory=RepairSettings)
    acceptance: AcceptanceSettings = field(default_factory=AcceptanceSettings)
    stopping: StoppingSettings = field(default_factory=StoppingSettings)
    trial: TrialSettings = field(default_factory=TrialSettings)
    coarse: CoarseSettings = field(default_factory=CoarseSettings)
    looked_at: bool = True
    """Whether the last design is looked at beyond what designing needs: how it inflates, its rates and margins, the
    error of the mesh and what thicker walls do. On small meshes that takes as long as several designs."""
    until: float = math.inf
    """Time (s, of `time.time`) at which runs end, to half a design: one that would end later by more is not begun."""
    seconds: float = math.inf
    """The same from the beginning of the run on, for members of a study."""
    castings: int = 5
    """Designs after which perturbed castings are chosen again, which costs their states once more and forgets the
    objective's curvature."""
