"""The body from which the designs of a problem start, and what of it is designed, whatever its surfaces are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pneumorph.geometry.body import Body
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.geometry.lattice.start import lattice_body
from pneumorph.geometry.lattice.variables import lattice_space
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space

if TYPE_CHECKING:
    from pneumorph.problem import Problem


def body_of(problem: Problem) -> Body:
    """The body from which the designs of a problem start."""
    return lattice_body(problem) if problem.solid is not None else starting_body(problem.tubes)


def space_of(problem: Problem, body: Body | None = None) -> DesignSpace:
    """The design variables of a problem, where they begin with a body of its kind: by default with its own."""
    start = body_of(problem) if body is None else body
    return lattice_space(problem, start) if problem.solid is not None else build_design_space(problem, start)
