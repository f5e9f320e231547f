"""A lifting disc beside its published measurement: python benchmarks/measured_disc.py [--size mm]

With `--ringed N/mm`, discs with two fabric rings of this stiffness, whose measured curves have not been seen.

The disc of G. Campbell and others 2025 (arXiv 2504.01156; data of the repository gmcampbell/SPA_Design, MIT licence, in
measured/ringless_pressure_height.csv): Ecoflex 00-30, 2 mm thick, clamped at a radius of 70 mm, lifts a rigid disc of
radius 25.4 mm that carries a dead load. At every volume of air below it the height and the pressure are found, so that
the curve goes on where the pressure falls. Rubbers are those that other tests gave: the authors' own tension tests
(Gent's model), and the first pull of Marechal and others 2021. A quarter is solved.
"""

import argparse
import csv
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from netgen.occ import Cylinder, Glue, Pnt, Z  # pyright: ignore[reportAttributeAccessIssue]

import pneumorph as pm
from pneumorph.mechanics import Equilibrium, Tangent, configure, enclosed_of, loads_of, sweep

HERE = Path(__file__).resolve().parent / "measured"

RADIUS, DEPTH, FLOOR, RIM = 70.0, 10.0, 2.0, 4.0
"""Free radius of the disc, and sizes of the stiff pot on which it is clamped, mm."""

FORCES = (14.715, 24.525, 39.24)
"""Dead loads, N."""

HEIGHTS = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
"""At which pressures are compared, mm."""

STEP, MOST = 60.0, 30
"""Volume that a step adds, ml, and most steps."""

RUBBERS = {
    "tension tests (Gent, 31.7 kPa)": 'model = "gent"\nshear_modulus = "31.7 kPa"\nlimit = 39.6\n'
    'bulk_modulus = "31.7 MPa"\ndensity = "1.07 g/cm^3"\nname = "of the tension tests"',
    "first pull (15 kPa)": 'model = "ogden"\nterms = [{ modulus = "15.057 kPa", exponent = 2.2033 }, '
    '{ modulus = "0.091 kPa", exponent = 4.9336 }]\nbulk_modulus = "15.1 MPa"\ndensity = "1.07 g/cm^3"\n'
    'name = "of the first pull"',
}

TEXT = """
[material]
{rubber}
[body]
file = "disc.step"
symmetry = {{ mirror = ["xz", "yz"] }}
base = {{ faces = "z = 0 mm" }}
tip = {{ within = [["-{reach} mm", "-{reach} mm", "{below} mm"], ["{reach} mm", "{reach} mm", "{above} mm"]] }}
[[body.chamber]]
name = "A"
inside = ["0 mm", "0 mm", "5 mm"]
[[region]]
name = "pot"
inside = ["0 mm", "0 mm", "1 mm"]
material = {{ name = "stiff", shear_modulus = "10 MPa", bulk_modulus = "1000 MPa", density = "1.07 g/cm^3" }}
[mesh]
size = "{size} mm"
[end_effector]
force = ["0 N", "0 N", "-{force} N"]
[[task]]
name = "lift"
pressure = {{}}
volume = {{ A = "1 ml" }}
objective = {{ kind = "maximize", motion = "extension" }}
"""


def measured(column: str = "pressure_mean_Pa") -> dict[float, dict[float, float]]:
    """Mean pressures, or another column, in kPa by load in N and height in mm."""
    found: dict[float, dict[float, float]] = {force: {} for force in FORCES}
    with (HERE / "ringless_pressure_height.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row[column]:
                found[float(row["force_N"])][float(row["height_mm"])] = 1e-3 * float(row[column])
    return found


@dataclass(frozen=True)
class Disc:
    """A disc: radius of its load and thickness in mm, and fabric rings on it by inner and outer radius in mm."""

    contact: float = 25.4
    thickness: float = 2.0
    rings: tuple[tuple[float, float], ...] = ()

    def write(self, path: Path) -> None:
        """The body: a pot, and on it the disc, whose parts below load and rings have faces of their own."""
        top = DEPTH + self.thickness
        parts = [Cylinder(Pnt(0, 0, 0), Z, RADIUS + RIM, top) - Cylinder(Pnt(0, 0, FLOOR), Z, RADIUS, top)]
        inner = None
        for radius in sorted({self.contact, *(edge for ring in self.rings for edge in ring), RADIUS}):
            whole = Cylinder(Pnt(0, 0, DEPTH), Z, radius, self.thickness)
            part = whole if inner is None else whole - Cylinder(Pnt(0, 0, DEPTH), Z, inner, self.thickness)
            if (inner, radius) in self.rings:
                part.faces.Max(Z).name = f"ring{self.rings.index((inner, radius))}"
            parts.append(part)
            inner = radius
        Glue(parts).WriteStep(str(path))

    def problem(self, rubber: str, force: float, size: float, stiffness: float) -> str:
        """A problem file with a load in N, element size in mm and a stiffness of the rings in N/mm."""
        reach, top = self.contact + 0.5, DEPTH + self.thickness
        text = TEXT.format(rubber=rubber, force=force, size=size, reach=reach, below=top - 0.1, above=top + 0.1)
        for number in range(len(self.rings)):
            text += f'[[membrane]]\nname = "fabric{number}"\non = [{{ name = "ring{number}" }}]\n'
            text += f'stiffness = "{stiffness} N/mm"\n'
        return text


RINGED = (
    Disc(25.4, 2.0, ((44.0, 54.0), (57.0, 67.0))),
    Disc(29.63, 2.33, ((32.63, 42.63), (57.0, 67.0))),
    Disc(27.98, 2.0, ((40.58, 50.58), (53.58, 67.0))),
    Disc(38.1, 2.0, ((41.1, 54.0), (57.0, 67.0))),
    Disc(25.4, 2.0, ((28.4, 38.4), (41.4, 51.4))),
    Disc(31.92, 2.0, ((41.0, 51.0), (54.0, 64.0))),
)
"""Discs with rings that were measured too."""


def predicted(
    folder: Path,
    disc: Disc,
    rubber: str,
    force: float,
    size: float,
    until: float,
    stiffness: float = 0.0,
    step: float = STEP,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Heights in mm and pressures in kPa along the path up to a height, and the factorisations that this took.

    Parameters
    ----------
    folder : for the body and the problem file.
    disc : what is lifted.
    rubber : a key of `RUBBERS`.
    force : the load, N.
    size : of the elements, mm.
    until : height at which the path ends, mm.
    stiffness : of the rings, N/mm.
    step : ml, from state to state.
    """
    path = folder / "disc.toml"
    disc.write(folder / "disc.step")
    path.write_text(disc.problem(RUBBERS[rubber], force, size, stiffness))
    problem = pm.load(path)
    simulation = pm.starting_design(problem).prepare_simulation(volumes={"A": "1 ml"})
    model, tangent = simulation.model, Tangent(simulation.model)
    loads = loads_of(problem, model, {"A": 0.0})
    volumes = [
        configure(model, simulation.mesh.points, loads, enclosed=enclosed_of(problem, {"A": 1e3 * step * (k + 1)}))
        for k in range(MOST)
    ]
    heights, pressures = [], []
    for found in sweep(volumes, tangent):
        if not isinstance(found, Equilibrium):
            print(f"  {rubber}, {force} N: {found.reason}", flush=True)
            break
        heights.append(float(found.plate[2]))
        pressures.append(1e3 * found.enclosed["A"])
        print(f"  {heights[-1]:.2f} mm, {pressures[-1]:.4f} kPa, stretch {found.max_stretch:.2f}", flush=True)
        if heights[-1] > until:
            break
    return np.array(heights), np.array(pressures), tangent.factorisations


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=float, default=8.0, help="of the elements, mm")
    parser.add_argument("--ringed", type=float, default=0.0, help="stiffness of fabric rings, N/mm")
    parser.add_argument("--force", type=float, default=24.525, help="on discs with rings, N")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        if given.ringed:
            ringed(Path(name), given.force, given.size, given.ringed)
        else:
            compared(Path(name), given.size)


def ringed(folder: Path, force: float, size: float, stiffness: float) -> None:
    """Print the pressures of the discs with rings."""
    for number, disc in enumerate(RINGED, 1):
        heights, pressures, spent = predicted(folder, disc, next(iter(RUBBERS)), force, size, 42.0, stiffness, 100.0)
        cells = [f"{float(np.interp(each, heights, pressures)):.2f}" for each in HEIGHTS[:4] if len(heights)]
        print(f"| {number} | {' | '.join(cells)} | {spent} |", flush=True)


def compared(folder: Path, size: float) -> None:
    """Print the pressures of the disc without rings beside the measured ones."""
    known = measured()
    for rubber in RUBBERS:
        for force in FORCES:
            heights, pressures, spent = predicted(folder, Disc(), rubber, force, size, min(60.0, max(known[force])))
            cells = []
            for height in HEIGHTS:
                if len(heights) and height in known[force] and heights[0] <= height <= heights[-1]:
                    there, seen = float(np.interp(height, heights, pressures)), known[force][height]
                    cells.append(f"{there:.2f} ({seen:.2f}), {100 * (there / seen - 1):+.0f} %")
                else:
                    cells.append("–")
            print(f"| {rubber} | {force} N | {' | '.join(cells)} | {spent} |", flush=True)


if __name__ == "__main__":
    main()
