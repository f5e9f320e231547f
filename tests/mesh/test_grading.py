"""Meshes of which some elements are bisected, for the benchmark of graded meshes."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from texts import problem_text

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import part_of
from pneumorph.mesh.tets import TET_FACES, area_and_volume
from pneumorph.problem import loads

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "grading.py"
TASK = '[[task]]\nname = "move"\npressure = { A = "10 kPa" }\nobjective = { motion = "extension" }\n'


def test_bisected_meshes_fit_together_and_have_the_same_body():
    spec = importlib.util.spec_from_file_location("grading", SCRIPT)
    grading = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(grading)
    text = problem_text(TASK, radius=10).replace("[body]", '[body]\nsymmetry = { mirror = ["xz", "yz"] }', 1)
    problem = loads(text).with_changes({"mesh.size": "8 mm"})
    mesh = mesh_of(problem, starting_body(problem.tubes), part_of(problem)).mesh
    fine = grading.bisected(mesh, np.arange(0, len(mesh.tets), 7))
    there = fine.mesh
    assert len(mesh.tets) < len(there.tets) < 8 * len(mesh.tets)
    assert there.volume() == pytest.approx(mesh.volume(), rel=1e-12)
    for name, face in mesh.faces.items():
        np.testing.assert_allclose(
            area_and_volume(there.points, there.faces[name])[0], area_and_volume(mesh.points, face)[0], atol=1e-9
        )
    # Every face of an element is one of two elements, or one of the mesh's faces.
    inside = np.sort(there.tets[:, TET_FACES].reshape(-1, 3), axis=1)
    outside = np.sort(np.concatenate(list(there.faces.values()))[:, :3], axis=1)
    assert set(np.unique(np.concatenate([inside, outside]), axis=0, return_counts=True)[1]) == {2}
    np.testing.assert_array_equal(there.points, fine.P @ mesh.points)
