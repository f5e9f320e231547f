"""The estimated error of the mesh against the change that a solution on the refined mesh makes."""

from dataclasses import replace

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis import analyse_body
from pneumorph.analysis.accuracy import BEYOND, finest_motions, mesh_errors, on_refined
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import Tangent, model_of, solve
from pneumorph.mesh.refine import refine
from pneumorph.objective import measure_features
from pneumorph.problem import loads

TWO = """
[end_effector]
spring = { axial = "0.5 N/mm" }
force = ["0.1 N", "0 N", "0 N"]
[[task]]
name = "move"
pressure = { A = "12 kPa", B = "5 kPa" }
objective = { motion = "bending_y" }
"""
ONE = """
[[task]]
name = "move"
pressure = { A = "20 kPa" }
objective = { motion = "extension" }
"""
CASES = {
    "plain": ("", TWO, TWO_BESIDE, "quadratic"),
    "mixed": ("", TWO, TWO_BESIDE, "mixed"),
    "quarter, mixed": ('symmetry = { mirror = ["xz", "yz"] }', ONE, None, "mixed"),
    "sector": ("symmetry = { rotation = 3 }", ONE, None, "quadratic"),
}


@pytest.mark.parametrize("case", list(CASES))
def test_the_estimate_is_what_one_refinement_changes(case):
    symmetry, task, chambers, element = CASES[case]
    options = {} if chambers is None else {"chambers": chambers}
    problem = loads(problem_text(task, radius=10, body=symmetry, **options)).with_changes(
        {"mesh.size": "8 mm", "mesh.element": element}
    )
    at = analyse_body(problem, starting_body(problem.tubes))
    (error,) = mesh_errors(problem, at.disc, at.analysis).values()
    fine = refine(at.disc.morph.mesh.at(at.analysis.X))
    model = model_of(problem, fine.mesh)
    (coarse,), (equilibrium,) = at.analysis.configurations.values(), at.analysis.equilibria.values()
    there = replace(coarse, model=model, X=fine.mesh.points)
    solved = solve(there, Tangent(model), on_refined(at.disc, fine, coarse, equilibrium.state))
    moved = measure_features(model, there.X, solved.state)
    change = np.concatenate([moved.translation, moved.rotation]) - error.motion
    largest = np.abs(change).max()
    assert largest > 1e-4
    np.testing.assert_allclose(error.missing / BEYOND, change, atol=0.1 * largest)
    assert finest_motions(problem, at.disc, at.analysis)["move"] == pytest.approx(error.corrected.tolist())
