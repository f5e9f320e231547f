"""Discs with fabric rings that lift a load, predicted before their curves were seen: python benchmarks/ringed_discs.py

    python benchmarks/ringed_discs.py [--size 10] [--stiffness 3] [--force 24.525]

The discs of G. Campbell and others 2025 (arXiv 2504.01156), as that of `pneumorph validate disc`, with two concentric
rings of fabric bonded on. Pressures in kPa at heights of 10 to 40 mm, and the air of the path in steps of 100 ml.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from netgen.occ import Cylinder, Glue, Pnt, Z  # pyright: ignore[reportAttributeAccessIssue]

import pneumorph as pm
from pneumorph.validation.disc import MOST, lifted
from pneumorph.validation.tables import PUBLISHED

RADIUS, DEPTH, FLOOR, RIM = 70.0, 10.0, 2.0, 4.0
"""Free radius of the disc, and sizes of the stiff pot on which it is clamped, mm."""

HEIGHTS, UNTIL, STEP = (10.0, 20.0, 30.0, 40.0), 42.0, 100e3
"""mm at which pressures are told, and where the path ends; mm³ of air that a step adds."""


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

    def problem(self, folder: Path, force: float, size: float, stiffness: float) -> pm.Problem:
        """The frozen problem of the disc without rings, with this body in its place.

        Parameters
        ----------
        folder : for the body and the problem file.
        force : the load, N.
        size : of the elements, mm.
        stiffness : of the rings, N/mm.
        """
        self.write(folder / "disc.step")
        reach, top = self.contact + 0.5, DEPTH + self.thickness
        text = (PUBLISHED / "disc_tension_tests.toml").read_text(encoding="utf-8")
        begin, end = text.index("tip = "), text.index("[[body.chamber]]")
        corners = [[f"{sign * reach} mm", f"{sign * reach} mm", f"{top + sign * 0.1} mm"] for sign in (-1.0, 1.0)]
        text = f"{text[:begin]}tip = {{ within = {corners} }}\n\n{text[end:]}"
        for number in range(len(self.rings)):
            text += f'\n[[membrane]]\nname = "fabric{number}"\non = [{{ name = "ring{number}" }}]\n'
            text += f'stiffness = "{stiffness} N/mm"\n'
        (folder / "disc.toml").write_text(text, encoding="utf-8")
        problem = pm.load(folder / "disc.toml").with_changes({"mesh.size": f"{size} mm"})
        task = problem.task[0].model_copy(update={"force": (0.0, 0.0, -force)})
        return problem.model_copy(update={"task": (task,)})


DISCS = (
    Disc(25.4, 2.0, ((44.0, 54.0), (57.0, 67.0))),
    Disc(29.63, 2.33, ((32.63, 42.63), (57.0, 67.0))),
    Disc(27.98, 2.0, ((40.58, 50.58), (53.58, 67.0))),
    Disc(38.1, 2.0, ((41.1, 54.0), (57.0, 67.0))),
    Disc(25.4, 2.0, ((28.4, 38.4), (41.4, 51.4))),
    Disc(31.92, 2.0, ((41.0, 51.0), (54.0, 64.0))),
)
"""Those that were measured."""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", type=float, default=10.0, help="of the elements, mm")
    parser.add_argument("--stiffness", type=float, default=3.0, help="of the fabric, N/mm")
    parser.add_argument("--force", type=float, default=24.525, help="the load, N")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        for number, disc in enumerate(DISCS, 1):
            problem = disc.problem(Path(name), given.force, given.size, given.stiffness)
            lift = lifted(problem, problem.task[0], np.arange(STEP, MOST, STEP), UNTIL)
            pressures = 1e3 * np.interp(HEIGHTS, lift.heights, lift.pressures)
            print(f"| {number} | {' | '.join(f'{each:.2f}' for each in pressures)} |", flush=True)


if __name__ == "__main__":
    main()
