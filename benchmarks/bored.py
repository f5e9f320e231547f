"""Writes an arm as a body from a file: a cylinder with three bores, and its problem.

python benchmarks/bored.py NAME
"""

from __future__ import annotations

import math
import sys

from pneumorph.bodies.parts import Part
from pneumorph.bodies.start import Start

TURNS = (180.0, 60.0, -60.0)
"""Where the bores are around the axis, degrees."""

TEXT = """title = "Arm from a CAD file"

[material]
name = "Dragon Skin 30"

[body]
file = "STEP"

{chambers}
[design]
spacing = "8 mm"

[end_effector]
kind = "plate"

[gravity]
direction = [-1, 0, 0]

[[task]]
name = "full"
pressure = {{ A = "50 kPa", B = "50 kPa", C = "50 kPa" }}
objective = {{ kind = "maximize", motion = "extension" }}

[limits]
wall = "1.5 mm"
fold = {{ distance = "1 mm", neighbourhood = "2 mm" }}
envelope = {{ radius = "14 mm" }}

[mesh]
size = "6 mm"

[optimizer]
iterations = 3
"""


def bored() -> Start:
    """The arm, 70 mm long with a radius of 11 mm, and bores with a radius of 3 mm."""
    centres = [(6.0 * math.cos(math.radians(turn)), 6.0 * math.sin(math.radians(turn))) for turn in TURNS]
    chambers = "\n".join(
        f'[[body.chamber]]\nname = "{name}"\ninside = ["{x:.3f} mm", "{y:.3f} mm", "35 mm"]\n'
        for name, (x, y) in zip("ABC", centres, strict=True)
    )
    body = Part(True, "cylinder", (0.0, 0.0, 0.0, 11.0, 70.0))
    bores = [Part(False, "cylinder", (x, y, 3.0, 3.0, 64.0)) for x, y in centres]
    return Start(TEXT.format(chambers=chambers), (body, *bores))


if __name__ == "__main__":
    print(bored().write(sys.argv[1]))
