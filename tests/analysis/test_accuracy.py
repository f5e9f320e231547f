"""The estimated error of the mesh against the change that a solution on the refined mesh makes."""

from dataclasses import replace

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

import pneumorph as pm
from pneumorph.analysis import accuracy, analyse_body
from pneumorph.analysis.accuracy import BEYOND, LEVER, mesh_errors, quick_errors
from pneumorph.analysis.simulate import prepare_simulation
from pneumorph.errors import Hopeless
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import Tangent, model_of, solve
from pneumorph.mechanics.solve.refined import guess_on_refined, on_refined
from pneumorph.mesh.refine import refine
from pneumorph.objective import measure_features
from pneumorph.problem import loads
from pneumorph.results import SweepStep, from_json, to_json

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
FIBRES = """
[[fibres]]
name = "wrap"
surfaces = ["exterior"]
stiffness = "5 N/mm"
winding = "70 deg"
"""
SHEET = """
[[membrane]]
name = "patch"
surfaces = ["exterior"]
stiffness = "2 N/mm"
angles = ["20 deg", "200 deg"]
"""
WALL = """
[[obstacle]]
name = "wall"
kind = "plane"
point = ["0 mm", "0 mm", "24.2 mm"]
normal = [0, 0, -1]
[contact]
self = false
"""
HARD = ONE.replace("20 kPa", "200 kPa")
CASES = {
    "plain": ("", TWO, TWO_BESIDE, "quadratic"),
    "mixed": ("", TWO, TWO_BESIDE, "mixed"),
    "quarter, mixed": ('symmetry = { mirror = ["xz", "yz"] }', ONE, None, "mixed"),
    "sector": ("symmetry = { rotation = 3 }", ONE, None, "quadratic"),
    "fibres": ("", HARD + FIBRES, None, "quadratic"),
    "sheet, half": ('symmetry = { mirror = ["yz"] }', HARD.replace("extension", "bending_x") + SHEET, None, "mixed"),
    "pressed": ("", HARD + WALL, None, "quadratic"),
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
    solved = solve(there, Tangent(model), on_refined(fine, coarse, equilibrium.state))
    moved = measure_features(model, there.X, solved.state)
    change = np.concatenate([moved.translation, moved.rotation]) - error.motion
    weights = np.repeat([1.0, LEVER], 3)
    assert np.abs(change).max() > 1e-4 and not error.fine.searched
    # Elements as large as the walls are thick: what few products leave out is largest there.
    assert np.linalg.norm(weights * (error.missing / BEYOND - change)) < 0.5 * np.linalg.norm(weights * change)
    for name, volume in moved.volume.items():
        grown = float(volume) - error.here.volumes[name]
        assert (error.fine.volumes[name] - error.here.volumes[name]) / BEYOND == pytest.approx(grown, rel=0.15)
    for name, on in moved.contact.items():
        pressed = float(on.normal) - error.here.contact_normal[name]
        found = (error.fine.contact_normal[name] - error.here.contact_normal[name]) / BEYOND
        assert found == pytest.approx(pressed, rel=0.2)
    assert (error.here.contact_normal.get("wall", 1.0)) > 0.1
    again = quick_errors(problem, at.disc, at.analysis)["move"]
    assert again.fine.translation == pytest.approx(error.fine.translation, rel=1e-6, abs=1e-9)


def test_a_search_on_the_refined_mesh_begins_with_mean_volume_ratios():
    """In a body that bends much, those of the coarser displacements make the tangent there indefinite."""
    text = TWO.replace("12 kPa", "200 kPa").replace("5 kPa", "0 kPa")
    problem = loads(problem_text(text, radius=10, chambers=TWO_BESIDE)).with_changes(
        {"mesh.size": "8 mm", "mesh.element": "quadratic"}
    )
    at = analyse_body(problem, starting_body(problem.tubes))
    fine = refine(at.disc.morph.mesh.at(at.analysis.X))
    (coarse,), (equilibrium,) = at.analysis.configurations.values(), at.analysis.equilibria.values()
    there = replace(coarse, model=model_of(problem, fine.mesh), X=fine.mesh.points)
    tangents = Tangent(there.model), Tangent(there.model)
    starts = on_refined(fine, coarse, equilibrium.state), guess_on_refined(fine, coarse, equilibrium.state)
    found = [solve(there, tangent, start) for tangent, start in zip(tangents, starts, strict=True)]
    assert tangents[1].factorisations < tangents[0].factorisations
    assert found[1].state.plate == pytest.approx(found[0].state.plate, rel=1e-5, abs=1e-7)


def test_gas_is_compressed_on_the_refined_mesh_too():
    """Where pressures follow from volumes, they are found with the state on the refined mesh."""
    text = problem_text(TWO.replace(', B = "5 kPa"', ""), radius=10, chambers=TWO_BESIDE)
    text = text.replace('name = "B"', 'name = "B"\ngas = { pressure = "10 kPa" }')
    problem = loads(text).with_changes({"mesh.size": "8 mm"})
    at = analyse_body(problem, starting_body(problem.tubes))
    (error,) = mesh_errors(problem, at.disc, at.analysis).values()
    assert not error.fine.searched and 0.0 < np.abs(error.missing[:3]).max() < np.abs(error.motion[:3]).max()
    assert error.fine.volumes["B"] != pytest.approx(error.here.volumes["B"], rel=1e-9)


def test_the_last_step_of_a_sweep_has_the_error_of_the_mesh():
    text = problem_text(ONE + '[end_effector]\nhold = ["axial"]\n', radius=10)
    problem = loads(text).with_changes({"mesh.size": "8 mm"})
    body = starting_body(problem.tubes)
    curves = []
    steps = list(prepare_simulation(problem, body, {"move": {"A": 0.02}}, {"A": "0:20:20 kPa"}).run(curves))
    assert [step.fine_translation is None for step in steps] == [True, False]
    assert curves[0].steps == steps and from_json(SweepStep, to_json(steps[1])) == steps[1]
    blocked, fine = steps[1].reaction["axial"], steps[1].fine_reaction["axial"]
    assert blocked < fine < 1.3 * blocked
    assert steps[1].volumes["A"] < steps[1].fine_volumes["A"]


def test_where_an_obstacle_touches_the_finer_faces_nothing_is_estimated(monkeypatch):
    """Quadratic faces bulge a little beyond the flat ones by which contact sees them."""
    start = pm.starting_design(loads(problem_text(ONE, radius=10)).with_changes({"mesh.size": "8 mm"}))
    assert start.mesh_errors()

    def touching(problem, mesh):
        raise Hopeless('obstacle "wall" touches the body at rest; move it away')

    monkeypatch.setattr(accuracy, "model_of", touching)
    assert start.mesh_errors() == {}
