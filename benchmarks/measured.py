"""Predictions beside published measurements: python benchmarks/measured.py

The beam of M. Dubied and others 2022 (arXiv 2201.12560; data of the repository srl-ethz/diffPD_sim2real, MIT licence,
in measured/beam_deflection.csv): Dragon Skin 10, 100 × 30 × 30 mm, clamped at one end and released from horizontal,
under its own weight and with 52 g and 101 g at the upper edge of its tip. First with the rubber of a first pull, then
with one whose modulus is found from the beam under its own weight alone.
"""

import csv
import tempfile
from pathlib import Path

import numpy as np
from netgen.occ import Box, Pnt  # pyright: ignore[reportAttributeAccessIssue]

import pneumorph as pm
from pneumorph.problem import Problem

HERE = Path(__file__).resolve().parent / "measured"

CASES = {"gravity": 0.0, "load52": 0.51012, "load101": 1.00062}
"""The beam's loads at its tip, N."""

AT_TIP, ON_MOUNT = (0, 1), (3, 4, 5)
"""Markers on the tip, and on the mount, which gives way a little."""

EDGE = 15.0
"""Of the edge at which the load hangs, above the axis, mm."""

TEXT = """
[material]
name = "{name}"
model = "ogden"
terms = [{{ modulus = "{modulus:.9g} kPa", exponent = 3.0994 }}]
bulk_modulus = "{bulk:.9g} kPa"
density = "1.07 g/cm^3"
[body]
file = "beam.step"
[mesh]
size = "{size} mm"
[end_effector]
force = ["{force:.9g} N", "0 N", "0 N"]
moment = ["0 N*mm", "{moment:.9g} N*mm", "0 N*mm"]
[gravity]
direction = [-1, 0, 0]
[[task]]
name = "hang"
pressure = {{ A = "0 kPa" }}
objective = {{ kind = "maximize", motion = "extension" }}
"""

FIRST_PULL = 43.018
"""Shear modulus of the first pull measured by Marechal and others 2021, kPa."""


def measured() -> dict[str, tuple[float, float]]:
    """Deflections of the tip by case in mm: means over markers and runs, less the mount's, and half the range."""
    found: dict[str, dict[str, list]] = {}
    with (HERE / "beam_deflection.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            run = found.setdefault(row["case"], {}).setdefault(row["run"], [])
            run.append((int(row["marker"]), float(row["dx_mm(vertical)"])))
    deflections = {}
    for case, runs in found.items():
        mount = np.mean([value for run in runs.values() for marker, value in run if marker in ON_MOUNT])
        tip = [value - mount for run in runs.values() for marker, value in run if marker in AT_TIP]
        deflections[case] = -float(np.mean(tip)), float(np.ptp(tip) / 2)
    return deflections


def write(folder: Path) -> None:
    """The beam. Bodies have a chamber: one of 3 mm at the tip, where nothing bends."""
    body = Box(Pnt(-15, -15, 0), Pnt(15, 15, 100)) - Box(Pnt(-1.5, -1.5, 96), Pnt(1.5, 1.5, 99))
    body.WriteStep(str(folder / "beam.step"))


def predicted(folder: Path, modulus: float, force: float, size: float) -> tuple[float, float]:
    """Deflection of the tip in mm with a shear modulus in kPa and a load in N, and how far the mesh is off."""
    turn, answer = 0.0, (0.0, 0.0)
    for _ in range(3):
        # The load hangs at an edge, which turns with the tip.
        text = TEXT.format(
            name="Dragon Skin 10 of this beam", modulus=modulus, bulk=1000 * modulus, size=size,
            force=-force, moment=force * EDGE * np.sin(turn),
        )  # fmt: skip
        path = folder / "beam.toml"
        path.write_text(text)
        problem: Problem = pm.load(path)
        start = pm.starting_design(problem)
        error = start.mesh_errors()["hang"]
        turn, answer = float(error.motion[4]), (-float(error.corrected[0]), abs(float(error.missing[0])))
        if not force:
            break
    return answer


def from_own_weight(folder: Path, deflection: float, size: float) -> float:
    """The shear modulus in kPa with which the beam hangs down by a deflection under its own weight, by secants."""
    one, other = FIRST_PULL, 2.0 * FIRST_PULL
    at_one, at_other = (1.0 / predicted(folder, each, 0.0, size)[0] for each in (one, other))
    for _ in range(3):
        new = one + (other - one) * (1.0 / deflection - at_one) / (at_other - at_one)
        one, at_one, other, at_other = other, at_other, new, 1.0 / predicted(folder, new, 0.0, size)[0]
    return other


def main(size: float = 8.0) -> None:
    known = measured()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder)
        own = from_own_weight(folder, known["gravity"][0], size)
        print(f"| load at the tip | measured | first pull, {FIRST_PULL:.0f} kPa | from its own weight, {own:.1f} kPa |")
        print("|---|---|---|---|")
        for case, force in CASES.items():
            value, half = known[case]
            cells = [predicted(folder, modulus, force, size) for modulus in (FIRST_PULL, own)]
            told = [f"{there:.1f} ± {off:.1f} mm (mesh), {100 * (there / value - 1):+.0f} %" for there, off in cells]
            print(f"| {1e3 * force / 9.81:.0f} g | {value:.1f} ± {half:.1f} mm | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    main()
