"""Every example goes through for a design on a coarse mesh, gains by it, and resumes from every design."""

import math
from pathlib import Path

import numpy as np
import pytest

from pneumorph.analysis import checkpoint
from pneumorph.analysis.analyse import DESIGN_TOLERANCE
from pneumorph.mechanics.solve.balance import relative_residual
from pneumorph.optimize import DesignAccepted, Finished, design, loop, start, trial
from pneumorph.optimize.setup import build_setup
from pneumorph.problem import load
from pneumorph.run import StoredDesign, create
from pneumorph.study import load_study

FOLDER = Path(__file__).parents[1] / "examples"
PROBLEMS = sorted(FOLDER.glob("*.toml"))
STUDIES = sorted((FOLDER / "studies").glob("*.toml"))

LIGHTER = {"vacuum": {"task[0].pressure.A": "-2 kPa"}, "half_round": {"task[0].pressure.A": "10 kPa"}}
"""Changes for examples whose equilibria take minutes."""


def coarse(path):
    problem = load(path).with_changes(LIGHTER.get(path.stem, {}))
    return problem.model_copy(
        update={
            "mesh": problem.mesh.model_copy(update={"size": problem.body.radius / 1.4}),
            "body": problem.body.model_copy(update={"control_density": 0.3}),
            "optimizer": problem.optimizer.model_copy(update={"iterations": 1}),
        }
    )


def assert_it_resumes(run, setup, event):
    """A recorded design is restored from its checkpoint as it was: in equilibrium, without another step of Newton's."""
    state = run.resumable()
    disc, analysis = checkpoint.unpack(run.problem, setup.space, state, setup.mesher.heights)
    assert math.isclose(analysis.value, event.entry.objective, rel_tol=1e-10)
    for name, found in analysis.equilibria.items():
        assert found.factorisations <= 1
        np.testing.assert_array_equal(disc.model.vector(found.state), state[f"state {name}"])
        assert relative_residual(analysis.configurations[name], found.state) < DESIGN_TOLERANCE


@pytest.mark.slow
@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_an_example_goes_through(path, tmp_path, monkeypatch):
    """Its first step is made on a new mesh, so that both kinds of checkpoints are resumed from.

    The error of the mesh is estimated of the last design alone, and states on the way to it are for pictures, which
    others test.
    """
    monkeypatch.setattr(trial, "needs_remesh", lambda *_: "it is asked for")
    for module in (loop, start):
        monkeypatch.setattr(module, "with_errors", lambda setup, current, remeshed=False: current)
    monkeypatch.setattr(loop, "compute_inflation", lambda *_: (None, {}))
    problem = coarse(path)
    run, setup = create(tmp_path / "run", problem), build_setup(problem)
    values = []
    for event in design(problem):
        if isinstance(event, DesignAccepted):
            run.record(event.entry, StoredDesign.of(event.body, event.pressures), event.fields, event.state)
            assert_it_resumes(run, setup, event)
            values.append(event.entry.objective)
            assert event.entry.remeshed == bool(event.iteration)
    assert len(values) == 2
    assert values[1] < values[0]
    assert isinstance(event, Finished)
    assert event.held


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_a_study_is_sound(path):
    found = load_study(path)
    assert len(found.members) >= 5
    assert len({member.problem.to_toml() for member in found.members}) == len(found.members)
