"""Compare the cost of part of a body, a half, a quarter or a sector, and of the whole: an actuator with ripples.

    python benchmarks/symmetry.py [problem file] [edge length, mm] [mirror planes, by commas]

The planes replace the symmetry of the file, which by default is examples/bending.toml with an edge length of 2 mm.
Times are CPU seconds, medians of three, with everything compiled. A step is a design of the loop without its
sub-problem, which is the same for all: prediction, equilibrium and gradient after a motion of the control points by up
to 0.1 mm.
"""

import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

from pneumorph.analysis import analyse, build_discretisation, check_stability, design_gradient, predict_states
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import NoEquilibrium, part_of
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import load
from pneumorph.symmetry.part import images_of

EXAMPLE = Path(__file__).parents[1] / "examples" / "bending.toml"
NAMES = {1: "whole", 2: "half", 4: "quarter"}


def main(file: str, size: float, planes: str | None) -> None:
    problem = load(file)
    if planes is not None:
        problem = problem.with_changes({"body.symmetry": {"mirror": planes.split(",")}})
    space = build_design_space(problem, starting_body(problem.tubes))
    # Ripples on the side of +x, as far as the symmetry leaves them there.
    points = space.control_points(space.start)
    angle = np.arctan2(points[:, 1], points[:, 0])
    wave = (1 + np.cos(angle)) * np.cos(2 * np.pi * (points[:, 2] - problem.body.length / 2) / 10)
    ripples = space.pullback(np.column_stack([wave * np.cos(angle), wave * np.sin(angle), 0 * wave]))
    ripples /= np.abs(ripples).max()
    phi = space.start + ripples
    body = space.body(phi)

    smallest = part_of(problem)
    measured = {}
    for number in range(len(smallest), -1, -1):
        part = smallest[:number]
        seconds = {name: [] for name in ("mesh", "equilibrium", "gradient", "step")}
        for _ in range(4):  # the first time compiles
            began = time.perf_counter()  # Netgen works in a process of its own
            disc = build_discretisation(problem, mesh_body(body, size, part), body.control_points())
            seconds["mesh"].append(time.perf_counter() - began)
            began = time.process_time()
            found = analyse(problem, space, disc, phi)
            seconds["equilibrium"].append(time.process_time() - began)
            assert not isinstance(found, NoEquilibrium)
            began = time.process_time()
            slope = design_gradient(problem, space, disc, found)
            seconds["gradient"].append(time.process_time() - began)
            began = time.process_time()
            there = phi + 0.1 * ripples
            near = analyse(problem, space, disc, there, predict_states(space, disc, found, there))
            assert not isinstance(near, NoEquilibrium)
            design_gradient(problem, space, disc, near)
            seconds["step"].append(time.process_time() - began)
        if part == smallest:
            began = time.process_time()
            is_stable = check_stability(disc, found)
            once = time.process_time() - began
        medians = {name: median(times[1:]) for name, times in seconds.items()}
        measured[NAMES.get(len(images_of(part)), f"1/{len(images_of(part))}")] = disc.model, found.value, slope, medians

    whole = measured["whole"]
    parts = {name: part for name, part in measured.items() if part is not whole}
    print(
        " " * 20 + "".join(f"{name:>10s}" for name in measured) + "".join(f"{name + '/whole':>14s}" for name in parts)
    )
    rows = {"elements": lambda of: of[0].elements, "unknowns": lambda of: of[0].size}
    rows |= {f"{name}, s": lambda of, name=name: of[3][name] for name in whole[3]}
    rows |= {"objective": lambda of: of[1]}
    for name, value in rows.items():
        numbers = "".join(
            f"{value(of):10d}" if name in ("elements", "unknowns") else f"{value(of):10.3f}" for of in measured.values()
        )
        print(f"{name:20s}{numbers}" + "".join(f"{value(of) / value(whole):14.3f}" for of in parts.values()))
    for name, (_, _, slope, _) in parts.items():
        cosine = slope @ whole[2] / np.linalg.norm(slope) / np.linalg.norm(whole[2])
        size_ratio = np.linalg.norm(slope) / np.linalg.norm(whole[2])
        print(f"gradients, {name} and whole: cosine {cosine:.5f}, ratio of their norms {size_ratio:.4f}")
    print(f"stability of the whole body, once at the end: {is_stable}, {once:.1f} s with compiling")


if __name__ == "__main__":
    given = sys.argv[1:]
    main(
        given[0] if given else str(EXAMPLE),
        float(given[1]) if len(given) > 1 else 2.0,
        given[2] if len(given) > 2 else None,
    )
