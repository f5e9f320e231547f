"""An area of contact with an obstacle."""

from __future__ import annotations

from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective, amount
from pneumorph.problem import ContactArea


def build(asked: ContactArea, scope: Scope) -> Objective:
    """The largest area of contact with an obstacle, or a target for it; mm² or mm⁴."""
    return amount(lambda f: f.contact[asked.obstacle].area, asked.area, "area_mm2")
