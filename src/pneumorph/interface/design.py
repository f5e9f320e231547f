"""One design: its shape, its pressures, its results, and its export to other programs.

Libraries that draw are loaded when something is drawn: loading them takes half as long as everything else.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pneumorph.analysis import (
    Analysis,
    Curve,
    Discretisation,
    Explorer,
    Simulation,
    analyse_start,
    collect_fields,
    collect_task_results,
    compute_inflation,
    compute_sag,
    discretise,
    prepare_simulation,
)
from pneumorph.analysis.accuracy import MeshError, errors_of, mesh_errors
from pneumorph.analysis.insertion import Insertion, Insertions, find_insertions, further_chambers
from pneumorph.analysis.near import Solved, analyse_near, stored_states
from pneumorph.analysis.rates import motion_rates
from pneumorph.errors import ProblemError
from pneumorph.geometry import Body
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.interface.other_loads import under_loads
from pneumorph.interface.over_time import OverTime, moments_of
from pneumorph.interface.reach import PressuresFound, as_motions, inverse, motions_wanted, pushed_motions
from pneumorph.interface.sweep import Sweep
from pneumorph.limits.of_shape import limits_of
from pneumorph.limits.report import LimitReading
from pneumorph.mechanics import part_of
from pneumorph.objective import build_objectives
from pneumorph.problem import Problem
from pneumorph.problem.designed import starting_at
from pneumorph.results import ChamberUse, Fields, HistoryEntry, TaskResult
from pneumorph.results.chambers import chamber_uses
from pneumorph.symmetry.part import images_of

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure

    from pneumorph.analysis.airflow import Tube
    from pneumorph.analysis.supply import Supplied
    from pneumorph.interface.calibration import CalibratedDesign
    from pneumorph.interface.fast_model import FastModel, ModelCheck
    from pneumorph.interface.tolerance import ToleranceReport
    from pneumorph.interface.validation import Validation
    from pneumorph.make import MadeFiles
    from pneumorph.output.view import View
    from pneumorph.surrogate.chain import Chain

MOST_STATES = 400
"""States that are solved for a fast model, unless more are asked for."""


@dataclass(frozen=True, eq=False, repr=False)
class Design:
    """A design of a problem.

    Attributes
    ----------
    problem : Problem
        Sheets and fibres whose data are designed start from those of this design.
    body : Body
        Its surfaces.
    pressures : {task: {chamber: MPa}}
    iteration : int
        Its number in the run; 0 is the start.
    entry : HistoryEntry or None
        Its results in the design loop; None for a body from elsewhere.
    stored : Fields or None
        Its stored displacements; without them, they are computed when needed.

    Examples
    --------
    >>> import pneumorph as pm
    >>> best = pm.open_run("runs/small").best
    >>> best.nets["chamber_A"].shape[2], best.pressures["extend"]["A"]
    (3, 0.06)
    >>> all(reading.excess() < 0.01 for reading in best.limits)
    True
    >>> print(best.mesh.point_data["extend stretch"].max() > 1.0)
    True
    """

    problem: Problem
    body: Body
    pressures: Mapping[str, Mapping[str, float]]
    iteration: int = 0
    entry: HistoryEntry | None = None
    stored: Fields | None = None

    @property
    def nets(self) -> dict[str, np.ndarray]:
        """Control nets (n_r, n_q, 3) in mm: "exterior", and "chamber_<name>" of every chamber."""
        names = ["exterior", *(f"chamber_{chamber.name}" for chamber in self.body.chambers)]
        return dict(zip(names, self.body.nets(), strict=True))

    @cached_property
    def limits(self) -> tuple[LimitReading, ...]:
        """The worst value of every limit, certified for all points of the surfaces."""
        return limits_of(self.problem, self.body).certify(self.body).readings

    @property
    def results(self) -> Mapping[str, TaskResult]:
        """The results of all tasks, by the task's name.

        Raises
        ------
        ComputationError
            If they have to be computed, and the design cannot be meshed or has no equilibrium.
        """
        return collect_task_results(*self._analysed) if self.entry is None else self.entry.tasks

    @cached_property
    def chambers(self) -> dict[str, ChamberUse]:
        """What each chamber does in the tasks, and which are idle; empty for bodies with a single one.

        Raises
        ------
        ComputationError
            If the body cannot be meshed or has no equilibrium.
        """
        if len(self.body.chambers) == 1:
            return {}
        near = self._near
        return chamber_uses(self.problem, self.results, motion_rates(near.disc, near.analysis))

    def further_chambers(self, count: int = 3) -> list[Insertion]:
        """Where a further chamber would help most: spheres as large as the walls allow, the best first.

        See ``docs/how_to/chambers.md`` for how well it is known. `pm.with_further_chamber` puts one into the problem.

        Parameters
        ----------
        count : int
            Most places.

        Raises
        ------
        ComputationError
            If the body cannot be meshed or has no equilibrium.
        ProblemError
            If the tasks span a workspace.
        """
        return further_chambers(self.problem, self._insertions, count)

    def plot_further_chambers(self, path: str | Path | None = None, count: int = 3) -> Figure:
        """What a small chamber at any place would do to the objective, in two cuts through the best place.

        Parameters
        ----------
        path : file in which the figure is saved, if given: .png, .pdf or .svg.
        count : most places that are drawn as circles.

        Raises
        ------
        ComputationError
            If the body cannot be meshed or has no equilibrium.
        ProblemError
            If no further chamber would help, the tasks span a workspace, or the file cannot be written.
        """
        from pneumorph.interface.drawing import saved
        from pneumorph.output.insertion import insertion_figure

        spheres = [(each.place, each.radius) for each in self.further_chambers(count)]
        if not spheres:
            raise ProblemError("limits: no further chamber that keeps wall and curvature would help; nothing is drawn")
        disc, images = self._near.disc, images_of(self._near.disc.model.part)
        corners = self._near.analysis.X[disc.morph.mesh.tets[:, :4]]
        whole = np.concatenate([corners @ matrix.T for matrix in images])
        figure = insertion_figure(self.problem.title, whole, np.tile(self._insertions.gain, len(images)), spheres)
        return figure if path is None else saved(figure, Path(path))

    @cached_property
    def _insertions(self) -> Insertions:
        near = self._near
        return find_insertions(near.problem, near.disc, near.analysis)

    @cached_property
    def fields(self) -> Fields:
        """Mesh, displacements and stretches of the whole body.

        Raises
        ------
        ComputationError
            If they have to be computed, and the design cannot be meshed or has no equilibrium.
        """
        return (self._computed() if self.stored is None else self.stored).whole()

    def _computed(self, inflated: bool = False) -> Fields:
        disc, analysis = self._analysed
        if inflated:
            return collect_fields(disc, analysis, *compute_inflation(self.problem, disc, analysis))
        return collect_fields(disc, analysis, compute_sag(self.problem, disc, analysis))

    @property
    def mesh(self) -> pyvista.UnstructuredGrid:
        """The body at rest with "<task> displacement" (mm), "<task> stretch" and "<task> stress" (von Mises, MPa).

        Raises
        ------
        ModuleNotFoundError
            If PyVista is not installed; the message says how to install it.
        """
        from pneumorph.output.grid import for_pyvista, grid

        return for_pyvista(grid(self.problem, self.fields))

    def deformed(self, task: str | None = None) -> pyvista.UnstructuredGrid:
        """The body as a task deforms it, with "displacement", "stretch" and "stress"; by default the first task."""
        from pneumorph.output.grid import deformed, for_pyvista

        return for_pyvista(deformed(self.problem, self.fields, self._task(task)))

    def simulate(
        self,
        pressures: Mapping[str, Any] | None = None,
        block: str | Iterable[str] = (),
        one_by_one: bool = False,
        task: str | None = None,
        moves: Mapping[str, Any] | None = None,
        friction: float | None = None,
        volumes: Mapping[str, Any] | None = None,
        stiffness: bool = False,
        along: str | None = None,
        rate: Any = None,
        cycles: int | None = None,
        hold: Any = None,
    ) -> Sweep:
        """Find equilibria at the tasks' pressures, or along sweeps of pressure or of places of obstacles.

        Parameters
        ----------
        pressures : mapping of chambers to "60 kPa" or "0:60:5 kPa"
            Constant or swept pressures; constant ones also as pint quantities. Other chambers have the pressures of the
            design. Swept chambers change together.
        block : str or several
            Motions of the plate to hold: "axial", "bending_x", …, or "all" where they are at rest, or at a value such
            as "bending_y=30 deg" or along a sweep such as "axial=0:4:1 mm". Steps then have the reactions.
        one_by_one : bool
            Sweep one chamber after another, while the others stay at the start of their sweeps.
        task : str, by default all
            The only task whose pressures and target are used. Of tasks that are the same under the pressures given, one
            is simulated, and those with a target.
        moves : mapping of obstacles and axes, "plate.z", to "-3 mm" or "0:-3:-0.5 mm"
            Constant or swept displacements of obstacles, in place of those of the task, and, as "plate.turn_z", turns
            of "30 deg" or "0:90:5 deg". What is swept changes together.
        friction : float, by default that of the problem
            Coefficient of friction on obstacles. States then depend on the steps before: begin where nothing touches.
        volumes : mapping of chambers to "12 ml" or "0:12:1 ml"
            Liquid that is filled in beyond what is there at rest, in place of a pressure, which is found.
        stiffness : bool
            Find the stiffness of the tip at every step, see `TipStiffness`.
        along : str, such as "x", "-z" or "1,0,1"
            Find the force with which the tip presses where it is kept from moving in this direction, too.
        rate : str or pint quantity, such as "2 kPa/s"
            How fast the first that is swept changes: steps take time, in which rubber relaxes.
        cycles : int
            How often sweeps go there and back: rubber softens, and `Sweep.cycles` have the energy lost.
        hold : str or pint quantity, such as "10 s"
            How long loads stay at the end of a sweep, or at both ends of every cycle, while rubber relaxes.

        Raises
        ------
        ProblemError
            If a pressure, chamber or motion is not a valid one.
        MeshError
            If the body cannot be meshed.

        Examples
        --------
        >>> import pneumorph as pm
        >>> best = pm.open_run("runs/small").best
        >>> blocked = best.simulate({"A": "60 kPa"}, block="axial")
        >>> blocked.steps[0].reaction["axial"] > 0  # N
        True
        """
        began, curves = time.perf_counter(), list[Curve]()
        options = moves, friction, volumes, stiffness, along, rate, cycles, hold
        prepared = self.prepare_simulation(pressures, block, one_by_one, task, *options)
        for _ in prepared.run(curves):
            pass
        return Sweep(prepared, curves, time.perf_counter() - began)

    def prepare_simulation(
        self,
        pressures: Mapping[str, Any] | None = None,
        block: str | Iterable[str] = (),
        one_by_one: bool = False,
        task: str | None = None,
        moves: Mapping[str, Any] | None = None,
        friction: float | None = None,
        volumes: Mapping[str, Any] | None = None,
        stiffness: bool = False,
        along: str | None = None,
        rate: Any = None,
        cycles: int | None = None,
        hold: Any = None,
    ) -> Simulation:
        """Prepare what `simulate` does, to be run step by step.

        Parameters
        ----------
        pressures, block, one_by_one, task, moves, friction, volumes, stiffness, along, rate, cycles, hold
            As for `simulate`.

        Raises
        ------
        ProblemError, MeshError
            As for `simulate`.
        """
        names = [block] if isinstance(block, str) else block
        own = self.pressures if task is None else {task: self.pressures[self._task(task)]}
        options = pressures or {}, names, one_by_one, moves, friction, volumes, stiffness, along, rate, cycles, hold
        return prepare_simulation(self.problem, self.body, own, *options, stored=self.stored)

    def over_time(
        self,
        supply: Mapping[str, Any],
        tube: str | Mapping[str, str],
        times: str,
        pressures: Mapping[str, Any] | None = None,
        task: str | None = None,
    ) -> OverTime:
        """Pressures and motions over time, where chambers are filled with air from a supply through tubes.

        The air keeps its temperature, and the body has no inertia: at every moment it is in equilibrium.

        Parameters
        ----------
        supply : mapping of chambers to "100 kPa" or "0 kPa @ 0 s, 100 kPa @ 0.5 s"
            Gauge pressure at the other end of the tube, constant or linear between points of time.
        tube : str, such as "2 mm x 1 m", or one for every chamber
            Inner diameter and length.
        times : str, such as "0:2:0.05 s"
            The moments.
        pressures : mapping of chambers to "30 kPa"
            Constant pressures of chambers without a supply, by default those of the task; those of chambers with one
            at the first moment, by default 0.
        task : str
            Whose loads act; by default the first.

        Raises
        ------
        ProblemError
            If an argument is not valid.
        MeshError
            If the body cannot be meshed.

        Examples
        --------
        >>> import pneumorph as pm
        >>> best = pm.open_run("runs/small").best
        >>> filled = best.over_time({"A": "20 kPa"}, tube="1 mm x 1 m", times="0:0.2:0.1 s")
        >>> filled.steps[-1].translation[2] > filled.steps[0].translation[2]  # mm
        True
        """
        tubes, moments, _ = self.prepare_over_time(supply, tube, times, pressures, task)
        return OverTime(self.problem.title, tubes, list(moments))

    def prepare_over_time(
        self,
        supply: Mapping[str, Any],
        tube: str | Mapping[str, str],
        times: str,
        pressures: Mapping[str, Any] | None = None,
        task: str | None = None,
    ) -> tuple[Mapping[str, Tube], Iterator[Supplied], int]:
        """The tubes, the moments of `over_time`, computed as they are asked for, and how many are asked for.

        Parameters
        ----------
        supply, tube, times, pressures, task
            As for `over_time`.

        Raises
        ------
        ProblemError
            If an argument is not valid.
        """
        own = self.pressures[self.problem.task[0].name if task is None else self._task(task)]
        return moments_of(self.explorer(task), own, supply, tube, times, pressures or {})

    def explorer(self, task: str | None = None) -> Explorer:
        """Find equilibria at any pressures, one after another, each from the nearest ones that are known.

        Of the first and the last design of a run, the mesh and the equilibria of the tasks are stored, and the search
        begins there.

        Parameters
        ----------
        task : str
            Whose loads act; by default the first. For others only the mesh is stored.

        Examples
        --------
        >>> import pneumorph as pm
        >>> explorer = pm.open_run("runs/small").best.explorer()
        >>> explored = explorer.at({"A": 0.055})  # MPa
        >>> print(explored.step.stable, explored.fields.whole().stretch["extend"].max() > 1.0)
        True True
        """
        return self._explorer(task, {}, (), ())

    def _explorer(
        self, task: str | None, load: Mapping[str, Any], block: Iterable[str], pushed: Iterable[str]
    ) -> Explorer:
        """The same under other loads, see `under_loads`; there only the mesh is known from the beginning."""
        chosen = self.problem.task[0].name if task is None else self._task(task)
        tasks = sorted(self.problem.task, key=lambda each: each.name != chosen)
        own = self.problem.model_copy(update={"task": tuple(tasks)})
        under = under_loads(own, load, block, pushed)
        known = self.entry is not None and chosen == self.problem.task[0].name
        results = self.entry.tasks if self.entry is not None and known and under is own else None
        return Explorer(under, self.body, self.stored, results)

    def pressures_for(
        self,
        motions: Mapping[str, Any],
        bounds: Mapping[str, Any] | None = None,
        task: str | None = None,
        load: Mapping[str, Any] | None = None,
        block: str | Iterable[str] = (),
    ) -> PressuresFound:
        """The pressures with which the tip moves or pushes as wanted, or as near to it as they can; the shape stays.

        Of all pressures that do it, those with the least effort are found. What is not asked for is free.

        Parameters
        ----------
        motions : {motion: text with unit}
            Such as ``{"bending_y": "30 deg", "extension": "2 mm"}``. With "push_" before a motion, the force or moment
            with which the tip pushes where this motion is held: ``{"push_extension": "0.5 N"}``. Or a pose in
            coordinates: where the centre of the tip is to be, from that of the base, and its rotation vector,
            ``{"position": ("0 mm", "20 mm", "70 mm"), "rotation": ("0 deg", "30 deg", "0 deg")}``.
        bounds : {chamber: "0:60 kPa"}
            By default each chamber has at least 0 and at most the largest pressure of a task.
        task : str
            Whose loads act; by default the first.
        load : {name: text with unit}
            In place of what the task has: ``{"force_x": "-0.1 N", "moment_z": "2 N*mm", "gravity": "0,0,-1"}``.
        block : str or several
            Motions of the plate that are held: "shift_x" where it is at rest, or "shift_x=2 mm". Those that are pushed
            along are held at rest, unless they are given here.

        Raises
        ------
        ProblemError
            If a motion, a bound, a load or the task is unknown.
        ComputationError
            If there is no stable equilibrium within the bounds, or the body cannot be meshed.

        Examples
        --------
        >>> import pneumorph as pm
        >>> found = pm.open_run("runs/small").best.pressures_for({"extension": "0.2 mm"})
        >>> found.found.reached, 0.0 < found.pressures["A"] < 0.06  # MPa
        (True, True)
        """
        wanted = motions_wanted(as_motions(motions, self.problem))
        [found] = self.pressures_along([wanted], bounds, task, load, block)
        return found

    def pressures_along(
        self,
        wanted: Sequence[Mapping[str, float]],
        bounds: Mapping[str, Any] | None = None,
        task: str | None = None,
        load: Mapping[str, Any] | None = None,
        block: str | Iterable[str] = (),
    ) -> list[PressuresFound]:
        """The pressures for several, one after another, in mm, rad, N and N·mm; otherwise as `pressures_for`."""
        asked = [block] if isinstance(block, str) else list(block)
        explorer = self._explorer(task, load or {}, asked, pushed_motions(wanted))
        return inverse(explorer, explorer.problem, bounds, wanted)

    def model(
        self,
        path: str | Path,
        bounds: Mapping[str, Any] | None = None,
        task: str | None = None,
        tolerance: float = 0.005,
        sections: int = 0,
        most: int = MOST_STATES,
        force: Any = None,
        gravity: bool = False,
        workers: int = 1,
    ) -> FastModel:
        """Build a model of the design that gives poses and pressures in microseconds, and write it to a file.

        See ``docs/how_to/model.md``. Any program reads the file with ``pneumorph/surrogate/reader.py`` and NumPy.

        Parameters
        ----------
        path : str or Path
            The file, `.npz`.
        bounds : {chamber: "0:60 kPa"}
            By default each chamber has at least 0 and at most the largest pressure of a task.
        task : str
            Whose loads act; by default the first.
        tolerance : float
            Largest error at states that the model does not know, over the range of motions, volumes and sections.
        sections : int
            Number of sections along the body whose poses it gives too.
        most : int
            Most states that are solved.
        force : quantity
            Where forces on the tip vary too: the largest of a component, "0.5 N".
        gravity : bool
            Whether the direction of gravity varies too.
        workers : int
            Processes that solve states.

        Raises
        ------
        ProblemError
            If a bound or the task is unknown.
        ComputationError
            If there is no stable equilibrium within the bounds, or the body cannot be meshed.

        Examples
        --------
        >>> import pneumorph as pm
        >>> fast = pm.open_run("runs/small").best.model("small.npz")  # doctest: +SKIP
        >>> fast.model.pressures_for({"extension": 0.2}).pressures  # doctest: +SKIP
        {'A': 0.031}
        """
        from pneumorph.interface.fast_model import build_model

        return build_model(
            self.explorer(task), Path(path), bounds or {}, tolerance, sections, most,
            force=force, gravity=gravity, workers=workers,
        )  # fmt: skip

    def export_chain(self, path: str | Path, bounds: Mapping[str, Any] | None = None, task: str | None = None) -> Chain:
        """Write a chain of rigid links with springs, driven by pressures, for MuJoCo (MJCF).

        Parameters
        ----------
        path : str or Path
        bounds : mapping of chambers to "0:60 kPa"
            Of the pressures for which it is meant, by default those of the tasks.
        task : str
            Whose loads act; by default the first.

        Returns
        -------
        Chain
            What is in the file; `off` has by how much its tip misses exact states.

        Raises
        ------
        ProblemError
            If the axis is bent, motions of the tip are held, a bound makes no sense, or the file cannot be written.
        ComputationError
            If there is no stable state at pressures within the bounds.

        Examples
        --------
        >>> import pneumorph as pm
        >>> chain = pm.open_run("runs/small").best.export_chain("small.xml")
        >>> (chain.off[:, 0] < 0.2 * chain.spans[0]).all()
        np.True_
        """
        from pneumorph.interface.chain import export_chain

        return export_chain(Path(path), self.explorer(task), bounds or {})

    def check_model(self, path: str | Path, task: str | None = None, count: int = 8) -> ModelCheck:
        """Compare a model of this design, from a file, with exact states at random pressures in its domain.

        Parameters
        ----------
        path : str or Path
            The file.
        task : str
            Whose loads act; by default the first.
        count : int
            How many states.

        Raises
        ------
        ProblemError
            If it is no model, or that of another body, task or mesh.
        """
        from pneumorph.interface.fast_model import check_model

        return check_model(self.explorer(task), Path(path), count)

    def mesh_errors(self) -> dict[str, MeshError]:
        """How far the results of every task are from those on infinitely fine meshes.

        Of a design of a run on its own mesh, where that is stored, else on a new one. See ``docs/how_to/accuracy.md``.
        Tasks are missing of which no state is found on the refined mesh.

        Raises
        ------
        ComputationError
            If the body cannot be meshed or has no equilibrium.

        Examples
        --------
        >>> import pneumorph as pm
        >>> error = pm.open_run("runs/small").best.mesh_errors()["extend"]
        >>> bool(error.missing[2] > 0.0), bool(error.corrected[2] > error.motion[2])  # mm: meshes are too stiff
        (True, True)
        """
        problem = starting_at(self.problem, self.pressures)
        if self.entry is not None and self.stored is not None:
            states = stored_states(problem, self.stored, self.entry.tasks)
            if states is not None:
                return errors_of(problem, self.stored.mesh, build_objectives(problem), states)
        near = self._near
        return mesh_errors(problem, near.disc, near.analysis)

    def tolerance(self, task: str | None = None, **tolerances: Any) -> ToleranceReport:
        """How far motions, forces of a held tip and volumes scatter in castings, and what each tolerance contributes.

        To first order, from exact derivatives on a mesh of the whole body, since faults are not symmetric.

        Parameters
        ----------
        task : str, by default all
            The only task.
        **tolerances : "10 %" or pint quantities
            Standard deviations in place of the usual ones: rubber, pressure, wall, shift, tilt, scale, load; see
            ``docs/how_to/tolerance.md``.

        Raises
        ------
        ProblemError
            If there is no such task, or a tolerance is not one.
        ComputationError
            If the whole body cannot be meshed or has no equilibrium.

        Examples
        --------
        >>> import pneumorph as pm
        >>> report = pm.open_run("runs/small").best.tolerance(rubber="15 %")
        >>> float(report.tasks["extend"].deviations[2]) > 0.0  # mm
        True
        """
        from pneumorph.interface.tolerance import tolerance_report

        names = None if task is None else [self._task(task)]
        known = (self.stored, self.entry.tasks) if self.entry is not None else (None, None)
        return tolerance_report(starting_at(self.problem, self.pressures), self.body, tolerances, names, *known)

    def calibrate(
        self,
        measured: str | Path,
        fit: Iterable[str] = ("modulus",),
        task: str | None = None,
        block: str | Iterable[str] = (),
    ) -> CalibratedDesign:
        """Find the rubber, the walls and the pressure error of a casting of the design from a measured curve.

        Parameters
        ----------
        measured : str or Path
            A text file with titles such as "pressure A (kPa), extension (mm)", and one point a line. In place of a
            motion it may have a force or moment, "push_extension (N)", or the volume of a chamber, "volume A (ml)", or
            what was filled into it, "filled A (ml)".
        fit : several of "modulus", "wall" and "pressure", and names of constants of the rubber such as "c10"
            What is fitted; a curve seldom tells all of them apart, and the result says so.
        task : str, by default the first
            Whose loads act.
        block : str or several
            Motions of the plate that were held: "shift_x" where it is at rest, or "shift_x=2 mm". That along which a
            force was measured is held at rest, unless the task or this holds it elsewhere.

        Raises
        ------
        ProblemError
            If the file has no curve, or the body has friction, free obstacles, or sealed or filled chambers.
        ComputationError
            If a state is not found, or the curve does not determine what is fitted.

        Examples
        --------
        >>> import pneumorph as pm
        >>> fitted = pm.open_run("runs/small").best.calibrate("curve.csv", ["modulus"])  # doctest: +SKIP
        >>> fitted.fit.factor  # doctest: +SKIP
        1.12
        """
        from pneumorph.interface.calibration import calibrated

        chosen = next(each for each in self.problem.task if each.name == self._task(task))
        pressures = self.pressures[chosen.name]
        held = [block] if isinstance(block, str) else block
        return calibrated(self.problem, self.body, chosen, pressures, Path(measured), list(fit), held)

    def validate(self, measured: str | Path, task: str | None = None, **tolerances: Any) -> Validation:
        """Lay a measured curve of a casting beside the prediction of the design, with the error bars of both.

        Parameters
        ----------
        measured : str or Path
            A text file with titles such as "pressure A (kPa), extension (mm)", and one point a line; points with the
            same pressures are repetitions, which tell the scatter of the measurement.
        task : str, by default the first
            Whose loads act.
        **tolerances : text with unit
            As of `tolerance`.

        Raises
        ------
        ProblemError
            If the file has no curve, a tolerance is not one, or the body has sealed or filled chambers or friction.
        ComputationError
            If a state is not found.

        Examples
        --------
        >>> import pneumorph as pm
        >>> found = pm.open_run("runs/small").best.validate("curve.csv", rubber="5 %")  # doctest: +SKIP
        >>> found.comparisons[0].rms  # doctest: +SKIP
        0.02
        """
        from pneumorph.interface.validation import validated

        chosen = next(each for each in self.problem.task if each.name == self._task(task))
        return validated(self.problem, self.body, chosen, self.pressures[chosen.name], Path(measured), tolerances)

    def make(self, folder: str | Path, chord: float = 0.02) -> MadeFiles:
        """Write all files for manufacturing the design and its mould, and check them; see ``docs/making.md``.

        The effect of the ports of the mould on the motion is simulated. Of a body from a file there is no mould.

        Parameters
        ----------
        folder : Path
            Where to write; created if it does not exist. Existing files of the same names are replaced.
        chord : float
            Largest distance in mm between the surfaces and the triangles of 3MF and STL.

        Raises
        ------
        ModuleNotFoundError
            Without the extra ``cad``; the message says how to install it.
        ComputationError
            If the chord error needs too many triangles, the body cannot be moulded, or it has no equilibrium with tubes
            in its ports.
        MeshError
            If the body cannot be meshed.
        OSError
            If a file cannot be written.

        Examples
        --------
        >>> import pneumorph as pm
        >>> made = pm.open_run("runs/small").best.make("parts")  # doctest: +SKIP
        >>> [check for check in made.checks if not check.passed]  # doctest: +SKIP
        []
        """
        from pneumorph.interface.making import make_design

        return make_design(self.problem, self.body, self.pressures, Path(folder), chord)

    def export(self, path: str | Path, format: str | None = None, task: str | None = None) -> None:
        """Write the whole body to a file for other programs.

        Parameters
        ----------
        path : Path
        format : "vtu", "inp", "msh", "feb", "py" or "xml", by default the suffix of the path
            "vtu" is for ParaView and VTK, with all data of `mesh` and its faces; "inp" an input file for CalculiX and
            Abaqus, "feb" one for FEBio 4; "msh" the mesh for Gmsh; "py" a scene for SOFA with SoftRobots; "xml"
            a chain of rigid links for MuJoCo, see `export_chain`.
        task : str, by default the first
            The task whose loads an input file or scene has.

        Raises
        ------
        ProblemError
            If format or task are unknown, the format does not support the rubber, sheets or springs, or the file cannot
            be written.

        Examples
        --------
        >>> import pneumorph as pm
        >>> pm.open_run("runs/small").best.export("small.vtu")
        """
        from pneumorph.output.export import CHAIN, FORMATS, export

        chosen = Path(path).suffix.removeprefix(".") if format is None else format
        if chosen == CHAIN:
            self.export_chain(path, task=task)
            return
        if chosen not in FORMATS:
            known = ", ".join((*FORMATS, CHAIN))
            raise ProblemError(
                f'format: "{chosen}" is not a known format; use one of {known}; STL, 3MF and STEP of a run, for '
                "printing and CAD, are written by: pneumorph make"
            )
        name = self._task(task)
        # Those of chambers that are filled or sealed are found.
        pressures = self.results[name].pressures if self.has_found_pressures(name) else self.pressures[name]
        export(Path(path), chosen, self.problem, self.fields, pressures, name)

    def has_found_pressures(self, task: str | None = None) -> bool:
        """Whether a chamber is filled to a volume or sealed with gas in a task, by default the first."""
        name = self._task(task)
        (own,) = (each for each in self.problem.task if each.name == name)
        return bool(own.volumes) or any(chamber.gas is not None for chamber in self.problem.body.chamber)

    def plot(
        self,
        path: str | Path | None = None,
        cut: Literal["yz", "xz", "xy", "none"] | None = None,
        at: Any = None,
        task: str | None = None,
    ) -> Figure:
        """The body cut open, at rest and inflated, as a matplotlib figure.

        Parameters
        ----------
        path : file in which the figure is saved, if given: .png, .pdf or .svg.
        cut : the plane of the cut, or "none"; by default the plane in which each task bends the body.
        at : a length, e.g. "3 mm"
            Where the plane is, along the axis across it; by default through a chamber, and at half the length for "xy".
        task : the only one shown.

        Raises
        ------
        NoPicture
            If this machine cannot draw off-screen; it is a ComputationError.
        ProblemError
            If there is no such cut, task or format, or the file cannot be written.
        """
        from pneumorph.interface.drawing import saved
        from pneumorph.output.pictures import design_figure

        only = None if task is None else self._task(task)
        view = self._view(cut, at)
        title = ", ".join(part for part in (self.problem.title, self._number) if part)
        figure = design_figure(self.problem, self.fields, self.results, title, view, only)
        return figure if path is None else saved(figure, Path(path))

    def animate(
        self,
        path: str | Path,
        task: str | None = None,
        cut: Literal["yz", "xz", "xy", "none"] | None = None,
        at: Any = None,
    ) -> None:
        """Save how the body inflates to the pressures of a task, by default the first, as a GIF.

        Every frame is an equilibrium. They are stored of the last design of a run, and computed for others.

        Parameters
        ----------
        path : str or Path
            The GIF; a file of this name is replaced.
        task : str, optional
            The one shown, by default the first.
        cut, at
            As for `plot`.

        Raises
        ------
        ComputationError
            If this machine cannot draw off-screen, or an equilibrium is not found.
        ProblemError
            If there is no such cut or task, or the file cannot be written.
        """
        from pneumorph.interface.drawing import saved_gif
        from pneumorph.output.animation import inflation

        name = self._task(task)
        stored = self.stored
        fields = stored if stored is not None and name in stored.inflation else self._computed(inflated=True)
        film = inflation(self.problem, fields, self.results[name], name, self._view(cut, at))
        saved_gif(film.drawn(), Path(path))

    def __repr__(self) -> str:
        from pneumorph.interface.text import design_text

        return design_text(self.problem, self.iteration, self.entry, len(self.pressures))

    def _repr_html_(self) -> str:
        from pneumorph.interface.html import design_html

        return design_html(self.problem, self.iteration, self.entry, self.limits)

    @property
    def _number(self) -> str:
        return "" if self.entry is None else f"design {self.iteration}"

    def _view(self, cut: str | None, at: Any) -> View | None:
        from pneumorph.interface.drawing import view

        return view(self.problem, cut, at)

    def _task(self, name: str | None) -> str:
        names = [task.name for task in self.problem.task]
        if name is None:
            return names[0]
        if name not in names:
            raise ProblemError(f'task: there is no task "{name}"; use one of {", ".join(names)}')
        return name

    @cached_property
    def _near(self) -> Solved:
        """Its states to full precision, from those that are stored."""
        problem = starting_at(self.problem, self.pressures)
        known = (self.stored, self.entry.tasks) if self.entry is not None else (None, None)
        return analyse_near(problem, self.body, part_of(problem), *known)

    @cached_property
    def _analysed(self) -> tuple[Discretisation, Analysis]:
        problem = starting_at(self.problem, self.pressures)
        space = space_of(problem, self.body)
        disc = discretise(problem, self.body)
        return disc, analyse_start(problem, space, disc, space.start)


def starting_design(problem: Problem) -> Design:
    """The starting body of a problem at its starting pressures, whether it keeps the limits or not.

    Examples
    --------
    >>> import pneumorph as pm
    >>> start = pm.starting_design(pm.load("examples/small.toml"))
    >>> {reading.limit: round(reading.value, 2) for reading in start.limits}["wall"]  # mm
    3.0
    """
    pressures = {task.name: {name: pressure.start for name, pressure in task.pressure.items()} for task in problem.task}
    return Design(problem, body_of(problem), pressures)
