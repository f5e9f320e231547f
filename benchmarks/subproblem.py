"""Cost of the sub-problem against the number of variables, 1k … 30k: the linear actuator with ever more control points.

    python benchmarks/subproblem.py

The objective's gradient is that of a bellows forming (a radial wave), so limits come into play as they do in a run.
"""

import time
from pathlib import Path

import numpy as np

from pneumorph.constraint import limits_of
from pneumorph.geometry import design_space, starting_body
from pneumorph.optimize.augmented import augmented_lagrangian
from pneumorph.optimize.dfp import FIRST_ITERATIONS, PaperStepper
from pneumorph.optimize.smoothing import smoothing
from pneumorph.problem import loads
from pneumorph.run.cache import use_compilation_cache

EXAMPLE = (Path(__file__).parents[1] / "examples" / "linear.toml").read_text()


def main() -> None:
    use_compilation_cache()
    print(f"{'1/mm':>5s} {'variables':>9s} {'method':>8s} {'evaluations':>11s} {'seconds':>8s} {'ms each':>8s}")
    for density in (0.3, 0.4, 0.6, 0.9, 1.28):
        problem = loads(EXAMPLE.replace('control_density = "0.6 /mm"', f'control_density = "{density} /mm"'))
        body = starting_body(problem.body)
        space = design_space(problem, body)
        points = body.control_points()
        wave = np.cos(2 * np.pi * (points[:, 2] - 40) / 10)[:, None] * points * np.array([1.0, 1.0, 0.0])
        slope = -space.pullback(wave)
        limits = limits_of(body, problem.limits, reach=1.0)
        for name, stepper in (
            ("lbfgs", augmented_lagrangian(space, smoothing(space), limits, 0.2)),
            ("dfp", PaperStepper(space, limits, 0.2, FIRST_ITERATIONS, np.zeros(0))),
        ):
            phi = space.start
            for _ in range(2):  # the first step compiles
                began = time.perf_counter()
                step = stepper.step(phi, slope, 0.2)
                seconds = time.perf_counter() - began
                phi, stepper = phi + step.change, stepper.after(step)
            each = 1e3 * seconds / step.evaluations
            print(
                f"{density:5.2f} {space.n:9d} {name:>8s} {step.evaluations:11d} {seconds:8.2f} {each:8.1f}", flush=True
            )


if __name__ == "__main__":
    main()
