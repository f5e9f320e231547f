"""Cost of a step within the limits over the number of variables: the linear actuator with increasing control density.

    python benchmarks/subproblem.py [DENSITY ...]

The gradient of the objective is a radial wave, as at the beginning of a bellows. After a few steps by sequential
quadratic programming limits are active, as in the middle of a run; then one step from there is timed, by that method
and by the paper's: the sub-problem, the repair that brings its step within the limits, and, as a part of that, the
certificate. Gain is the predicted gain of the step over that of a step without limits.
"""

import sys
import time
from pathlib import Path

import numpy as np

from pneumorph.geometry import DesignSpace
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.limits.of_shape import ShapeLimits, build_limit_functions, tube_limits
from pneumorph.optimize.dfp import PaperStepper
from pneumorph.optimize.model import Proxy
from pneumorph.optimize.smoothing import Smoothing, build_smoothing
from pneumorph.optimize.states import no_states
from pneumorph.optimize.subproblem import build_sequential_quadratic
from pneumorph.optimize.within import Within, within
from pneumorph.problem import load

EXAMPLE = Path(__file__).parents[1] / "examples" / "linear.toml"
DENSITIES, RADIUS, BEFORE = (0.6, 0.85, 1.25), 0.4, 4


def main() -> None:
    densities = [float(word) for word in sys.argv[1:]] or DENSITIES
    print(f"{'variables':>9s} {'method':>6s} {'step':>7s} {'within':>7s} {'certificate':>11s} {'gain':>6s}   (s)")
    for density in densities:
        problem = load(EXAMPLE).with_changes({"body.control_density": f"{density} /mm", "body.symmetry": False})
        body = starting_body(problem.tubes)
        space = build_design_space(problem, body)
        smooth, limits = build_smoothing(space), tube_limits(body, problem.limits)
        points = body.control_points()
        wave = np.cos(2 * np.pi * (points[:, 2] - 40) / 10)[:, None] * points * np.array([1.0, 1.0, 0.0])
        slope = -space.pullback(wave)
        proxy = Proxy(slope, np.zeros((0, space.n)))
        quadratic = build_sequential_quadratic(space, smooth, limits)
        phi = space.start
        for _ in range(BEFORE):
            step = quadratic.step(phi, proxy, RADIUS, no_states(len(phi)))
            phi, quadratic = brought(space, smooth, limits, phi + step.change).phi, quadratic.after(step)
        every = build_limit_functions(body, problem.limits, reach=1.0)
        for name, stepper in (
            ("sqp", quadratic),
            ("dfp", PaperStepper(space, every, RADIUS)),
        ):
            began = time.perf_counter()
            step = stepper.step(phi, proxy, RADIUS, no_states(len(phi)))
            stepped = time.perf_counter()
            found = brought(space, smooth, limits, phi + step.change)
            ended = time.perf_counter()
            limits.certify(space.body(found.phi))
            certifying = time.perf_counter() - ended
            gain = slope @ (phi - found.phi) / (RADIUS * np.abs(slope).sum())
            line = f"{stepped - began:7.2f} {ended - stepped:7.2f} {certifying:11.2f} {gain:6.3f}"
            print(f"{space.n:9d} {name:>6s} {line}", flush=True)


def brought(space: DesignSpace, smooth: Smoothing, limits: ShapeLimits, phi: np.ndarray) -> Within:
    """The design within its limits, which it must come to here."""
    found = within(space, smooth, limits, phi, RADIUS)
    if not isinstance(found, Within):
        sys.exit(f"the limits could not be kept: {'; '.join(map(str, found.violated()))}")
    return found


if __name__ == "__main__":
    main()
