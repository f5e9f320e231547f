"""What a design does over time, filled from a supply through tubes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pneumorph.analysis import Curve, Explorer
from pneumorph.analysis.airflow import STANDARD_DENSITY, Tube, read_tube
from pneumorph.analysis.pressures import TIME, pressure_paths
from pneumorph.analysis.supply import Supplied, Supplies, read_profiles, read_times, supplied
from pneumorph.errors import ProblemError
from pneumorph.mechanics.assembly.enclosed import STANDARD
from pneumorph.output.sweeps import csv_text
from pneumorph.results import SweepStep, to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PER_MINUTE = 60.0 / STANDARD_DENSITY / 1e6
"""Litres per minute of air at standard conditions in 1 t/s."""
REACHED = 0.95
"""Share of the way to its farthest pressure at which a chamber counts as filled."""


@dataclass(frozen=True, eq=False, repr=False)
class OverTime:
    """Pressures, motions and flows at moments.

    Attributes
    ----------
    title : str
        Of the problem.
    tubes : {chamber: Tube}
        Through which chambers are filled.
    moments : sequence of Supplied

    Examples
    --------
    >>> import pneumorph as pm
    >>> best = pm.open_run("runs/small").best
    >>> filled = best.over_time({"A": "20 kPa"}, tube="1 mm x 1 m", times="0:0.2:0.1 s")
    >>> [round(step.pressures["A"], 2) for step in filled.steps][0], filled.steps[-1].pressures["A"] > 0.0
    (0.0, True)
    """

    title: str
    tubes: Mapping[str, Tube]
    moments: Sequence[Supplied]

    @property
    def steps(self) -> list[SweepStep]:
        """The equilibria, with their times; the last may be the reason why there is none."""
        return [moment.step for moment in self.moments]

    def to_json(self) -> dict[str, Any]:
        """The moments, as ``pneumorph simulate --supply … --json`` writes them."""
        return {
            "moments": [
                {"step": to_json(each.step), "supply_MPa": dict(each.supply), "flow_l_per_min": per_minute(each)}
                for each in self.moments
            ]
        }

    def to_csv(self) -> str:
        """A table with a line per moment and units in the header."""
        more = {f"supply_{name}_kPa": [1e3 * each.supply[name] for each in self.moments] for name in self.tubes}
        more |= {
            f"flow_{name}_l_per_min": [per_minute(each).get(name, nan) for each in self.moments] for name in self.tubes
        }
        return csv_text([self._curve], list(self.steps[0].pressures), more)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Motion, pressures, volumes and stretch over time, as a matplotlib figure.

        Parameters
        ----------
        path : file in which the figure is saved, if given: .pdf, .svg, and PNG for every other suffix.

        Raises
        ------
        ProblemError
            If no moment has an equilibrium.
        """
        from pneumorph.output.curves import curves_figure
        from pneumorph.output.figures import save

        if not self._curve.found:
            raise ProblemError(f"plot: there is no equilibrium to draw: {self.steps[0].reason}")
        figure = curves_figure([self._curve], self.title)
        if path is not None:
            save(figure, Path(path))
        return figure

    def summary(self) -> Iterator[str]:
        """In a sentence for each chamber, how long it takes and how much air flows."""
        found = self._curve.found
        for name, tube in self.tubes.items() if found else ():
            times = np.array([step.time for step in found])
            values = np.array([step.pressures[name] for step in found])
            flows = [each.flow[name] for each in self.moments if each.flow]
            largest = max(map(abs, flows))
            gone = np.abs(values - values[0])
            last = int((gone >= REACHED * gone.max()).argmax())
            when = f"between {times[max(last - 1, 0)]:.4g} and {times[last]:.4g} s"
            after = f"{100 * REACHED:.0f} % of the way to {1e3 * values[gone.argmax()]:.4g} kPa {when}"
            yield (
                f"{name}: {after}; at most {PER_MINUTE * largest:.3g} l/min of air at standard pressure "
                f"(Reynolds number {tube.reynolds(largest):.3g})"
            )

    def __repr__(self) -> str:
        return "\n".join([f"{len(self.moments)} moments", *self.summary()])

    @property
    def _curve(self) -> Curve:
        return Curve(self.steps[0].task, (TIME,), self.steps)


def per_minute(moment: Supplied) -> dict[str, float]:
    """The flows into chambers, l/min of air at standard pressure and 20 °C."""
    return {name: PER_MINUTE * flow for name, flow in moment.flow.items()}


def moments_of(
    explorer: Explorer,
    others: Mapping[str, float],
    supply: Mapping[str, Any],
    tube: str | Mapping[str, str],
    times: str,
    pressures: Mapping[str, Any],
) -> tuple[Mapping[str, Tube], Iterator[Supplied], int]:
    """The tubes, the moments, which are computed as they are asked for, and how many are asked for.

    Parameters
    ----------
    explorer : of the body.
    others : {chamber: MPa}
        Pressures of chambers without a supply, unless `pressures` has another.
    supply : {chamber: "100 kPa" or "0 kPa @ 0 s, 100 kPa @ 0.5 s"}
    tube : "2 mm x 1 m", or one for every chamber in `supply`.
    times : "0:2:0.05 s"
    pressures : {chamber: "30 kPa"}
        Constant ones of other chambers; of those in `supply`, at the first time, 0 by default.

    Raises
    ------
    ProblemError
        If an argument is not valid.
    """
    chambers = tuple(chamber.name for chamber in explorer.problem.body.chamber)
    profiles = read_profiles(supply, chambers)
    named = dict.fromkeys(profiles, tube) if isinstance(tube, str) else dict(tube)
    for name in named:
        if name not in chambers:
            raise ProblemError(f'tube {name}: there is no chamber "{name}"; use one of {", ".join(chambers)}')
    for name in profiles:
        if name not in named:
            raise ProblemError(f'tube: chamber {name} has a supply and no tube; write e.g. {name}="2 mm x 1 m"')
    tubes = {name: read_tube(str(named[name])) for name in profiles}
    (path,) = pressure_paths(pressures, chambers)
    if path.swept:
        raise ProblemError(f"pressure {path.swept[0]}: is swept; with a supply, pressures follow from it")
    given = path.steps[0]
    for name, value in given.items():
        if value <= -STANDARD:
            raise ProblemError(f"pressure {name}: is below a vacuum; use one above {-1e3 * STANDARD:g} kPa")
    constant = {name: value for name, value in (dict(others) | given).items() if name not in profiles}
    at = read_times(times)
    return tubes, supplied(explorer, Supplies(profiles, tubes, constant), at, given), len(at)
