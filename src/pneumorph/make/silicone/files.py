"""All files of silicone moulds, in one folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from pneumorph.doing import doing
from pneumorph.geometry import Body
from pneumorph.make.checks import Check
from pneumorph.make.mould.bill import Item, bought, printed, weighed
from pneumorph.make.mould.effect import PortEffect
from pneumorph.make.mould.files import SHEET, write_assembly, write_bill_and_pictures, write_pieces
from pneumorph.make.mould.plan import Plan
from pneumorph.make.mould.proof import Part
from pneumorph.make.mould.sheet import reinforcing
from pneumorph.make.silicone.pieces import PLATE, pieces, rods
from pneumorph.make.silicone.plan import SiliconePlan, plan_silicone
from pneumorph.make.silicone.proof import proof
from pneumorph.make.silicone.sag import Sag
from pneumorph.make.silicone.sheet import write_sheet
from pneumorph.problem import Problem
from pneumorph.problem.material import elastomer


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
    with doing("planning the moulds"):
        planned = plan_silicone(body, problem.make, problem.limits.wall)
    changed = effects(planned) if effects else []
    sagging = sags(planned) if sags else []
    with doing("making the pieces of the moulds"):
        made = pieces(planned)
    written, parts, checks = write_pieces(made.pieces, folder, chord)
    assembled, valid = write_assembly(made.assembly, folder)
    with doing("testing the moulds"):
        checks += [valid, *proof(planned, parts, chord)]
    checks += [sag.check(problem.make.negative_sag) for sag in sagging]
    checks += [effect.check(problem.make.port_effect) for effect in changed]
    items = _bill(planned, parts, problem)
    sheet, told = folder / SHEET, [*reinforcing(problem), *(each.sentence for each in (*sagging, *changed))]
    with doing("drawing the assembly"):
        write_sheet(planned, parts, items, told, problem.title or "Silicone mould", sheet)
    return (*written, assembled, sheet, *write_bill_and_pictures(planned, items, folder)), tuple(checks)


def _bill(plan: SiliconePlan, parts: Sequence[Part], problem: Problem) -> list[Item]:
    """The bill of materials: everything that is needed."""
    rubber, silicone = problem.material, elastomer(plan.spec.silicone)
    body, negatives = (sum(each.solid.volume() for each in parts if each.role == role) for role in ("part", "negative"))
    items = weighed("rubber", rubber.name, rubber.density, body, plan.spec.waste)
    items += weighed("silicone for negatives", silicone.name, silicone.density, negatives, plan.spec.waste)
    items += [Item(f"print {each.name}", each.solid.volume() / 1000.0, "cm³") for each in printed(parts)]
    items += bought(plan, len(rods(plan)), sum(plan.deep) + 2.0 * PLATE)
    items.append(Item("adhesive for the rubber", 1, "pack", f"for {len(plan.offsets)} bonding faces"))
    return items
