"""Equilibria by CalculiX, from the exported input file, with its own elements, quadrature and solver."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.mechanics import Configuration
from pneumorph.mesh.tets import TetMesh
from pneumorph.output.abaqus import abaqus_input, as_whole, plate_nodes
from pneumorph.processes import run, temporary_folder
from pneumorph.verify.verdict import Unavailable

MOST_SECONDS = 900


def program() -> str:
    """Path of the program; raises Unavailable if it is not installed."""
    found = shutil.which("ccx")
    if found is None:
        raise Unavailable("CalculiX is not installed; apt-get install calculix-ccx")
    return found


def version() -> str | None:
    """Version of the installed program; None if there is none."""
    try:
        output = subprocess.run([program(), "-v"], capture_output=True, text=True, check=False).stdout
    except Unavailable:
        return None
    return output.split()[-1] if output.split() else None


def equilibrium(
    mesh: TetMesh, at: Configuration, increment: float = 0.2, tolerance: float = 5e-3
) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (N, 3) in mm and the motion of the plate (6,) found by CalculiX; for part of a body, of the whole.

    `increment` is the first fraction of the load, `tolerance` the residual over the mean force for convergence.
    """
    mesh, at = as_whole(mesh, at)
    with temporary_folder() as folder:
        (folder / "model.inp").write_text(abaqus_input(mesh, at, increment, tolerance), encoding="ascii")
        try:
            printed = run([program(), "model"], MOST_SECONDS, folder).stdout
        except subprocess.TimeoutExpired:
            raise ComputationError(f"CalculiX took more than {MOST_SECONDS} s") from None
        table = folder / "model.dat"
        rows = last_table(table.read_text(encoding="ascii")) if table.exists() else {}
    if "Job finished" not in printed or len(rows) < len(mesh.points):
        errors = [line.strip() for line in printed.splitlines() if "*ERROR" in line]
        raise ComputationError(f"CalculiX did not finish: {errors[0] if errors else 'it gave no reason'}")
    u = np.array([rows[node] for node in range(1, len(mesh.points) + 1)])
    if not at.model.plate:
        return u, np.zeros(6)
    return u, np.concatenate([rows[node] for node in plate_nodes(mesh)])


def last_table(text: str) -> dict[int, np.ndarray]:
    """Displacements (3,) by node from a .dat file, of the last increment, which is printed last."""
    rows = {}
    for line in text.splitlines():
        words = line.split()
        if len(words) == 4 and words[0].isdigit():
            rows[int(words[0])] = np.array([float(word) for word in words[1:]])
    return rows
