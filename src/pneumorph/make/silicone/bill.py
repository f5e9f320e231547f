"""The bill of materials of silicone moulds."""

from __future__ import annotations

from collections.abc import Sequence

from pneumorph.make.mould.bill import Item, bought, printed, weighed
from pneumorph.make.mould.proof import Part
from pneumorph.make.silicone.pieces import PLATE, rods
from pneumorph.make.silicone.plan import SiliconePlan
from pneumorph.problem import Problem
from pneumorph.problem.material import elastomer


def bill(plan: SiliconePlan, parts: Sequence[Part], problem: Problem) -> list[Item]:
    """Everything that is needed."""
    rubber, silicone = problem.material, elastomer(plan.spec.silicone)
    body, negatives = (sum(each.solid.volume() for each in parts if each.role == role) for role in ("part", "negative"))
    items = weighed("rubber", rubber.name, rubber.density, body, plan.spec.waste)
    items += weighed("silicone for negatives", silicone.name, silicone.density, negatives, plan.spec.waste)
    items += [Item(f"print {each.name}", each.solid.volume() / 1000.0, "cm³") for each in printed(parts)]
    items += bought(plan, len(rods(plan)), sum(plan.deep) + 2.0 * PLATE)
    items.append(Item("adhesive for the rubber", 1, "pack", f"for {len(plan.offsets)} bonding faces"))
    return items
