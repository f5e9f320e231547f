"""Compare the cost of half a body and of the whole: the bending actuator, at a design that bends.

    python benchmarks/half.py [edge length, mm]

Times are medians of three, with everything compiled. A step is a design of the loop without its sub-problem, which is
the same for both: prediction, equilibrium and gradient after a motion of the control points by up to 0.1 mm.
"""

import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

from pneumorph.analysis import analyse, build_discretisation, check_stability, design_gradient, predict_states
from pneumorph.geometry import build_design_space, starting_body
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh import mesh_body
from pneumorph.problem import loads

EXAMPLE = (Path(__file__).parents[1] / "examples" / "bending.toml").read_text()


def main(size: float) -> None:
    problem = loads(EXAMPLE)
    space = build_design_space(problem, starting_body(problem.body))
    # Ripples on the side of +x.
    points = space.control_points(space.start)
    angle = np.arctan2(points[:, 1], points[:, 0])
    wave = (1 + np.cos(angle)) * np.cos(2 * np.pi * (points[:, 2] - 40) / 10)
    ripples = space.pullback(np.column_stack([wave * np.cos(angle), wave * np.sin(angle), 0 * wave]))
    ripples /= np.abs(ripples).max()
    phi = space.start + ripples
    body = space.body(phi)

    measured = {}
    for mirror in ("xz", None):
        seconds = {name: [] for name in ("mesh", "equilibrium", "gradient", "step")}
        for _ in range(4):  # the first time compiles
            began = time.perf_counter()
            disc = build_discretisation(problem, mesh_body(body, size, mirror), body.control_points())
            seconds["mesh"].append(time.perf_counter() - began)
            began = time.perf_counter()
            found = analyse(problem, space, disc, phi)
            seconds["equilibrium"].append(time.perf_counter() - began)
            assert not isinstance(found, NoEquilibrium)
            began = time.perf_counter()
            slope = design_gradient(problem, space, disc, found)
            seconds["gradient"].append(time.perf_counter() - began)
            began = time.perf_counter()
            there = phi + 0.1 * ripples
            near = analyse(problem, space, disc, there, predict_states(space, disc, found, there))
            assert not isinstance(near, NoEquilibrium)
            design_gradient(problem, space, disc, near)
            seconds["step"].append(time.perf_counter() - began)
        if mirror is not None:
            began = time.perf_counter()
            is_stable = check_stability(disc, found)
            once = time.perf_counter() - began
        medians = {name: median(times[1:]) for name, times in seconds.items()}
        measured[mirror] = disc.model, found.value, slope, medians

    (half, J, slope, ours), (whole, other, other_slope, theirs) = measured["xz"], measured[None]
    print(f"{'':24s} {'half':>10s} {'whole':>10s} {'half/whole':>10s}")
    for name in ("elements", "size"):
        mine, rest = getattr(half, name), getattr(whole, name)
        print(f"{name.replace('size', 'unknowns'):24s} {mine:10d} {rest:10d} {mine / rest:10.2f}")
    for name in ours:
        print(f"{name + ', s':24s} {ours[name]:10.2f} {theirs[name]:10.2f} {ours[name] / theirs[name]:10.2f}")
    print(f"{'bending, degrees':24s} {-np.degrees(J):10.4f} {-np.degrees(other):10.4f} {J / other:10.4f}")
    cosine = slope @ other_slope / np.linalg.norm(slope) / np.linalg.norm(other_slope)
    size_ratio = np.linalg.norm(slope) / np.linalg.norm(other_slope)
    print(f"gradients: cosine {cosine:.5f}, ratio of their norms {size_ratio:.4f}")
    print(f"stability of the whole body, once at the end: {is_stable}, {once:.1f} s with compiling")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
