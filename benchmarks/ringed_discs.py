"""Discs with fabric rings that lift a load, predicted before their curves were seen: python benchmarks/ringed_discs.py

    python benchmarks/ringed_discs.py --freeze                     # write the bodies and the problem files
    python benchmarks/ringed_discs.py [--out FILE.csv]             # predict all of them, with what they are off

The discs of G. Campbell and others 2025 (arXiv 2504.01156), as that of `pneumorph validate disc`, with two concentric
rings of fabric bonded on. Every disc is lifted by air in steps of 100 ml under every load with a soft, a nominal and a
stiff fabric, on coarse elements; under the middle load with the nominal fabric also on elements of half the size. What
these change there, they are taken to change by the same share elsewhere. A table has the pressures at heights of 10 to
40 mm with their deviations.
"""

import argparse
import csv
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from netgen.occ import Cylinder, Glue, Pnt, Z  # pyright: ignore[reportAttributeAccessIssue]
from scipy.interpolate import CubicSpline

from pneumorph.validation.disc import MOST, lifted
from pneumorph.validation.tables import PUBLISHED, problem_of

RADIUS, DEPTH, FLOOR, RIM = 70.0, 10.0, 2.0, 4.0
"""Free radius of the disc, and sizes of the stiff pot on which it is clamped, mm."""

HEIGHTS, UNTIL = (10.0, 20.0, 30.0, 40.0), 42.0
"""mm at which pressures are told, and where the path ends."""

BEGINNINGS, VOLUMES = (150e3, 100e3, 125e3), np.arange(200e3, MOST, 100e3)
"""mm³ of air: with which a path begins, the first that leads to a state below all heights, and what follows."""

COARSE, FINE = 10.0, 5.0
"""Of elements, mm. The prediction is that of the finer mesh, and the difference between both its mesh part."""

MIDDLE = 1
"""The number of the load under which the mesh is varied."""

SOFT, FABRIC, STIFF = 1.0, 3.0, 30.0
"""Young's modulus of the fabric times its thickness, N/mm: a shear modulus of 1 MPa at 0.3 mm and at 1 mm of thickness,
and ten times that."""

WEAKER = 0.0003
"""Strain at which the fabric wrinkles where no path is found with that of the problem file, 0.275 % for 30 N/mm. Under
the larger compression the coarse mesh wrinkles itself, in many ways; where it is taut, the pressures are the same."""

RUBBER, THICKNESS, WEIGHED = 0.1, 0.1, 0.01
"""Standard deviations: of the moduli, relative; of the thickness, mm; of the loads, relative."""


@dataclass(frozen=True)
class Disc:
    """A disc: radius of its load and thickness in mm, and fabric rings on it by inner and outer radius in mm."""

    contact: float
    thickness: float
    rings: tuple[tuple[float, float], ...]

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

    def text(self, number: int) -> str:
        """The problem file of the disc without rings, with this body in its place."""
        reach, top = self.contact + 0.5, DEPTH + self.thickness
        text = (PUBLISHED / "disc_tension_tests.toml").read_text(encoding="utf-8")
        corners = [[f"{sign * reach:g} mm", f"{sign * reach:g} mm", f"{top + sign * 0.1:g} mm"] for sign in (-1.0, 1.0)]
        begin, end = text.index("tip = "), text.index("[[body.chamber]]")
        text = f"{text[:begin]}tip = {{ within = {json.dumps(corners)} }}\n\n{text[end:]}"
        text = text.replace("a quarter of it:", f"ringed disc {number}, a quarter of it:")
        text = text.replace('title = "Disc, tension tests, 31.7 kPa"', f'title = "Ringed disc {number}"')
        text = text.replace("disc.step", f"ringed_{number}.step")
        for ring in range(len(self.rings)):
            text += f'\n[[membrane]]\nname = "fabric{ring}"\non = [{{ name = "ring{ring}" }}]\n'
            text += f'stiffness = "{FABRIC:g} N/mm"\n'
        return text


DISCS = (
    Disc(25.4, 2.0, ((44.0, 54.0), (57.0, 67.0))),
    Disc(29.63, 2.33, ((32.63, 42.63), (57.0, 67.0))),
    Disc(27.98, 2.0, ((40.58, 50.58), (53.58, 67.0))),
    Disc(38.1, 2.0, ((41.1, 54.0), (57.0, 67.0))),
    Disc(25.4, 2.0, ((28.4, 38.4), (41.4, 51.4))),
    Disc(31.92, 2.0, ((41.0, 51.0), (54.0, 64.0))),
)
"""Those that were measured."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Pressures at `HEIGHTS` in kPa, and their derivatives by the logarithm of all moduli, the fabric's among them.

    They are nan where no path is found.
    """

    pressures: np.ndarray
    by_moduli: np.ndarray


def curve(number: int, task: int, size: float, fabric: float) -> Curve:
    """The curve of a disc under one of its loads.

    Parameters
    ----------
    number, task : of the disc, from 1, and of its load, from 0.
    size : of the elements, mm.
    fabric : its stiffness, N/mm.
    """
    sheets = {f"membrane[{ring}].stiffness": f"{fabric} N/mm" for ring in range(len(DISCS[number - 1].rings))}
    weaker = {f"membrane[{ring}].wrinkling": WEAKER for ring in range(len(DISCS[number - 1].rings))}
    named, reason = f"disc {number}, load {task}, elements of {size:g} mm, fabric of {fabric:g} N/mm", ""
    for changes in (sheets, sheets | weaker):
        problem = problem_of("ringed", str(number), size).with_changes(changes)
        for first in BEGINNINGS:
            lift = lifted(problem, problem.task[task], np.array([first, *VOLUMES]), UNTIL)
            begun = len(lift.heights) > 0 and lift.heights[0] <= HEIGHTS[0]
            if begun and len(lift.heights) > 3 and lift.heights[-1] >= HEIGHTS[-1]:
                at = (CubicSpline(lift.heights, 1e3 * each)(HEIGHTS) for each in (lift.pressures, lift.by_moduli))
                if changes is not sheets:
                    print(f"{named}: {reason}; found with wrinkles from {WEAKER:g} on", flush=True)
                return Curve(*at)
            reason = reason or lift.reason or "the path ends below the heights"
            # Another beginning changes nothing of a path that has begun.
            if begun:
                break
    missing = np.full(len(HEIGHTS), np.nan)
    print(f"{named}: no path; {reason}", flush=True)
    return Curve(missing, missing)


TITLES = (
    *("disc", "force_N", "height_mm", "pressure_kPa", "deviation_kPa", "low_kPa", "high_kPa"),
    *("rubber_kPa", "thickness_kPa", "load_kPa", "mesh_kPa", "soft_fabric_kPa", "stiff_fabric_kPa"),
)
"""Columns of the table: pressures, one standard deviation, the least and the largest that are expected, which parts the
deviation has, and by how much a softer and a stiffer fabric change the pressure."""


def rows(number: int) -> list[list[float]]:
    """The rows of the table for a disc."""
    began, table = time.process_time(), []
    loads = [-(task.force or (0.0, 0.0, 0.0))[2] for task in problem_of("ringed", str(number), COARSE).task]
    soft, coarse, stiff = (
        [curve(number, task, COARSE, fabric) for task in range(len(loads))] for fabric in (SOFT, FABRIC, STIFF)
    )
    finer = curve(number, MIDDLE, FINE, FABRIC).pressures / coarse[MIDDLE].pressures
    logs = np.log([SOFT, FABRIC, STIFF])
    for load, low, each, high in zip(loads, soft, coarse, stiff, strict=True):
        softest, pressures, stiffest = (finer * of.pressures for of in (low, each, high))
        of_fabric = np.gradient(np.stack([softest, pressures, stiffest]), logs, axis=0)[1]
        of_rubber = finer * each.by_moduli - of_fabric
        parts = np.stack(
            [
                RUBBER * of_rubber,
                THICKNESS / DISCS[number - 1].thickness * of_rubber,
                WEIGHED * (pressures - finer * each.by_moduli),
                pressures - each.pressures,
            ]
        )
        deviation = np.linalg.norm(parts, axis=0)
        ends = (softest - pressures, stiffest - pressures)
        least, most = (pressures + sign * np.hypot(2 * deviation, end) for sign, end in zip((-1, 1), ends, strict=True))
        for at, height in enumerate(HEIGHTS):
            of = (pressures, deviation, least, most, *np.abs(parts), *ends)
            table.append([number, load, height, *(float(values[at]) for values in of)])
    print(f"disc {number}: {time.process_time() - began:.0f} s of processor time", flush=True)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--freeze", action="store_true", help="write the bodies and problem files")
    parser.add_argument("--out", type=Path, default=PUBLISHED / "ringed_predicted.csv")
    numbers = list(range(1, len(DISCS) + 1))
    parser.add_argument("--discs", type=int, nargs="+", default=numbers, help="others keep their rows")
    parser.add_argument("--processes", type=int, default=1, help="discs that are predicted beside each other")
    given = parser.parse_args()
    if given.freeze:
        for number, disc in enumerate(DISCS, 1):
            disc.write(PUBLISHED / f"ringed_{number}.step")
            (PUBLISHED / f"ringed_{number}.toml").write_text(disc.text(number), encoding="utf-8")
        return
    known = [row for row in _rows_of(given.out) if int(row[0]) not in given.discs]
    with ProcessPoolExecutor(given.processes, get_context("spawn")) as workers:
        for table in workers.map(rows, given.discs):
            for disc, force, height, *values in table:
                known.append([f"{disc:g}", f"{force:g}", f"{height:g}", *(f"{each:.4f}" for each in values)])
            with given.out.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file, lineterminator="\n").writerows([TITLES, *sorted(known, key=lambda row: int(row[0]))])


def _rows_of(path: Path) -> list[list[str]]:
    """The rows of a table; none if there is none."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.reader(file))[1:]


if __name__ == "__main__":
    main()
