"""`pneumorph accuracy`: the error of the mesh of a run is that of its own mesh."""

import numpy as np
import pytest
from tiny import tiny as problem_text

import pneumorph as pm


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A run of two designs."""
    folder = tmp_path_factory.mktemp("accuracy")
    (folder / "tiny.toml").write_text(problem_text(spring='{ axial = "4 N/mm" }'))
    problem = pm.load(folder / "tiny.toml").with_changes({"optimizer.iterations": 2})
    return pm.design(problem, folder / "run")


def test_the_error_of_a_run_is_that_of_its_own_mesh(run, done):
    """To the tolerance of the states; a new mesh would give another by several per cent."""
    (name,) = done.result.finer
    here, fine = done.best.mesh_errors()[name], done.result.finer[name]
    np.testing.assert_allclose(here.corrected[:3], fine.translation, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(here.motion[:3], done.result.tasks[name].translation, rtol=1e-5, atol=1e-9)
    printed = run("accuracy", done.path)
    assert printed.exit_code == 0 and f"{name}: extension" in printed.stdout and "not stored" not in printed.stdout
    assert "most likely nearer to the truth" in printed.stdout


def test_it_is_told_where_the_mesh_is_not_stored(run, done):
    """The fields of the first and of the last design are stored."""
    assert done.design(1).stored is None
    printed = run("accuracy", done.path, "--design", "1")
    assert printed.exit_code == 0 and "not stored" in printed.stdout.splitlines()[0]
