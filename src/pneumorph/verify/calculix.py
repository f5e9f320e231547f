"""Equilibria by CalculiX, from the exported input file, with its own elements, quadrature and solver."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator, Sequence

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.mechanics import Configuration
from pneumorph.mesh.tets import TetMesh
from pneumorph.output.formats.abaqus import abaqus_input, as_whole, body_lines, element_faces, plate_nodes, rubber_lines
from pneumorph.processes import run, temporary_folder
from pneumorph.verify.verdict import Unavailable

MOST_SECONDS = 900
"""After which CalculiX is ended."""


def program() -> str:
    """Path of the program; raises Unavailable if it is not installed."""
    path = shutil.which("ccx")
    if path is None:
        raise Unavailable("CalculiX is not installed; apt-get install calculix-ccx")
    return path


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
    """Displacements (N, 3) in mm and the motion of the plate (6,) found by CalculiX.

    Parameters
    ----------
    mesh : TetMesh
    at : Configuration
        Its model, nodes and loads; for part of a body the whole is solved.
    increment : float
        The first fraction of the load.
    tolerance : float
        Residual over the mean force at which CalculiX has converged.

    Raises
    ------
    ComputationError
        If CalculiX finds no solution.
    """
    mesh, at = as_whole(mesh, at)
    rows = last_table(solved(abaqus_input(mesh, at, increment, tolerance)))
    if len(rows) < len(mesh.points):
        raise ComputationError("CalculiX did not give the displacements of all nodes")
    u = np.array([rows[node] for node in range(1, len(mesh.points) + 1)])
    if not at.model.plate:
        return u, np.zeros(6)
    return u, np.concatenate([rows[node] for node in plate_nodes(mesh)])


def tip_forces(
    mesh: TetMesh, at: Configuration, sides: tuple[np.ndarray, np.ndarray], stiffness: float, motions: Sequence[float]
) -> np.ndarray:
    """The forces (M, 3) in N that hold the tip, moved along y by each of the `motions` in mm, one after the other.

    Parameters
    ----------
    at : Configuration
        On the model of the mesh; only its rubbers and supports count.
    sides : two (nf, 6) int arrays
        Faces of the body that may touch each other: the second is where those of the first press.
    stiffness : float
        Contact pressure over the depth to which they go through each other, MPa/mm.

    Raises
    ------
    ComputationError
        If CalculiX does not find the forces of all motions.
    """
    text = "\n".join([*body_lines(mesh), *rubber_lines(mesh, at), *_moved(mesh, at, sides, stiffness, motions), ""])
    forces = total_forces(solved(text))
    if len(forces) != len(motions):
        raise ComputationError(f"CalculiX gave {len(forces)} forces for {len(motions)} motions")
    return forces


def _moved(
    mesh: TetMesh, at: Configuration, sides: tuple[np.ndarray, np.ndarray], stiffness: float, motions: Sequence[float]
) -> Iterator[str]:
    """Supports, frictionless contact of two surfaces face to face, and a step for each motion of the tip."""
    tip = np.unique(mesh.faces["tip"])
    yield "*BOUNDARY"
    for node, component in np.argwhere(at.model.supports):
        if node not in tip:
            yield f"{node + 1}, {component + 1}, {component + 1}"
    for name, triangles in zip(("SIDE1", "SIDE2"), sides, strict=True):
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        yield from (f"{e + 1}, S{f + 1}" for e, f in zip(*element_faces(mesh, triangles), strict=True))
    yield "*SURFACE INTERACTION, NAME=TOUCH"
    yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
    yield f"{stiffness:g}"
    yield "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE"
    yield "SIDE1, SIDE2"
    for motion in motions:
        yield "*STEP, NLGEOM, INC=1000"
        yield "*STATIC"
        yield "0.2, 1., 1e-5, 0.5"
        yield "*BOUNDARY"
        yield "TIP, 1, 1"
        yield f"TIP, 2, 2, {motion:.12e}"
        yield "TIP, 3, 3"
        yield "*NODE PRINT, NSET=TIP, TOTALS=ONLY, FREQUENCY=1000"
        yield "RF"
        yield "*END STEP"


def solved(text: str) -> str:
    """What CalculiX writes to its .dat file for an input file."""
    with temporary_folder() as folder:
        (folder / "model.inp").write_text(text, encoding="ascii")
        try:
            printed = run([program(), "model"], MOST_SECONDS, folder).stdout
        except subprocess.TimeoutExpired:
            raise ComputationError(f"CalculiX took more than {MOST_SECONDS} s") from None
        if "Job finished" not in printed:
            errors = [line.strip() for line in printed.splitlines() if "*ERROR" in line]
            raise ComputationError(f"CalculiX did not finish: {errors[0] if errors else 'it gave no reason'}")
        table = folder / "model.dat"
        return table.read_text(encoding="ascii") if table.exists() else ""


def total_forces(text: str) -> np.ndarray:
    """The forces (n, 3) from a .dat file that has nothing but sums over one set of nodes."""
    rows = [line.split() for line in text.splitlines()]
    return np.array([row for row in rows if len(row) == 3 and row[0][-1].isdigit()], dtype=float).reshape(-1, 3)


def last_table(text: str) -> dict[int, np.ndarray]:
    """Displacements (3,) by node from a .dat file, of the last increment, which is printed last."""
    rows = {}
    for line in text.splitlines():
        words = line.split()
        if len(words) == 4 and words[0].isdigit():
            rows[int(words[0])] = np.array([float(word) for word in words[1:]])
    return rows
