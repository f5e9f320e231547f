"""What `print` shows: a few lines, with units."""

import numpy as np
from runs import waving_run
from tiny import tiny

import pneumorph as pm
from pneumorph.geometry.tube import starting_body
from pneumorph.interface.text import sweep_text
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import loads
from pneumorph.results import Fields, SweepStep


def test_runs_and_designs_are_a_few_lines(tmp_path):
    problem = loads(tiny())
    mesh = mesh_body(starting_body(problem.tubes), 8.0).mesh
    still = Fields(mesh, {"extend": 0.0 * mesh.points}, {"extend": np.ones(len(mesh.points))})
    run = pm.open_run(waving_run(tmp_path / "run", problem, 3, {0: still}).path)
    for text in (str(run), repr(run), str(run.best)):
        assert 2 <= len(text.splitlines()) <= 6, text
        assert "extension" in text and " mm" in text
    assert "kPa" in str(run.best) and "design 2" in str(run.best)


def test_a_sweep_says_its_last_motions_and_what_failed():
    steps = [
        SweepStep("t", {"A": 1e-3 * p}, translation=(0.0, 0.0, 0.1 * p), rotation=(0.0, 0.01 * p, 0.0))
        for p in (0, 20, 40, 60)
    ]
    text = sweep_text([*steps, SweepStep("t", {"A": 0.08}, converged=False, reason="it balloons at 71 kPa")], 3.0)
    first, *rest = text.splitlines()
    assert "5 steps" in first and "4 with" in first
    assert len(rest) == 4 and "60 kPa: extension 6.00 mm" in rest[2] and "34.38°" in rest[2]
    assert "80 kPa: it balloons at 71 kPa" in rest[3]
