"""A lifting disc beside its published measurement: python benchmarks/measured_disc.py [--size mm]

The disc of G. Campbell and others 2025 (arXiv 2504.01156; data of the repository gmcampbell/SPA_Design, MIT licence, in
measured/ringless_pressure_height.csv): Ecoflex 00-30, 2 mm thick, clamped at a radius of 70 mm, lifts a rigid disc of
radius 25.4 mm that carries a dead load. At every volume of air below it the height and the pressure are found, so that
the curve goes on where the pressure falls. Rubbers are those that other tests gave: the authors' own tension tests
(Gent's model), and the library's. A quarter is solved.
"""

import argparse
import csv
import tempfile
from pathlib import Path

import numpy as np
from netgen.occ import Cylinder, Glue, Pnt, Z  # pyright: ignore[reportAttributeAccessIssue]

import pneumorph as pm
from pneumorph.mechanics import Equilibrium, Tangent, configure, enclosed_of, loads_of, sweep

HERE = Path(__file__).resolve().parent / "measured"

RADIUS, CONTACT, THICKNESS, DEPTH, FLOOR, RIM = 70.0, 25.4, 2.0, 10.0, 2.0, 4.0
"""Of the disc, and of the stiff pot on which it is clamped, mm."""

FORCES = (14.715, 24.525, 39.24)
"""Dead loads, N."""

HEIGHTS = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
"""At which pressures are compared, mm."""

STEP, MOST = 60.0, 30
"""Volume that a step adds, ml, and most steps."""

RUBBERS = {
    "tension tests (Gent, 31.7 kPa)": 'model = "gent"\nshear_modulus = "31.7 kPa"\nlimit = 39.6\n'
    'bulk_modulus = "31.7 MPa"\ndensity = "1.07 g/cm^3"\nname = "of the tension tests"',
    "library (15 kPa)": 'name = "Ecoflex 00-30"',
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


def measured() -> dict[float, dict[float, float]]:
    """Mean pressures in kPa by load in N and height in mm."""
    found: dict[float, dict[float, float]] = {force: {} for force in FORCES}
    with (HERE / "ringless_pressure_height.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found[float(row["force_N"])][float(row["height_mm"])] = 1e-3 * float(row["pressure_mean_Pa"])
    return found


def write(path: Path) -> None:
    """The body: a pot, and on it the disc, whose part below the load has faces of its own."""
    top = DEPTH + THICKNESS
    pot = Cylinder(Pnt(0, 0, 0), Z, RADIUS + RIM, top) - Cylinder(Pnt(0, 0, FLOOR), Z, RADIUS, top)
    middle = Cylinder(Pnt(0, 0, DEPTH), Z, CONTACT, THICKNESS)
    Glue([pot, middle, Cylinder(Pnt(0, 0, DEPTH), Z, RADIUS, THICKNESS) - middle]).WriteStep(str(path))


def predicted(folder: Path, rubber: str, force: float, size: float, until: float) -> tuple[np.ndarray, np.ndarray, int]:
    """Heights in mm and pressures in kPa along the path up to a height, and the factorisations that this took."""
    path = folder / "disc.toml"
    sizes = {"reach": CONTACT + 0.5, "below": DEPTH + THICKNESS - 0.1, "above": DEPTH + THICKNESS + 0.1}
    path.write_text(TEXT.format(rubber=RUBBERS[rubber], force=force, size=size, **sizes))
    problem = pm.load(path)
    simulation = pm.starting_design(problem).prepare_simulation(volumes={"A": "1 ml"})
    model, tangent = simulation.model, Tangent(simulation.model)
    loads = loads_of(problem, model, {"A": 0.0})
    volumes = [
        configure(model, simulation.mesh.points, loads, enclosed=enclosed_of(problem, {"A": 1e3 * STEP * (k + 1)}))
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
    size, known = parser.parse_args().size, measured()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder / "disc.step")
        for rubber in RUBBERS:
            for force in FORCES:
                heights, pressures, spent = predicted(folder, rubber, force, size, min(60.0, max(known[force])))
                cells = []
                for height in HEIGHTS:
                    if height in known[force] and heights[0] <= height <= heights[-1]:
                        there, seen = float(np.interp(height, heights, pressures)), known[force][height]
                        cells.append(f"{there:.2f} ({seen:.2f}), {100 * (there / seen - 1):+.0f} %")
                    else:
                        cells.append("–")
                print(f"| {rubber} | {force} N | {' | '.join(cells)} | {spent} |", flush=True)


if __name__ == "__main__":
    main()
