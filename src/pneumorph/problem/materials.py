"""The rubbers of a problem."""

from __future__ import annotations

from collections.abc import Mapping

from pneumorph.problem.material import Material
from pneumorph.problem.regions import REST
from pneumorph.problem.tables import Tables


def materials(problem: Tables) -> Mapping[str, Material]:
    """The material of every region by its name, first that of what is in none (`REST`)."""
    return {REST: problem.material} | {region.name: region.material for region in problem.region}
