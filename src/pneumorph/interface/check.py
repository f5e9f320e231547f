"""Check the gradient of a problem's objective."""

from __future__ import annotations

from pneumorph.analysis import GradientCheck, analyse_body, run_gradient_check
from pneumorph.interface.design import Design, starting_design
from pneumorph.problem import Problem


def check_gradient(asked: Problem | Design) -> GradientCheck:
    """Test the gradient of a problem's objective by Taylor remainders, at the starting body or at a design.

    If the gradient is right, the remainders fall with the square of the step.

    Parameters
    ----------
    asked : Problem, to test at its starting body, or Design

    Raises
    ------
    ComputationError
        If the body cannot be meshed or has no equilibrium.

    Examples
    --------
    >>> import pneumorph as pm
    >>> pm.check_gradient(pm.load("examples/small.toml")).passed
    True
    """
    design = asked if isinstance(asked, Design) else starting_design(asked)
    return run_gradient_check(analyse_body(design.problem, design.body))
