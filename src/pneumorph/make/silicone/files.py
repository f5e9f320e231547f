"""All files of silicone moulds, in one folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from pneumorph.geometry import Body
from pneumorph.make.checks import Check, validity
from pneumorph.make.mould.bill import write_bill
from pneumorph.make.mould.effect import PortEffect
from pneumorph.make.mould.files import write_pieces
from pneumorph.make.mould.picture import draw_mould
from pneumorph.make.mould.plan import Plan
from pneumorph.make.mould.walls import draw_walls
from pneumorph.make.silicone.bill import bill
from pneumorph.make.silicone.pieces import pieces
from pneumorph.make.silicone.plan import SiliconePlan, plan_silicone
from pneumorph.make.silicone.proof import proof
from pneumorph.make.silicone.sag import Sag
from pneumorph.make.silicone.sheet import write_sheet
from pneumorph.make.step import read_step, write_step
from pneumorph.problem import Problem


def make_silicone_mould(
    body: Body,
    problem: Problem,
    folder: Path,
    chord: float,
    effects: Callable[[Plan], Sequence[PortEffect]] | None = None,
    sags: Callable[[SiliconePlan], Sequence[Sag]] | None = None,
) -> tuple[tuple[Path, ...], tuple[Check, ...]]:
    """Write the pieces of a body's silicone moulds, their assembly, and how to use them; check what was written.

    Parameters
    ----------
    body, problem, folder, chord, effects :
        As for `pneumorph.make.mould.files.make_mould`.
    sags : callable, optional
        Computes how far the negatives sag.

    Raises
    ------
    ComputationError
        If the body cannot be moulded; says why, and where.
    OSError
        If a file cannot be written.
    """
    planned = plan_silicone(body, problem.make, problem.limits.wall)
    changed = effects(planned) if effects else []
    sagging = sags(planned) if sags else []
    made = pieces(planned)
    written, parts, checks = write_pieces(made.pieces, folder, chord)
    assembly = folder / "assembly.step"
    write_step(made.assembly, assembly)
    checks += [validity(assembly.name, read_step(assembly)), *proof(planned, parts, chord)]
    checks += [sag.check(problem.make.negative_sag) for sag in sagging]
    checks += [effect.check(problem.make.port_effect) for effect in changed]
    items = bill(planned, parts, problem)
    table, sheet, walls = folder / "bill.csv", folder / "assembly.pdf", folder / "wall.png"
    write_bill(items, table)
    told = [each.sentence for each in (*sagging, *changed)]
    write_sheet(planned, parts, items, told, problem.title or "Silicone mould", sheet)
    draw_walls(planned, walls)
    picture = folder / "mould.png"
    drawn = (picture,) if draw_mould(folder, picture) else ()
    return (*written, assembly, table, sheet, walls, *drawn), tuple(checks)
