"""Pressures and motions over time, where chambers are filled from a supply through tubes.

Air at constant temperature. With the absolute pressure P_c of chamber c, its volume V_c and the mass flow m_c into it,

    d(P_c V_c)/dt = R T m_c(supply, P_c),    dV_c/dt = Σ_j C_cj dP_j/dt,    C = ∂V/∂p

with the exact C of the equilibria: the body is without inertia. Within a step, volumes are cubic on the way between the
equilibria at its ends, with the volumes and C of both (Hermite). What flows in fixes the amounts of air, and they fix
the pressures at the end, with the volumes found there: no air is lost from step to step.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from pneumorph import units
from pneumorph.analysis.airflow import GAS, Tube
from pneumorph.analysis.explore import Explorer
from pneumorph.analysis.steps import step_of
from pneumorph.errors import ProblemError
from pneumorph.interrupts import stop_if_asked
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mechanics.assembly.enclosed import STANDARD
from pneumorph.results import SweepStep
from pneumorph.sensitivity import measured_of, response

NEAR = 1e-4
"""Pressures are found when they change by less, over the largest of the supply."""
LEAST = 1e-7
"""Gauge pressures below this share of the same are none."""
FINEST = 64
"""A step is halved until it is found; below this part of it the last pressures are the last that can be found."""
BENT, LEAST_BENT = 0.25, 1e-3
"""A step is halved where the parabola misses the change of a volume by more than this share of it, and the volume by
more than the second."""
TRIES = 5
"""Of the pressures at the end of a step, before it is halved."""
MOST_TIMES = 10_000
"""Of a simulation: more are taken for a mistake of a unit."""

_TIMES = re.compile(rf"\s*({units.NUMBER}):({units.NUMBER}):({units.NUMBER})\s*(\S.*)")


@dataclass(frozen=True, eq=False)
class Profile:
    """Pressure of a supply, linear between points of time, and constant before the first and after the last.

    Attributes
    ----------
    times : (n,) s
        Not falling; where two are equal, the pressure jumps.
    pressures : (n,) MPa
    """

    times: np.ndarray
    pressures: np.ndarray

    def at(self, time: float) -> float:
        """The pressure, MPa; at a jump, that after it."""
        number = int(np.searchsorted(self.times, time, side="right"))
        if number in (0, len(self.times)):
            return float(self.pressures[min(number, len(self.times) - 1)])
        (t0, t1), (p0, p1) = self.times[number - 1 : number + 1], self.pressures[number - 1 : number + 1]
        return float(p0 + (p1 - p0) * (time - t0) / (t1 - t0))


@dataclass(frozen=True, eq=False)
class Supplied:
    """A moment.

    Attributes
    ----------
    step : SweepStep
        The equilibrium, with its time, or why there is none.
    supply : {chamber: MPa}
    flow : {chamber: t/s}
        Mass flow of air into each supplied chamber.
    """

    step: SweepStep
    supply: Mapping[str, float]
    flow: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class _Moment:
    """An equilibrium: gauge pressures (k,) of the supplied chambers, their volumes (k,) in mm³ and C (k, k) per MPa."""

    step: SweepStep
    pressure: np.ndarray
    volume: np.ndarray
    slope: np.ndarray


@dataclass(frozen=True, eq=False)
class Supplies:
    """What chambers are filled from.

    Attributes
    ----------
    profiles : {chamber: Profile}
    tubes : {chamber: Tube}
    others : {chamber: MPa}
        Constant pressures of other chambers.
    """

    profiles: Mapping[str, Profile]
    tubes: Mapping[str, Tube]
    others: Mapping[str, float]

    def pressures(self, time: float) -> np.ndarray:
        """Of the supplies (k,), MPa."""
        return np.array([profile.at(time) for profile in self.profiles.values()])

    def flows(self, time: float, pressure: np.ndarray) -> np.ndarray:
        """Mass flows (k,) into chambers with these gauge pressures (k,), t/s."""
        supply = self.pressures(time)
        return np.array(
            [
                tube.flow(float(there) + STANDARD, float(here) + STANDARD)
                for tube, there, here in zip(self.tubes.values(), supply, pressure, strict=True)
            ]
        )

    @property
    def jumps(self) -> list[float]:
        """Times at which a pressure of a supply jumps or bends."""
        return sorted({float(time) for profile in self.profiles.values() for time in profile.times})

    @property
    def largest(self) -> float:
        """Of all pressures, over none, MPa."""
        return max(float(np.abs(profile.pressures).max()) for profile in self.profiles.values())


def supplied(
    explorer: Explorer, supplies: Supplies, times: np.ndarray, start: Mapping[str, float]
) -> Iterator[Supplied]:
    """The equilibria at times, from chambers with given pressures at the first; it ends with one that is not found.

    Parameters
    ----------
    explorer : of the body.
    supplies : Supplies
    times : (n,) s, rising.
    start : {chamber: MPa}
        Gauge pressures of the supplied chambers at the first time.
    """
    filling = _Filling(explorer, supplies)
    now = filling.at(np.array([start.get(name, 0.0) for name in supplies.profiles]))
    yield filling.moment(float(times[0]), now)
    for begin, end in pairwise(times.tolist()):
        if isinstance(now, SweepStep):
            return
        tiny = 1e-9 * (end - begin)
        stops = [begin, *(time for time in supplies.jumps if begin + tiny < time < end - tiny), end]
        for one, other in pairwise(stops):
            if isinstance(now, _Moment):
                now = filling.after(now, one, other, (other - one) / FINEST)
        yield filling.moment(end, now)


class _Filling:
    """Finds the moments one after another."""

    def __init__(self, explorer: Explorer, supplies: Supplies) -> None:
        self._explorer, self._supplies = explorer, supplies
        self._names = tuple(supplies.profiles)
        # Unlike each other, so that all are solved on the same mesh whatever they are.
        count = len(explorer.problem.body.chamber)
        self._like = {each.name: (1 + k) / count for k, each in enumerate(explorer.problem.body.chamber)}
        self._measured = None

    def moment(self, time: float, found: _Moment | SweepStep) -> Supplied:
        supply = dict(zip(self._names, self._supplies.pressures(time).tolist(), strict=True))
        if isinstance(found, SweepStep):
            return Supplied(replace(found, time=time), supply, {})
        flow = dict(zip(self._names, self._supplies.flows(time, found.pressure).tolist(), strict=True))
        return Supplied(replace(found.step, time=time), supply, flow)

    def at(self, pressure: np.ndarray) -> _Moment | SweepStep:
        """The equilibrium at gauge pressures (k,) of the supplied chambers, or the step that says why there is none."""
        stop_if_asked()
        given = {each.name: 0.0 for each in self._explorer.problem.body.chamber} | dict(self._supplies.others)
        pressure = np.where(np.abs(pressure) < LEAST * self._supplies.largest, 0.0, pressure)
        given |= dict(zip(self._names, pressure.tolist(), strict=True))
        # Once a state is known, the next one is beside it or not there.
        at, answer, tangent = self._explorer.solved(given, self._like, near=self._measured is not None)
        whole = self._explorer.whole(self._like)
        step = step_of(self._explorer.problem.task[0].name, given, at, answer, self._explorer.skin(self._like), whole)
        if isinstance(answer, NoEquilibrium):
            return step
        state = answer.state
        if whole is not None:
            at, tangent, state = whole.configuration(at), whole.tangent, whole.state(state)
        self._measured = self._measured or measured_of(shift=np.asarray(at.loads.shift))
        found = response(at, tangent, state, self._measured)
        own = np.array([at.model.chambers.index(name) for name in self._names])
        return _Moment(step, pressure, found.values[6 + own], found.by_pressure[6 + own][:, own])

    def after(self, now: _Moment, begin: float, end: float, least: float) -> _Moment | SweepStep:
        """The moment at `end`, from that at `begin`, in halves where it is not found at once."""
        found: _Moment | SweepStep = now
        pressure, _ = self._flowed(now, begin, end)
        for _ in range(TRIES):
            found = self.at(pressure)
            if isinstance(found, SweepStep) or not _are_near(now, found):
                break
            _, amount = self._flowed(now, begin, end, found)
            total = pressure + STANDARD
            missing = amount - total * found.volume
            change = np.linalg.solve(np.diag(found.volume) + total[:, None] * found.slope, missing)
            if np.abs(change).max() <= NEAR * self._supplies.largest:
                return found
            pressure = pressure + change
        if end - begin <= least:
            step = found if isinstance(found, SweepStep) else found.step
            return SweepStep(step.task, step.pressures, converged=False, reason=LOST)
        middle = (begin + end) / 2
        half = self.after(now, begin, middle, least)
        return self.after(half, middle, end, least) if isinstance(half, _Moment) else half

    def _flowed(
        self, now: _Moment, begin: float, end: float, then: _Moment | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gauge pressures (k,) at `end`, and amounts of air P V (k,) in N·mm.

        Volumes are those on the way to `then`, an equilibrium near that at the end; else C is that of `now` everywhere.
        """
        k, inside = len(now.pressure), 1e-9 * (end - begin)
        way = np.zeros(k) if then is None else then.pressure - now.pressure
        bend = np.zeros((k, k)) if then is None else then.slope - now.slope
        left = np.zeros(k) if then is None else _bent(now, then)
        length = float(way @ way)

        def rates(time: float, y: np.ndarray) -> np.ndarray:
            moved = y[:k] - now.pressure
            share = float(np.clip(moved @ way / length, 0.0, 1.0)) if length else 0.0
            mean = now.slope + 0.5 * share * bend
            volume = now.volume + mean @ moved + share**2 * (3.0 - 2.0 * share) * left
            # The derivative of exactly this volume, so that what flows in is what is there.
            slope = mean
            if 0.0 < share < 1.0:
                slope = mean + np.outer(0.5 * bend @ moved + 6.0 * share * (1.0 - share) * left, way) / length
            total = y[:k] + STANDARD
            # At a jump, the pressure on this side of it counts.
            flow = GAS * self._supplies.flows(float(np.clip(time, begin + inside, end - inside)), y[:k])
            return np.concatenate([np.linalg.solve(np.diag(volume) + total[:, None] * slope, flow), flow])

        start = np.concatenate([now.pressure, (now.pressure + STANDARD) * now.volume])
        size = np.concatenate([np.full(k, self._supplies.largest), np.abs(start[k:])])
        ends = solve_ivp(rates, (begin, end), start, method="LSODA", rtol=1e-8, atol=1e-9 * size).y[:, -1]
        return ends[:k], ends[k:]


def _are_near(one: _Moment, other: _Moment) -> bool:
    """Whether volumes between two equilibria follow from both, which they do not near a pressure that has a maximum."""
    bent = np.abs(_bent(one, other))
    return bool((bent <= np.maximum(BENT * np.abs(other.volume - one.volume), LEAST_BENT * one.volume)).all())


def _bent(one: _Moment, other: _Moment) -> np.ndarray:
    """What a cubic of the volumes (k,) between two equilibria has beyond a parabola with the slopes at both, mm³."""
    return other.volume - one.volume - 0.5 * (one.slope + other.slope) @ (other.pressure - one.pressure)


LOST = "no state was found beyond these pressures; where a body balloons, give volumes (simulate --volume A=0:12:1ml)"


def read_profiles(given: Mapping[str, str], chambers: Sequence[str]) -> dict[str, Profile]:
    """Profiles from {"A": "100 kPa"} or {"A": "0 kPa @ 0 s, 100 kPa @ 0.5 s"}.

    Raises
    ------
    ProblemError
        If there is none, a chamber is unknown, or a text is no profile.
    """
    if not given:
        raise ProblemError('supply: no chamber has one; write e.g. A="100 kPa"')
    profiles = {}
    for name, text in given.items():
        if name not in chambers:
            raise ProblemError(f'supply {name}={text}: there is no chamber "{name}"; use one of {", ".join(chambers)}')
        profiles[name] = _profile(f"supply {name}", str(units.text_of(text)))
    return profiles


def _profile(key: str, text: str) -> Profile:
    points = [part.split("@") for part in text.split(",")]
    if len(points) > 1 and not all(len(point) == 2 for point in points):
        raise ProblemError(f'{key}: "{text}" has points without a time; write e.g. "0 kPa @ 0 s, 100 kPa @ 0.5 s"')
    try:
        pressures = np.array([units.parse(point[0].strip(), units.PRESSURE) for point in points])
        times = np.array([units.parse(point[1].strip(), units.TIME) if len(point) == 2 else 0.0 for point in points])
    except ValueError as error:
        raise ProblemError(f"{key}: {error}") from None
    if (np.diff(times) < 0.0).any():
        raise ProblemError(f'{key}: points of "{text}" are not in the order of their times; put them in that order')
    if (pressures <= -STANDARD).any():
        raise ProblemError(f'{key}: "{text}" is below a vacuum; use pressures above {-1e3 * STANDARD:g} kPa')
    return Profile(times, pressures)


def read_times(text: str) -> np.ndarray:
    """Times (s) from "0:2:0.05 s".

    Raises
    ------
    ProblemError
        If it is not a start, a stop and a step.
    """
    match = _TIMES.fullmatch(text)
    if match is None:
        raise ProblemError(f'times: "{text}" is not a start, a stop and a step; write e.g. 0:2:0.05s')
    *numbers, unit = match.groups()
    try:
        start, stop, step = (units.parse(f"{number} {unit}", units.TIME) for number in numbers)
    except ValueError as error:
        raise ProblemError(f"times: {error}") from None
    if not (step > 0.0 and stop > start):
        raise ProblemError(f'times: "{text}" does not go on; write e.g. 0:2:0.05s')
    if (stop - start) / step > MOST_TIMES:
        raise ProblemError(f"times: are more than {MOST_TIMES}; use a larger step")
    return start + step * np.arange(int((stop - start) / step + 1e-9) + 1)
