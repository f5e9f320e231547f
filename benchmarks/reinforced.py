"""Thread and cloth from none to 10⁴ N/mm on every rubber of the library: how far a bending tube gets, at what cost.

    python benchmarks/reinforced.py [--rubbers NAME ...] [--stiffness N/mm ...] [--element mixed|quadratic ...]

A shorter tube than that of `examples/fibre_bender.toml`, with its cloth and thread, both of the same stiffness, is
solved from rest for a pressure in proportion to the rubber's shear modulus. A line has the pressure that was reached,
in part where no equilibrium was found beyond, the bending there, the factorisations, and these over those of the same
tube without cloth and thread.
"""

from __future__ import annotations

import argparse
from functools import cache
from pathlib import Path

import numpy as np

from pneumorph.analysis.analyse import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import NoEquilibrium, Tangent, configure, loads_of, mirrors_of, model_of, solve
from pneumorph.mechanics.setup import rubber_of
from pneumorph.problem import Problem, load
from pneumorph.problem.material import library

EXAMPLE = Path(__file__).parents[1] / "examples" / "fibre_bender.toml"
LENGTH, SPAN = "36 mm", ["4 mm", "32 mm"]
STIFFNESS = (0.0, 1.0, 10.0, 100.0, 500.0, 10000.0)
PRESSURE = 0.2
"""Over the shear modulus; a tube without cloth and thread balloons somewhat above 0.3."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rubbers", nargs="*", default=list(library()))
    parser.add_argument("--stiffness", nargs="*", type=float, default=list(STIFFNESS))
    parser.add_argument("--element", nargs="*", default=["mixed", "quadratic"], choices=("mixed", "quadratic"))
    given = parser.parse_args()
    print("| rubber | elements | N/mm | reached, kPa | bending, ° | factorisations | ratio |")
    print("|---|---|---:|---:|---:|---:|---:|")
    for rubber in given.rubbers:
        for element in given.element:
            without = cost(rubber, 0.0, element)[2]
            for stiffness in given.stiffness:
                reached, bending, spent = cost(rubber, stiffness, element)
                row = (rubber, element, f"{stiffness:g}", reached, f"{bending:.1f}", spent, f"{spent / without:.1f}")
                print(f"| {' | '.join(map(str, row))} |", flush=True)


def problem(rubber: str, stiffness: float, element: str) -> Problem:
    """The tube of a rubber, with cloth and thread of a stiffness in N/mm, or without them."""
    tables = load(EXAMPLE).model_dump(mode="json", exclude_none=True)
    tables["material"], tables["mesh"]["element"] = {"name": rubber}, element
    tables["body"]["length"], tables["body"]["chamber"][0]["span"] = LENGTH, SPAN
    for kind in ("membrane", "fibres"):
        tables[kind] = [each | {"stiffness": f"{stiffness} N/mm"} for each in tables[kind]] if stiffness else []
    return Problem.model_validate(tables)


@cache
def cost(rubber: str, stiffness: float, element: str) -> tuple[str, float, int]:
    """The pressure that was reached in kPa, with what was asked for if that is more, bending in °, factorisations."""
    asked = problem(rubber, stiffness, element)
    mesh = mesh_of(asked, starting_body(asked.tubes), mirrors_of(asked), asked.mesh.size).mesh
    model = model_of(asked, mesh)
    pressure, tangent = PRESSURE * rubber_of(asked.material).shear_modulus, Tangent(model)
    found = solve(configure(model, mesh.points, loads_of(asked, model, {"A": pressure})), tangent)
    words, last = f"{1e3 * pressure:.3g}", found
    if isinstance(found, NoEquilibrium):
        words, last = f"{1e3 * found.fraction * pressure:.3g} of {words}", found.last
    return words, 0.0 if last is None else float(np.degrees(last.plate[4])), tangent.factorisations


if __name__ == "__main__":
    main()
