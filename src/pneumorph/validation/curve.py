"""A measured curve of any body beside its prediction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.analysis.along import Curve, along, solved_along
from pneumorph.analysis.constants import fitted_in
from pneumorph.analysis.scatter import scatter_at
from pneumorph.analysis.tolerances import Tolerances, shape_causes
from pneumorph.doing import doing
from pneumorph.geometry import Body
from pneumorph.mechanics import Tangent
from pneumorph.problem import Problem, Task
from pneumorph.problem.quantities import shown
from pneumorph.validation.comparison import Comparison


def compared(
    problem: Problem, body: Body, task: Task, curve: Curve, swept: Sequence[str], tolerances: Tolerances
) -> Comparison:
    """A measured curve beside the prediction of a body, whose deviations are those of its tolerances to first order.

    Points with the same pressures are repetitions: their mean is compared, and their deviation is the scatter.

    Parameters
    ----------
    problem, body : one of its designs.
    task : whose loads act; of a force of the tip, one that holds the motion.
    curve : measured.
    swept : chambers whose pressure was measured; the first one is on the axis.
    tolerances : what varies.

    Raises
    ------
    ProblemError
        If there is friction, or a chamber is sealed or filled to a volume.
    ComputationError
        If a state is not found.
    """
    pressures, of = np.unique(np.round(curve.pressures, 9), axis=0, return_inverse=True)
    groups = [curve.values[of.ravel() == number] for number in range(len(pressures))]
    with doing("predicting the curve"):
        morph, points = along(problem, body, task, pressures, whole=True)
        tangent = Tangent(points[0].model)
        states = solved_along(points, pressures, tangent)
        shapes, fitted = list(shape_causes(morph, points[0].X, tolerances)), fitted_in(problem)
        predicted, error = [], []
        for at, state in zip(points, states, strict=True):
            tangent.move_to(at, state)
            scatter = scatter_at(at, tangent, state, morph, shapes, tolerances, fitted, (curve.quantity,))
            predicted.append(scatter.values[0])
            error.append(scatter.deviations[0])
    size, unit, word = shown(curve.quantity)
    first = [each.name for each in problem.body.chamber].index(swept[0])
    return Comparison(
        body=problem.title or "body",
        rubber=problem.material.name,
        quantity=word,
        unit=unit,
        case="",
        along=f"pressure of {' and '.join(swept)}, kPa",
        at=1e3 * pressures[:, first],
        measured=size * np.array([group.mean() for group in groups]),
        scatter=size * np.array([group.std(ddof=1) if len(group) > 1 else 0.0 for group in groups]),
        predicted=size * np.array(predicted),
        error=size * np.array(error),
        fitted=np.zeros(len(pressures), bool),
    )
