"""Thread and cloth from none to 10⁴ N/mm on every rubber of the library: how far a bending tube gets, at what cost.

    python benchmarks/reinforced.py [--rubbers NAME ...] [--stiffness N/mm ...] [--element mixed|quadratic]

The tube of `examples/fibre_bender.toml` with its cloth and thread, both of the same stiffness, is swept in steps of a
fifth of a pressure that is in proportion to the rubber's shear modulus. A line has the pressure that was reached, the
bending there, and the factorisations per step.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from pneumorph.analysis.analyse import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import NoEquilibrium, Tangent, configure, loads_of, mirrors_of, model_of
from pneumorph.mechanics.setup import rubber_of
from pneumorph.mechanics.solve.sweep import sweep
from pneumorph.problem import Problem, load
from pneumorph.problem.material import library

EXAMPLE = Path(__file__).parents[1] / "examples" / "fibre_bender.toml"
STIFFNESS = (0.0, 10.0, 100.0, 1000.0, 10000.0)
STEPS, HIGHEST = 5, 0.3
"""Steps of a sweep, and its last pressure over the shear modulus; a tube without cloth and thread balloons above."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rubbers", nargs="*", default=list(library()))
    parser.add_argument("--stiffness", nargs="*", type=float, default=list(STIFFNESS))
    parser.add_argument("--element", default="mixed", choices=("mixed", "quadratic"))
    given = parser.parse_args()
    print("| rubber | N/mm | reached, kPa | bending, ° | factorisations per step |\n|---|---:|---:|---:|---:|")
    for rubber in given.rubbers:
        for stiffness in given.stiffness:
            print(line(rubber, stiffness, given.element), flush=True)


def problem(rubber: str, stiffness: float, element: str) -> Problem:
    """The example of a rubber, with cloth and thread of a stiffness in N/mm, or without them."""
    tables = load(EXAMPLE).model_dump(mode="json", exclude_none=True)
    tables["material"], tables["mesh"]["element"] = {"name": rubber}, element
    for kind in ("membrane", "fibres"):
        tables[kind] = [each | {"stiffness": f"{stiffness} N/mm"} for each in tables[kind]] if stiffness else []
    return Problem.model_validate(tables)


def line(rubber: str, stiffness: float, element: str) -> str:
    """A line of the table."""
    asked = problem(rubber, stiffness, element)
    mesh = mesh_of(asked, starting_body(asked.tubes), mirrors_of(asked), asked.mesh.size).mesh
    model, last = model_of(asked, mesh), 0.0
    tangent, reached, bending, states = Tangent(model), 0.0, 0.0, 0
    pressures = HIGHEST * rubber_of(asked.material).shear_modulus * np.arange(STEPS + 1) / STEPS
    path = [configure(model, mesh.points, loads_of(asked, model, {"A": each})) for each in pressures]
    for pressure, found in zip(pressures, sweep(path, tangent), strict=True):
        if isinstance(found, NoEquilibrium):
            break
        states, last = states + 1, float(tangent.factorisations)
        reached, bending = float(pressure), float(np.degrees(found.plate[4]))
    pressure = f"{1e3 * reached:.3g} of {1e3 * pressures[-1]:.3g}"
    return f"| {rubber} | {stiffness:g} | {pressure} | {bending:.1f} | {last / max(states, 1):.1f} |"


if __name__ == "__main__":
    main()
