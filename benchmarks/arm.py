"""A measured arm, predicted before its curve was seen: python benchmarks/arm.py [--size 6] [--modulus 92.2] …

    python benchmarks/arm.py --freeze FOLDER      # write its body and problem file, arm.step and arm.toml

The one-segment arm of Dragon Skin 10 of M. Dubied and others 2022 (arXiv 2201.12560): 100 mm long, an outer radius of
22.2 mm, four chambers around a square hole, hanging from its base. One chamber is inflated. The modulus is that of the
beam of the same rubber under its own weight (`pneumorph validate beam`), and nothing is fitted to the arm.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from netgen.occ import Axis, Box, Cylinder, MoveTo, Pnt, Z  # pyright: ignore[reportAttributeAccessIssue]

import pneumorph as pm

LENGTH, RADIUS, OUTER, HOLE, INNER, SEPTUM, END = 100.0, 22.2, 2.03, 15.0, 2.27, 4.4, 6.93
"""Of the arm, its outer and inner walls, the square hole, the septa along the diagonals and the ends, mm."""

PRESSURES = (10, 15, 20, 25, 30, 35, 40, 45)
"""kPa at which its motion is asked for."""

TEXT = """\
# The one-segment arm of M. Dubied and others (2022, arXiv 2201.12560), hanging from its base: z is down.
title = "One-segment arm"

[material]
name = "Dragon Skin 10 of the beam"
model = "ogden"
terms = [{{ modulus = "{modulus:.9g} kPa", exponent = {exponent} }}]
bulk_modulus = "{bulk:.9g} kPa"
density = "1.07 g/cm^3"
valid_stretch = 3.0
scatter = 0.03  # one standard deviation of the moduli
source = "the beam of the same rubber under its own weight alone, with the exponent of the first pull"

[body]
file = "arm.step"
symmetry = {{ mirror = ["xz"] }}
[[body.chamber]]
name = "A"
inside = ["15 mm", "0 mm", "50 mm"]
[[body.chamber]]
name = "B"
inside = ["0 mm", "15 mm", "50 mm"]
[[body.chamber]]
name = "C"
inside = ["-15 mm", "0 mm", "50 mm"]
[[body.chamber]]
name = "D"
inside = ["0 mm", "-15 mm", "50 mm"]
[mesh]
size = "{size:g} mm"
[end_effector]
kind = "{tip}"
[gravity]
direction = [0, 0, 1]
"""

TASK = """
[[task]]
name = "at_{kPa}"
pressure = {{ A = "{kPa} kPa", B = "0 kPa", C = "0 kPa", D = "0 kPa" }}
objective = {{ kind = "maximize", motion = "bending_y" }}
"""


def body(septum: float, outer: float, end: float):
    """The arm as a solid: a cylinder less its square hole and four chambers, mm."""
    solid = Cylinder(Pnt(0, 0, 0), Z, RADIUS, LENGTH) - Box(
        Pnt(-HOLE / 2, -HOLE / 2, -1.0), Pnt(HOLE / 2, HOLE / 2, LENGTH + 1.0)
    )
    near, far = HOLE / 2 + INNER, 2.0 * RADIUS
    # A septum along the line y = x is as wide as the chambers beside it are from that line.
    aside = septum / np.sqrt(2.0)
    wedge = (
        MoveTo(near, aside - near)
        .LineTo(far, aside - far)
        .LineTo(far, far - aside)
        .LineTo(near, near - aside)
        .Close()
        .Face()
    )
    prism = wedge.Extrude((LENGTH - 2 * end) * Z).Move((0, 0, end))
    chamber = prism * Cylinder(Pnt(0, 0, end), Z, RADIUS - outer, LENGTH - 2 * end)
    for turn in range(4):
        solid -= chamber.Rotate(Axis(Pnt(0, 0, 0), Z), 90.0 * turn)
    return solid


def problem(folder: Path, given: argparse.Namespace, pressures=PRESSURES) -> pm.Problem:
    """The arm with a task for each of the pressures."""
    body(given.septum, given.outer, given.end).WriteStep(str(folder / "arm.step"))
    text = TEXT.format(
        modulus=given.modulus, bulk=1000 * given.modulus, exponent=given.exponent, size=given.size, tip=given.tip
    )
    path = folder / "arm.toml"
    path.write_text(text + "".join(TASK.format(kPa=kPa) for kPa in pressures))
    return pm.load(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, value in {
        "modulus": 92.2, "exponent": 3.0994, "septum": SEPTUM, "outer": OUTER, "end": END, "size": 5.0
    }.items():  # fmt: skip
        parser.add_argument(f"--{name}", type=float, default=value)
    parser.add_argument("--pressures", default="0:45:5 kPa")
    parser.add_argument("--tip", choices=["plate", "free"], default="plate")
    parser.add_argument("--mesh", action="store_true", help="the error of the mesh at 10, 25 and 45 kPa")
    parser.add_argument("--freeze", type=Path, metavar="FOLDER", help="write the body and the problem file")
    given = parser.parse_args()
    if given.freeze:
        problem(given.freeze, given)
        return
    with tempfile.TemporaryDirectory() as name:
        if given.mesh:
            for kPa in (10, 25, 45):
                error = pm.starting_design(problem(Path(name), given, (kPa,))).mesh_errors()[f"at_{kPa}"]
                parts = np.concatenate([error.motion[[0, 2]], np.degrees(error.motion[[4]])])
                more = np.concatenate([error.missing[[0, 2]], np.degrees(error.missing[[4]])])
                print(f"{kPa} kPa: x, z in mm, turn in °: {np.round(parts, 3)}, mesh {np.round(more, 3)}", flush=True)
            return
        start = pm.starting_design(problem(Path(name), given, PRESSURES[:1]))
        simulation = start.prepare_simulation({"A": given.pressures})
        print(f"# {vars(given)}, {simulation.model.elements} elements", flush=True)
        for step in simulation.run([]):
            at = f"| {1e3 * step.pressures['A']:.0f} kPa |"
            if not step.converged:
                print(f"{at} {step.reason}", flush=True)
                continue
            x, _, z = step.translation
            turn, stable = float(np.degrees(step.rotation[1])), "" if step.stable else ", not stable"
            print(f"{at} {turn:.2f}° | {x:.2f} mm | {z:.2f} mm | stretch {step.max_stretch:.2f}{stable}", flush=True)


if __name__ == "__main__":
    main()
