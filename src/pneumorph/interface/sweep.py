"""The results of a simulation, as tables and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pneumorph.analysis import Curve, Simulation
from pneumorph.errors import ProblemError
from pneumorph.mechanics import COMPONENTS
from pneumorph.output.sweeps import csv_text, table
from pneumorph.problem.components import MOTION_OF
from pneumorph.problem.objectives.words import MOTION_WORDS
from pneumorph.results import Cycle, SweepStep, to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """The equilibria along sweeps of pressure.

    Attributes
    ----------
    simulation : Simulation
        The problem, the mesh and the pressures.
    curves : sequence of Curve
        One curve for every task and sweep.
    seconds : float
        Time of the computation.

    Examples
    --------
    >>> import pneumorph as pm
    >>> sweep = pm.open_run("runs/small").best.simulate({"A": "0:60:30 kPa"})
    >>> [round(1e3 * step.pressures["A"]) for step in sweep.steps]  # kPa
    [0, 30, 60]
    >>> sweep.steps[-1].translation[2] > sweep.steps[0].translation[2]  # mm
    True
    """

    simulation: Simulation
    curves: Sequence[Curve]
    seconds: float

    @property
    def steps(self) -> list[SweepStep]:
        """The steps of all curves, in their order."""
        return [step for curve in self.curves for step in curve.steps]

    @property
    def found(self) -> list[SweepStep]:
        """The steps that have an equilibrium."""
        return [step for step in self.steps if step.converged]

    @property
    def cycles(self) -> list[Cycle]:
        """The energy of every cycle of all curves, in their order."""
        return [cycle for curve in self.curves for cycle in curve.cycles]

    def to_json(self) -> dict[str, Any]:
        """The steps and the size of the model, as ``pneumorph simulate --json`` writes them."""
        model = self.simulation.model
        steps = [to_json(step) for step in self.steps]
        cycles = {"cycles": [to_json(cycle) for cycle in self.cycles]} if self.cycles else {}
        return {"steps": steps, **cycles, "elements": model.elements, "dofs": model.size, "seconds": self.seconds}

    def to_csv(self) -> str:
        """A table with a line per step and units in the header, as ``pneumorph simulate --csv`` writes it."""
        return csv_text(self.curves, self._chambers)

    def __repr__(self) -> str:
        from pneumorph.interface.text import sweep_text

        return sweep_text(self.steps, self.seconds)

    def _repr_html_(self) -> str:
        from pneumorph.interface.html import table as html_table

        return html_table(*table(self.curves, self._chambers))

    def to_pandas(self) -> Any:
        """The same table as a pandas DataFrame; steps without an equilibrium have NaN.

        Raises
        ------
        ProblemError
            If pandas is not installed.
        """
        try:
            import pandas  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise ProblemError("to_pandas: needs pandas; install it with pip install pneumorph[pandas]") from None
        header, rows = table(self.curves, self._chambers)
        return pandas.DataFrame(rows, columns=header)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Motion, reactions, volumes and stretch over the swept pressure, as a matplotlib figure.

        Parameters
        ----------
        path : file in which the figure is saved, if given: .pdf, .svg, and PNG for every other suffix.

        Raises
        ------
        ProblemError
            If nothing was swept or no step has an equilibrium.
        """
        from pneumorph.output.curves import curves_figure
        from pneumorph.output.figures import save

        if not any(curve.found and curve.swept for curve in self.curves):
            raise ProblemError('plot: there is no sweep to draw; simulate e.g. {"A": "0:60:5 kPa"}')
        blocked = [
            MOTION_WORDS[MOTION_OF.get(name, name)]
            for name, is_blocked in zip(COMPONENTS, self.simulation.blocked, strict=True)
            if is_blocked
        ]
        words = f"blocked: {' and '.join(blocked)}" if blocked else ""
        title = ", ".join(part for part in (self.simulation.problem.title, words) if part)
        figure = curves_figure(self.curves, title)
        if path is not None:
            save(figure, Path(path))
        return figure

    @property
    def _chambers(self) -> list[str]:
        return [chamber.name for chamber in self.simulation.problem.body.chamber]
