"""All files of a mould, in one folder."""

# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from OCP.TopoDS import TopoDS_Shape

from pneumorph.doing import doing
from pneumorph.geometry import Body
from pneumorph.make.checks import Check, validity
from pneumorph.make.mould.bill import Item, bill, write_bill
from pneumorph.make.mould.drawing import draw_mould
from pneumorph.make.mould.effect import PortEffect
from pneumorph.make.mould.piece import Piece
from pneumorph.make.mould.pieces import pieces
from pneumorph.make.mould.plan import Plan, plan
from pneumorph.make.mould.proof import Part, part, proof
from pneumorph.make.mould.sheet import reinforcing, write_sheet
from pneumorph.make.mould.tessellation import Tessellation, tessellated
from pneumorph.make.mould.walls import draw_walls
from pneumorph.make.printing import read_3mf, write_3mf
from pneumorph.make.step import read_step, write_step
from pneumorph.problem import Problem

SHEET = "assembly.pdf"
"""The file with drawings, steps and bill."""


def make_mould(
    body: Body,
    problem: Problem,
    folder: Path,
    chord: float,
    effects: Callable[[Plan], Sequence[PortEffect]] | None = None,
) -> tuple[tuple[Path, ...], tuple[Check, ...]]:
    """Write the pieces of a body's mould, their assembly, and how to use them; check what was written.

    Parameters
    ----------
    body : Body
    problem : Problem
        For its tables [make], [limits] and [material].
    folder : Path
        Where to write; created if it does not exist.
    chord : float
        Largest distance in mm between the surfaces and the triangles of the 3MF files.
    effects : callable, optional
        Computes how much the ports change the motion of the body.

    Returns
    -------
    tuple of Path, tuple of Check
        Without ``mould.png`` where this machine cannot draw.

    Raises
    ------
    ComputationError
        If the body cannot be moulded; says why, and where.
    OSError
        If a file cannot be written.
    """
    rubber = problem.material
    with doing("planning the mould"):
        planned = plan(body, problem.make, problem.limits.wall, rubber.density)
    told = effects(planned) if effects else []
    with doing("making the pieces of the mould"):
        made = pieces(planned)
    written, parts, checks = write_pieces(made, folder, chord)
    assembled, valid = write_assembly(
        {each.name: each.shape for each in made if each.role in ("mould", "core")}, folder
    )
    with doing("testing the mould"):
        checks += [valid, *proof(planned, parts, chord), *(effect.check(problem.make.port_effect) for effect in told)]
    items = bill(planned, parts, rubber.name, rubber.density)
    sheet = folder / SHEET
    remarks = [*reinforcing(problem), *(effect.sentence for effect in told)]
    with doing("drawing the assembly"):
        write_sheet(planned, parts, items, remarks, problem.title or "Mould", sheet)
    return (*written, assembled, sheet, *write_bill_and_pictures(planned, items, folder)), tuple(checks)


@doing("writing the pieces of the mould")
def write_pieces(made: Sequence[Piece], folder: Path, chord: float) -> tuple[list[Path], list[Part], list[Check]]:
    """Write every piece as STEP and 3MF; read the files, and check the former."""
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    parts: list[Part] = []
    checks: list[Check] = []
    for piece in made:
        step, mesh = folder / f"{piece.name}.step", folder / f"{piece.name}.3mf"
        shape = tessellated(piece.shape, chord)
        write_step({piece.name: piece.shape}, step)
        write_3mf(mesh, {piece.name: shape.triangles})
        written += [step, mesh]
        checks.append(validity(step.name, read_step(step)))
        # What is proved is what is in the file.
        stored = next(iter(read_3mf(mesh).values()))
        parts.append(part(piece.name, piece.role, Tessellation(stored, shape.spline)))
    return written, parts, checks


def write_assembly(shapes: Mapping[str, TopoDS_Shape], folder: Path) -> tuple[Path, Check]:
    """Write shapes in their places as one STEP file, and check it."""
    path = folder / "assembly.step"
    write_step(shapes, path)
    return path, validity(path.name, read_step(path))


@doing("drawing the mould")
def write_bill_and_pictures(plan: Plan, items: Sequence[Item], folder: Path) -> tuple[Path, ...]:
    """Write the bill, the thickness of the walls, and the picture of the mould where this machine can draw it."""
    table, walls, picture = (folder / name for name in ("bill.csv", "wall.png", "mould.png"))
    write_bill(items, table)
    draw_walls(plan, walls)
    return (table, walls, picture) if draw_mould(folder, picture) else (table, walls)
