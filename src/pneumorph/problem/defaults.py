"""Defaults of limits that depend on other tables of a problem."""

from __future__ import annotations

from typing import Any

from pneumorph.problem.materials import materials
from pneumorph.problem.models import Scaling
from pneumorph.problem.tables import Tables

MARGIN = 1.15
"""Least ratio of the pressure of the limit point ahead to the working pressure: that of a usual safety against it."""


def limits_by_default(problem: Tables) -> dict[str, Any]:
    """The limits by their keys that a problem has unless it says otherwise: bodies from files have `scaling`.

    The strain is limited where the range of every rubber is stated, and the margin where something is inflated.
    """
    ranged = all(material.valid_stretch is not None for material in materials(problem).values())
    inflated = any(pressure.max > 0.0 for task in problem.task for pressure in task.pressure.values())
    scaling = {} if problem.solid is None else {"scaling": Scaling()}
    return {"strain": 1.0 if ranged else "off", "margin": MARGIN if inflated else 1.0, **scaling}
