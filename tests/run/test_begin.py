"""Runs that begin with the last design of another one, for tasks that ask for something else."""

import numpy as np
import pytest
from texts import problem_text

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem, loads
from pneumorph.run import create, open_run
from pneumorph.run.complete import complete

BEND = """
[[task]]
name = "bend"
pressure = { A = { start = "30 kPa", min = "0 kPa", max = "60 kPa" } }
objective = { motion = "bending_y" }
[mesh]
size = "5 mm"
[optimizer]
iterations = 2
"""


def problem(**changes):
    text = problem_text(
        BEND, length=20, chambers=(("A", 2.5, "-3 mm", "0 mm"),), body='symmetry = { mirror = ["xz"] }\n'
        'control_density = "0.3 /mm"',
    )  # fmt: skip
    return loads(text).with_changes({key.replace("__", "."): value for key, value in changes.items()})


@pytest.fixture(scope="module")
def bent(tmp_path_factory):
    """A run that bends."""
    run = create(tmp_path_factory.mktemp("begin") / "bent", problem())
    complete(run, lambda event: None)
    return run


@pytest.mark.slow
def test_a_run_goes_on_from_a_design_for_another_task(bent, tmp_path):
    before = bent.history()[-1]
    least = 0.99 * np.degrees(before.tasks["bend"].rotation[1])
    less = problem().with_changes(
        {
            "task[0].objective": {"kind": "minimize", "of": "mass"},
            "task[0].limits": {"at_least": {"bending_y": f"{least} deg"}},
        }
    )
    run = create(tmp_path / "less", less, bent.path)
    complete(run, lambda event: None)
    first, *_, last = run.history()
    # The same body in the same state, of which the mass counts now.
    assert first.iteration == 0 and first.held
    assert first.tasks["bend"].rotation == pytest.approx(before.tasks["bend"].rotation, rel=1e-6)
    one, other = bent.load_design(before.iteration), run.load_design(0)
    np.testing.assert_array_equal(one.exterior, other.exterior)
    assert last.held and last.objective < 0.995 * first.objective
    assert np.degrees(last.tasks["bend"].rotation[1]) >= least * (1 - 1e-6)
    # It is a run like others, which is taken up again.
    assert open_run(run.path).result().completed


@pytest.mark.slow
def test_a_task_with_the_pressures_of_another_may_be_added(bent, tmp_path):
    before = bent.history()[-1]
    table = bent.problem.model_dump(mode="json", exclude_none=True)
    press = {
        "name": "press",
        "pressures_of": "bend",
        "hold": {"shift_x": "0 mm"},
        "objective": {"kind": "blocked", "motion": "shift_x"},
    }
    more = Problem.model_validate(table | {"task": [*table["task"], press]})
    run = create(tmp_path / "more", more, bent.path)
    complete(run, lambda event: None)
    first, *_, last = run.history()
    assert first.tasks["bend"].rotation == pytest.approx(before.tasks["bend"].rotation, rel=1e-6)
    assert first.tasks["press"].pressures == first.tasks["bend"].pressures
    assert abs(first.tasks["press"].translation[0]) < 1e-9
    assert last.objective < first.objective
    assert open_run(run.path).resumable() is not None
    # One with pressures of its own has others in every design.
    own = press | {"pressure": {"A": "20 kPa"}}
    del own["pressures_of"]
    with pytest.raises(ProblemError, match="another problem"):
        create(tmp_path / "own", Problem.model_validate(table | {"task": [*table["task"], own]}), bent.path)


@pytest.mark.slow
def test_a_run_goes_on_with_smaller_elements(bent, tmp_path):
    """The same body at the same pressures, in the state that the finer mesh has near the one before."""
    before = bent.history()[-1]
    run = create(tmp_path / "finer", problem(mesh__size="3.5 mm", optimizer__iterations=1), bent.path)
    complete(run, lambda event: None)
    first, last = run.history()
    one, other = bent.load_design(before.iteration), run.load_design(0)
    np.testing.assert_array_equal(one.exterior, other.exterior)
    assert first.tasks["bend"].pressures == before.tasks["bend"].pressures
    assert first.elements > 1.5 * before.elements
    assert first.tasks["bend"].rotation[1] == pytest.approx(before.tasks["bend"].rotation[1], rel=0.1)
    assert last.objective < first.objective and last.held


def test_what_it_cannot_begin_with_is_named(bent, tmp_path):
    with pytest.raises(ProblemError, match=r"another problem \(body.chamber\[0\].radius differs\)"):
        create(tmp_path / "other", problem(**{"body__chamber[0]__radius": "2.4 mm"}), bent.path)
    with pytest.raises(ProblemError, match="is not a run directory"):
        create(tmp_path / "none", problem(), tmp_path / "nothing")
    assert not (tmp_path / "other").exists()
