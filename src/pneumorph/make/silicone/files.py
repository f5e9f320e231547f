"""All files of silicone moulds, in one folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from pneumorph.geometry import Body
from pneumorph.make.checks import Check
from pneumorph.make.mould.effect import PortEffect
from pneumorph.make.mould.files import SHEET, write_assembly, write_bill_and_pictures, write_pieces
from pneumorph.make.mould.plan import Plan
from pneumorph.make.mould.sheet import reinforcing
from pneumorph.make.silicone.bill import bill
from pneumorph.make.silicone.pieces import pieces
from pneumorph.make.silicone.plan import SiliconePlan, plan_silicone
from pneumorph.make.silicone.proof import proof
from pneumorph.make.silicone.sag import Sag
from pneumorph.make.silicone.sheet import write_sheet
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
    assembled, valid = write_assembly(made.assembly, folder)
    checks += [valid, *proof(planned, parts, chord)]
    checks += [sag.check(problem.make.negative_sag) for sag in sagging]
    checks += [effect.check(problem.make.port_effect) for effect in changed]
    items = bill(planned, parts, problem)
    sheet, told = folder / SHEET, [*reinforcing(problem), *(each.sentence for each in (*sagging, *changed))]
    write_sheet(planned, parts, items, told, problem.title or "Silicone mould", sheet)
    return (*written, assembled, sheet, *write_bill_and_pictures(planned, items, folder)), tuple(checks)
