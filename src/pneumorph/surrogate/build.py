"""Builds a fast model: samples exact states until polynomials predict states that they do not know well enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from pneumorph.doing import doing
from pneumorph.errors import Hopeless
from pneumorph.interrupts import stop_if_asked
from pneumorph.surrogate.domain import Domain, whole
from pneumorph.surrogate.modes import Modes, modes_of
from pneumorph.surrogate.polynomials import chosen, fitted, values_of
from pneumorph.surrogate.states import Missing, Sample, nearest_first

HELD_OUT = 16
"""Random states that are predicted before they are learnt. A new one is predicted worse than all of them with a
probability of 1 in 17."""

SOFT = 4.0
"""Error of the compliance that is allowed, as a multiple of that of motions: its derivatives are not known."""

LEAST = {"mm": 0.1, "rad": 0.002, "mm3": 1.0}
"""Ranges in mm, rad and mm³ below which values count as constant."""

RELATIVE = ("compliance", "stretch")
"""Errors that are parts already."""

MOST_CUTS = 12
"""Boxes that are cut where states are missing, before what is left is taken for unknown."""


class Sampler(Protocol):
    """What finds states, one after another or several at a time; see `states.States`."""

    names: tuple[str, ...]
    bounds: np.ndarray
    at_once: int
    solved: int
    factorisations: int
    dofs: int

    def all_searched(self, points: Sequence[np.ndarray], base: np.ndarray) -> list[Sample | Missing]: ...


@dataclass(frozen=True)
class Group:
    """Values that have an error in common: their name with the unit, and where they are."""

    name: str
    rows: slice


@dataclass(frozen=True, eq=False)
class Fit:
    """Polynomials of the pressures.

    Attributes
    ----------
    domain : Domain
    index, coefficients : (t, C), (t, k)
    soft_index, soft_coefficients : (s, C), (s, 21)
        Of the lower triangle of the compliance.
    modes : Modes or None
        What the surfaces look like, where the samples have been looked at.
    """

    domain: Domain
    index: np.ndarray
    coefficients: np.ndarray
    soft_index: np.ndarray
    soft_coefficients: np.ndarray
    modes: Modes | None = None

    def values(self, pressures: np.ndarray) -> np.ndarray:
        """Values (n, k) at pressures (n, C)."""
        return values_of(_scaled(self.domain, pressures), self.index) @ self.coefficients

    def soft(self, pressures: np.ndarray) -> np.ndarray:
        """Compliances, packed (n, 21)."""
        return values_of(_scaled(self.domain, pressures), self.soft_index) @ self.soft_coefficients


@dataclass(frozen=True, eq=False)
class Built:
    """A fast model and what is known of it.

    Attributes
    ----------
    fit : Fit
    errors, ranges : {group: float}
        Largest error of states that the fit does not know, and the largest range of a value of each group over all
        samples. The compliance has a relative error; "shape_mm" is that of the places of all nodes of the surfaces,
        and "stretch" that of stretches there.
    samples, held_out : lists of Sample
    missing : list of Missing
    solved, factorisations, dofs : the cost, and the size of the body's mesh.
    """

    fit: Fit
    errors: dict[str, float]
    ranges: dict[str, float]
    samples: list[Sample]
    held_out: list[Sample]
    missing: list[Missing] = field(default_factory=list)
    solved: int = 0
    factorisations: int = 0
    dofs: int = 0

    def worst(self) -> float:
        """The largest error of motions, volumes, sections and shape relative to their range."""
        return max(self.errors[name] / self.ranges[name] for name in self.errors if name not in RELATIVE)


def groups_of(chambers: int, sections: int) -> list[Group]:
    """The groups of values of a model; sections are told together."""
    found = [Group("translation_mm", slice(0, 3)), Group("rotation_rad", slice(3, 6))]
    found.append(Group("volume_mm3", slice(6, 6 + chambers)))
    for number in range(sections):
        first = 6 + chambers + 6 * number
        found.append(Group(f"section_{number + 1}_mm", slice(first, first + 3)))
        found.append(Group(f"section_{number + 1}_rad", slice(first + 3, first + 6)))
    return found


def build(
    states: Sampler,
    groups: list[Group],
    tolerance: float,
    most: int,
    said: Callable[[str], None] = lambda text: None,
) -> Built:
    """Sample states and fit polynomials until the error is small enough.

    Parameters
    ----------
    states : where they come from.
    groups : of the values.
    tolerance : largest error, relative to the range of a group.
    most : most states that are solved.
    said : told how far it is, in a line.

    Raises
    ------
    Hopeless
        If there is no stable state within the bounds.
    """
    search, rng = _Search(states), np.random.default_rng(1)
    with doing("sampling states") as far:
        search.find_domain(far)
        if not search.samples:
            raise Hopeless("no stable state was found within the bounds of the pressures; lower them")
        batch = HELD_OUT // 2 * (1 + len(states.bounds) // 3)
        search.add(search.domain.drawn(batch, rng, dense=True), far)
        while True:
            fit = fit_of(search.domain, search.samples, groups, tolerance)
            known, cuts = list(search.samples), len(search.missing)
            held = search.add(search.domain.drawn(HELD_OUT, rng), far)
            if cuts < len(search.missing):
                said(f"no stable state at {len(search.missing)} pressures: the domain is cut")
                search.find_domain(far)
                continue
            built = _measured(fit, groups, known, held, search)
            enough = built.worst() <= tolerance and built.errors["compliance"] <= SOFT * tolerance
            said(f"{len(known)} states learnt, {len(held)} predicted: {100 * built.worst():.2g} % off")
            if enough or states.solved >= most:
                return built
            search.add(search.domain.drawn(batch, rng, dense=True), far)


class _Search:
    """What is known of states so far."""

    def __init__(self, states: Sampler) -> None:
        self.states = states
        self.domain = whole(states.bounds)
        self.samples: list[Sample] = []
        self.missing: list[Missing] = []

    def find_domain(self, far: Callable[[str], None]) -> None:
        """Sample the corners of the domain, and cut it until all of them have a state.

        Raises
        ------
        Hopeless
            If nothing is left of it.
        """
        if not self.samples:
            self.add(self.domain.base[None], far)
        while new := [corner for corner in self.domain.corners if not self._is_known(corner)]:
            if len(self.missing) < MOST_CUTS:
                self.add(np.array(new[: self.states.at_once]), far)
            else:
                # What is known for certain are the boxes to all states.
                every = np.array([each.pressures for each in self.samples])
                self.domain = self.domain.with_corners(every[self.domain.holds(every)])
        if not len(self.domain.corners):
            raise Hopeless("no stable state was found within the bounds of the pressures; lower them")

    def _is_known(self, corner: np.ndarray) -> bool:
        size = self.domain.size
        return any(np.abs(each.pressures - corner).max() <= 1e-9 * size.max() for each in self.samples)

    def add(self, points: np.ndarray, far: Callable[[str], None]) -> list[Sample]:
        """Sample states at points (n, C); those that are found."""
        found = []
        known = np.array([each.pressures for each in self.samples]).reshape(-1, points.shape[1])
        ordered = nearest_first(points, known, self.domain.size)
        for first in range(0, len(ordered), self.states.at_once):
            stop_if_asked()
            far(f"state {self.states.solved + 1}, {first + 1} of {len(points)} of this set")
            batch = [
                point for point in ordered[first : first + self.states.at_once] if self.domain.holds(point[None])[0]
            ]
            for answer in self.states.all_searched(batch, self.domain.base):
                if isinstance(answer, Sample):
                    found.append(answer)
                elif self.domain.holds(answer.pressures[None])[0]:
                    self.missing.append(answer)
                    stable = self.domain.base if answer.last is None else answer.last.pressures
                    self.domain = self.domain.cut(stable, answer.pressures)
                    if answer.last is not None:
                        self.samples.append(answer.last)
        self.samples += found
        return found


def fit_of(domain: Domain, samples: list[Sample], groups: list[Group], tolerance: float) -> Fit:
    """The polynomials that fit samples best; the tolerance says how many modes there are."""
    x = _scaled(domain, np.array([each.pressures for each in samples]))
    values = np.array([each.values for each in samples])
    slopes = np.array([each.slopes for each in samples]).transpose(0, 2, 1) * domain.size[:, None] / 2
    ranges, scale = _ranges(values, groups), np.ones(values.shape[1])
    for group in groups:
        scale[group.rows] = ranges[group.name]
    index = chosen(x, values / scale, slopes / scale)
    soft = np.array([each.compliance[np.tril_indices(6)] for each in samples])
    typical = np.abs(soft).max(axis=0) + 1e-300
    soft_index = chosen(x, soft / typical, None)
    modes = modes_of(x, domain.size, samples, tolerance)
    return Fit(domain, index, fitted(x, values, slopes, index), soft_index, fitted(x, soft, None, soft_index), modes)


def _measured(fit: Fit, groups: list[Group], known: list[Sample], held: list[Sample], search: _Search) -> Built:
    pressures = np.array([each.pressures for each in held])
    values = np.array([each.values for each in held])
    every = np.array([each.values for each in search.samples])
    off = fit.values(pressures) - values
    errors = {}
    for group in groups:
        part = off[:, group.rows]
        size = np.abs(part) if group.name.startswith("volume") else np.linalg.norm(part, axis=1)
        errors[group.name] = float(size.max())
    errors["compliance"] = max(map(_relative, fit.soft(pressures), (each.compliance for each in held)))
    ranges = _ranges(every, groups)
    if fit.modes is not None:
        looks = [fit.modes.at(each) for each in _scaled(fit.domain, pressures)]
        parts = [look - each.look for look, each in zip(looks, held, strict=True) if each.look is not None]
        errors["shape_mm"] = max(float(np.linalg.norm(each[:, :3], axis=1).max()) for each in parts)
        errors["stretch"] = max(float(np.abs(each[:, 3]).max()) for each in parts)
        ranges["shape_mm"] = _spread([each.look[:, :3] for each in search.samples if each.look is not None])
    states = search.states
    cost = states.solved, states.factorisations, states.dofs
    return Built(fit, errors, ranges, known, held, list(search.missing), *cost)


def _relative(packed: np.ndarray, exact: np.ndarray) -> float:
    """The error of a compliance, in units in which the exact one has ones on its diagonal."""
    full = np.zeros((6, 6))
    full[np.tril_indices(6)] = packed
    full = full + np.tril(full, -1).T
    held = np.diag(exact) <= 0.0
    scale = np.where(held, 0.0, 1.0 / np.sqrt(np.where(held, 1.0, np.diag(exact))))
    return float(np.linalg.norm(scale[:, None] * (full - exact) * scale, 2))


def _ranges(values: np.ndarray, groups: list[Group]) -> dict[str, float]:
    spans = {group.name: float(np.ptp(values[:, group.rows], axis=0).max()) for group in groups}
    return {name: max(span, LEAST[name.rpartition("_")[2]]) for name, span in spans.items()}


def _spread(places: list[np.ndarray]) -> float:
    """The largest range of a coordinate of a node, mm."""
    spans = np.maximum.reduce(places) - np.minimum.reduce(places)
    return max(float(spans.max()), LEAST["mm"])


def _scaled(domain: Domain, pressures: np.ndarray) -> np.ndarray:
    return 2.0 * (pressures - domain.bounds[:, 0]) / domain.size - 1.0
