"""One figure of the free motion and the blocked force of actuators along a pressure sweep.

    pneumorph simulate runs/NAME --pressure A=0:60:5kPa --csv FOLDER/NAME_free.csv
    pneumorph simulate runs/NAME --pressure A=0:60:5kPa --block shift_x --csv FOLDER/NAME_blocked.csv
    python benchmarks/curves.py FOLDER PICTURE.png NAME [NAME …]

The blocked component determines which motion is drawn: extension with the force along the axis, bending with the force
across it, twist with the torque about it.
"""

import csv
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

COLUMNS = {
    "reaction_axial_N": ("translation_z_mm", "extension, mm", "blocked force, N"),
    "reaction_shift_x_N": ("rotation_y_deg", "bending, degrees", "blocked force across, N"),
    "reaction_torsion_N_mm": ("rotation_z_deg", "twist, degrees", "blocked torque, N·mm"),
}
PRESSURE = "pressure_A_kPa"


def columns(path: Path) -> dict[str, np.ndarray]:
    """The numeric columns of a table, for the steps that converged."""
    with path.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["converged"] == "true"]
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if _number(rows[0][name])}


def _number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def main(folder: str, picture: str, *names: str) -> None:
    figure, panels = plt.subplots(-(-len(names) // 3), 3, figsize=(13, 3.6 * -(-len(names) // 3)), squeeze=False)
    for panel, name in zip(panels.flat, names, strict=False):
        free, blocked = (columns(Path(folder, f"{name}_{kind}.csv")) for kind in ("free", "blocked"))
        reaction = next(column for column in COLUMNS if column in blocked)
        motion, moved, effort = COLUMNS[reaction]
        sign = np.sign(free[motion][-1])
        (line,) = panel.plot(free[PRESSURE], sign * free[motion], "o-", ms=3)
        beside = panel.twinx()
        beside.plot(blocked[PRESSURE], np.abs(blocked[reaction]), "s--", ms=3, color="C1")
        panel.set(title=name, xlabel="pressure, kPa")
        panel.set_ylabel(moved, color=line.get_color())
        beside.set_ylabel(effort, color="C1")
        print(f"{name}: {sign * free[motion][-1]:.2f} {moved.split(', ')[1]} at {free[PRESSURE][-1]:g} kPa, "
              f"{abs(blocked[reaction][-1]):.3g} {effort.split(', ')[1]} at {blocked[PRESSURE][-1]:g} kPa")  # fmt: skip
    for panel in panels.flat[len(names) :]:
        panel.set_visible(False)
    figure.tight_layout()
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(*sys.argv[1:])
