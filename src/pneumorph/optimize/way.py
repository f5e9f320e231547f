"""The way from a design to the next, along which its states are followed in parts.

A prediction of first order misses what is quadratic in the step: over a long step it leads to no state, or needs many
factorisations, while in parts each takes a few. Plain elements follow a parabola through the two states before, which
misses what is cubic. How long the first part may be is learnt from step to step, as in the continuation of a path
(Allgower & Georg 2003, Introduction to Numerical Continuation Methods, chapter 6).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, SelfIntersecting, analyse, carry_over, predict_states
from pneumorph.mechanics import Guess, NoEquilibrium
from pneumorph.mesh import between, poor, relax, slide
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.optimize.settings import TrialSettings
from pneumorph.optimize.setup import Setup


@dataclass(frozen=True, eq=False)
class Place:
    """A design on a way, with its mesh and states; `share` is how much of the way it is from the beginning."""

    disc: Discretisation
    analysis: Analysis
    share: float = 0.0


@dataclass(frozen=True, eq=False)
class Way:
    """The straight way to a new design.

    Attributes
    ----------
    setup : Setup
    begin : Place
    end : Discretisation
        The mesh of the new design: the one at the beginning, perhaps with nodes that were moved.
    phi : (n,) array
        The new design.
    """

    setup: Setup
    begin: Place
    end: Discretisation
    phi: np.ndarray

    @property
    def length(self) -> float:
        """The largest change of a variable, in reference steps."""
        return float(np.abs(self.phi - self.begin.analysis.phi).max()) / self.setup.reference

    def design(self, share: float) -> np.ndarray:
        """The design (n,) at a share of the way."""
        begin = self.begin.analysis.phi
        return begin + share * (self.phi - begin) if share < 1.0 else self.phi

    def mesh(self, share: float, here: Place) -> Discretisation:
        """The mesh at a share of the way, from a place on it; nodes move straight, unless elements fold."""
        if share == 1.0:
            return self.end
        part = (share - here.share) / (1.0 - here.share)
        disc = replace(self.end, morph=between(here.disc.morph, self.end.morph, part))
        points = self.setup.space.control_points(self.design(share))
        return disc if quality(disc, points) > self.setup.settings.trial.bearable else with_moved_nodes(disc, points)

    def predicted(self, there: Discretisation, share: float, here: Place, last: Place | None) -> dict[str, Guess]:
        """The states at a share of the way, by those of one place on it or of two, the `last` of which was before."""
        before = None if last is None else (last.analysis, (last.share - here.share) / (share - here.share))
        return predict_states(self.setup.space, there, here.analysis, self.design(share), before)


@dataclass(frozen=True, eq=False)
class Followed:
    """How far states were followed along a way.

    Attributes
    ----------
    disc : Discretisation
        The mesh, with nodes where they are at the last design with states.
    found : Analysis or NoEquilibrium
        That design; or why none was found after it, such as that the body would intersect itself.
    stride : float
        How long the first part of the next way may be, in reference steps.
    reached : float
        How much of the way had states; if no part of it had, how much may still have.
    last : Place, optional
        The place before that design.
    """

    disc: Discretisation
    found: Analysis | NoEquilibrium
    stride: float
    reached: float = 1.0
    last: Place | None = None

    @property
    def here(self) -> Place:
        """The last design with states."""
        if isinstance(self.found, NoEquilibrium):
            raise ValueError("no states were found")
        return Place(self.disc, self.found, self.reached)


def follow(way: Way, stride: float) -> Followed:
    """Follow the states to the new design, from a first part of length `stride` on, in reference steps."""
    return _along(way, stride) if way.end.model.contact is None else _at_once(way, stride)


def before_last_part(way: Way, stride: float) -> Followed:
    """Follow the states to where the last part would begin, or to where the mesh folds; see `follow`."""
    if way.end.model.contact is None:
        return _along(way, stride, before_last=True)
    return Followed(way.begin.disc, way.begin.analysis, stride, 0.0)


def _along(way: Way, stride: float, before_last: bool = False) -> Followed:
    """Follow the states in parts: after one that took few factorisations the next may be longer.

    Where a part has no state, or it takes too many, it is tried with half of its length. Where elements of the mesh
    would fold, the rest of the way is one part. Where the body would intersect itself the way ends.

    Parameters
    ----------
    way : to the new design.
    stride : length of the first part, in reference steps.
    before_last : whether to stop before the last part, or before the mesh folds.
    """
    setup, settings, length = way.setup, way.setup.settings.trial, way.length
    last, here, part, halved = None, way.begin, stride / max(length, 1e-300), 0
    while here.share < 1.0:
        part = _without_rest(part, 1.0 - here.share)
        share = here.share + part if part < 1.0 - here.share else 1.0
        there, phi = way.mesh(share, here), way.design(share)
        folded = share < 1.0 and quality(there, setup.space.control_points(phi)) < settings.bearable
        if before_last and (folded or share == 1.0):
            break
        if folded:
            # At the end they do not.
            part, share, there, phi = 1.0 - here.share, 1.0, way.end, way.phi
        starts = way.predicted(there, share, here, last)
        tried = _analysed(way, there, phi, starts)
        if isinstance(tried, SelfIntersecting):
            return Followed(there, tried, stride, here.share, last)
        first = here is way.begin
        if not isinstance(tried, NoEquilibrium):
            taken = _most_taken(tried)
            if first:
                stride = _after_first(settings, stride, part * length, taken)
            last, here = here, Place(there, tried, share)
            part *= settings.growth if taken <= settings.few else 1.0
            continue
        part /= 2
        stride = part * length if first else min(stride, part * length)
        if folded or halved == settings.halvings:
            # If there was none at all, half of the shortest part that was tried may still have one.
            return Followed(way.end, tried, stride, here.share or part, last)
        halved += 1
    return Followed(here.disc, here.analysis, stride, here.share, last)


def _analysed(way: Way, disc: Discretisation, phi: np.ndarray, starts: Mapping[str, Guess]) -> Analysis | NoEquilibrium:
    """A design (n,) on a way on its mesh, without contact, with what is spent on a part of a step."""
    setup, settings, apart = way.setup, way.setup.settings.trial, way.begin.analysis
    spent = {"most": settings.most, "roughest": settings.roughest}
    return analyse(setup.problem, setup.space, disc, phi, starts, apart=apart, **spent)


def _without_rest(part: float, left: float) -> float:
    """The length of a part: as long as was learnt, or all that is left where that is little more.

    What is left is not shared out evenly: whether a longer part serves is only known where it is tried.
    """
    return left if part > left / 1.2 else part


def _after_first(settings: TrialSettings, stride: float, first: float, taken: int) -> float:
    """How long the first part of the next way may be, in reference steps, after one that took so many factorisations.

    Parameters
    ----------
    settings : of trials.
    stride : how long this one might have been.
    first : how long it was.
    taken : factorisations, of the task with the most.
    """
    if taken <= settings.few:
        return min(max(stride, settings.growth * first), settings.longest)
    return first if taken <= settings.many else first / settings.growth


def _most_taken(found: Analysis) -> int:
    """Factorisations of the task with the most."""
    return max(equilibrium.factorisations for equilibrium in found.equilibria.values())


def _at_once(way: Way, stride: float) -> Followed:
    """The states at the end of a way with contact, where the search goes in steps of its own."""
    setup, most = way.setup, way.setup.settings.trial.most_in_contact
    starts, near = way.predicted(way.end, 1.0, way.begin, None), way.begin.analysis
    found = analyse(setup.problem, setup.space, way.end, way.phi, starts, most=most, near=near, apart=near)
    if not isinstance(found, NoEquilibrium):
        stride = _after_first(setup.settings.trial, stride, way.length, _most_taken(found))
    return Followed(way.end, found, stride)


def follow_on(way: Way, known: Followed, new: Discretisation, starts: Mapping[str, Guess]) -> Followed:
    """Follow the states to the new design on a new mesh: at once, or else in parts.

    Parameters
    ----------
    way : on the mesh before.
    known : how far that served.
    new : the mesh.
    starts : the states that are predicted for the new design, on it.
    """
    setup, settings, here, stride = way.setup, way.setup.settings.trial, known.here, known.stride
    apart = way.begin.analysis
    if new.model.contact is not None:
        most = settings.most_in_contact
        return Followed(new, analyse(setup.problem, setup.space, new, way.phi, starts, apart=apart, most=most), stride)
    found = _analysed(way, new, way.phi, starts)
    if isinstance(found, Analysis | SelfIntersecting):
        return Followed(new, found, stride)
    starts, most = states_on(here, new), settings.most_on_new_mesh
    again = analyse(setup.problem, setup.space, new, here.analysis.phi, starts, apart=apart, most=most)
    if isinstance(again, NoEquilibrium):
        return Followed(new, again, stride)
    rest = _along(Way(setup, Place(new, again), new, way.phi), stride)
    return replace(rest, reached=here.share + (1.0 - here.share) * rest.reached)


def states_on(
    here: Place, new: Discretisation, ahead: tuple[np.ndarray, Mapping[str, Guess]] | None = None
) -> dict[str, Guess]:
    """The states of an analysed design, or those predicted from it, on a new mesh.

    Parameters
    ----------
    here : the design on its mesh.
    new : the new mesh.
    ahead : see `carry_over`.
    """
    now = here.analysis
    states = {name: equilibrium.state for name, equilibrium in now.equilibria.items()}
    return carry_over(here.disc, now.X, states, new, new.morph.positions(now.points), ahead)


def with_moved_nodes(disc: Discretisation, points: np.ndarray) -> Discretisation:
    """The mesh with nodes moved so that elements are less poor at the control points (n_points, 3)."""
    disc = replace(disc, morph=relax(disc.morph, points))
    if disc.model.contact is None and poor(disc.morph, points):
        disc = replace(disc, morph=slide(disc.morph, points))
    return disc


def quality(disc: Discretisation, points: np.ndarray) -> float:
    """Quality of the worst element of the mesh moved to these control points."""
    return float(scaled_jacobian(disc.morph.positions(points), disc.morph.mesh.tets).min())
