"""Designs analysed to the last digit, and what a design loop accepted."""

from pneumorph.analysis import Analysis, analyse, discretise
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import TOLERANCE, NoEquilibrium
from pneumorph.optimize import DesignAccepted
from pneumorph.optimize.settings import LoopSettings

BRIEFLY = LoopSettings(looked_at=False)
"""Of loops whose last design is not looked at, which on small meshes takes as long as several designs: for tests of how
designs follow each other, beside one of the same kind whose end is looked at."""


def accepted(events):
    """The accepted designs among the events of a loop."""
    return [event for event in events if isinstance(event, DesignAccepted)]


def solved(problem, space, disc, phi, starts=None) -> Analysis:
    """The analysis of a design Φ, far more accurate than the loop's."""
    found = analyse(problem, space, disc, phi, starts, tolerance=1e-10)
    assert not isinstance(found, NoEquilibrium), found
    return found


def analysed(problem):
    """The design space, the mesh and the analysis of the starting tube of a problem."""
    body = starting_body(problem.tubes)
    space, disc = build_design_space(problem, body), discretise(problem, body)
    return space, disc, analyse(problem, space, disc, space.start, tolerance=TOLERANCE)
