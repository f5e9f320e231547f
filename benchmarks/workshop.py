"""What tolerance and calibrate cost: python benchmarks/workshop.py RUN_OR_PROBLEM … [--size "4 mm"] [--points 7]

In equivalents, the time of one assembly and factorisation of the tangent on the same mesh: processor time of one
thread, without Netgen, which meshes in a process of its own. Run it twice; the first time kernels are compiled.

The curves that are calibrated are computed: what the body of the first task shows with moduli that are 10 % larger, at
pressures from nothing to those of the task. They are of what the task is about, and of the volume of its first chamber.
"""

import argparse
import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import pneumorph as pm
from pneumorph.analysis.along import Curve
from pneumorph.analysis.calibration import _Fit, calibrate
from pneumorph.analysis.near import analyse_near
from pneumorph.analysis.scatter import scatter_of
from pneumorph.analysis.tolerances import Tolerances
from pneumorph.interface.tolerance import tolerance_report
from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.problem.quantities import VOLUME_OF, shown

TIMES = 3
"""Assemblies and factorisations of which the median is an equivalent."""


def equivalent(at: Configuration, state: State) -> float:
    """Seconds of one assembly and factorisation; the analysis of the sparsity is done before."""
    tangent, seconds = Tangent(at.model), []
    tangent.factorise(at, state)
    for _ in range(TIMES):
        began = time.process_time()
        tangent.factorise(at, state)
        seconds.append(time.process_time() - began)
    return statistics.median(seconds)


def of_tolerance(design: pm.Design) -> str:
    """Equivalents of `tolerance` with its usual tolerances, and what of them are the states and the derivatives."""
    known = (design.stored, design.entry.tasks) if design.entry is not None else (None, None)
    times = [time.process_time()]
    whole = analyse_near(design.problem, design.body, (), *known)
    times.append(time.process_time())
    scatters = scatter_of(whole, Tolerances())
    times.append(time.process_time())
    tolerance_report(design.problem, design.body, {}, None, *known)
    times.append(time.process_time())
    name, scatter = next(iter(scatters.items()))
    unit = equivalent(whole.analysis.configurations[name], whole.analysis.equilibria[name].state)
    states, derivatives, everything = np.diff(times) / unit
    return (
        f"{whole.disc.model.elements:,} (whole) | tolerance, {len(scatter.quantities)} quantities, "
        f"{len(scatter.causes)} causes | {states:.1f} | {derivatives:.1f} | {everything:.0f}"
    )


def of_calibration(design: pm.Design, points: int) -> Iterator[str]:
    """The same of `calibrate`, for every quantity: states of the curve and derivatives, and the whole fit."""
    problem, task = design.problem, design.problem.task[0]
    full = np.array([design.pressures[task.name][each.name] for each in problem.body.chamber])
    pressures = np.outer(np.linspace(0.0, 1.0, points), full)
    for quantity in (*task.objective.quantities, VOLUME_OF + problem.body.chamber[0].name):
        fit = _Fit.of(problem, design.body, task, Curve(pressures, quantity, np.zeros(points)))
        begun = fit.begun()
        unit = equivalent(fit.points[-1], begun.states[-1])
        stiffer = fit.moved(begun, {"modulus": 0.1})
        assert stiffer is not None
        curve = Curve(pressures, quantity, stiffer.values)
        times = [time.process_time()]
        begun = _Fit.of(problem, design.body, task, curve).begun()
        times.append(time.process_time())
        begun.slopes(("modulus",))
        times.append(time.process_time())
        found = calibrate(problem, design.body, task, curve, ("modulus", "pressure"))
        times.append(time.process_time())
        states, derivatives, everything = np.diff(times) / unit
        yield (
            f"{fit.points[0].model.elements:,} | calibrate, {shown(quantity).word}, {points} points: modulus "
            f"{found.values[0]:+.3f} % | {states:.1f} | {derivatives:.1f} | {everything:.0f}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sources", nargs="+")
    parser.add_argument("--size", help="of the mesh, by default that of the run")
    parser.add_argument("--points", type=int, default=7, help="of a curve")
    asked = parser.parse_args()
    print("| design | elements | command | states | derivatives | all, in equivalents |\n|---|---|---|---|---|---|")
    for source in asked.sources:
        is_run = Path(source).is_dir()
        design = pm.open_run(source).best if is_run else pm.starting_design(pm.load(source))
        if asked.size:
            design = replace(design, problem=design.problem.with_changes({"mesh.size": asked.size}))
        print(f"| {source} | {of_tolerance(design)} |", flush=True)
        for line in of_calibration(design, asked.points):
            print(f"| {source} | {line} |", flush=True)


if __name__ == "__main__":
    main()
