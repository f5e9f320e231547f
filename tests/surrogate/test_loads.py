"""Fast models that depend on the force on the tip and on gravity: exact derivatives, and exact states on workers."""

import numpy as np
import pytest
import tiny as problems
from texts import problem_text
from typer.testing import CliRunner

import pneumorph as pm
from pneumorph.analysis import Explorer
from pneumorph.cli import app
from pneumorph.problem import loads
from pneumorph.study.cluster import connected
from pneumorph.study.states import StatesOnWorkers
from pneumorph.surrogate.inputs import FORCES, GRAVITIES, acting_at
from pneumorph.surrogate.reader import Model, ModelError
from pneumorph.surrogate.states import Sample, States

TEXT = """[end_effector]
kind = "plate"
[gravity]
direction = [-1, 0, 0]
[[task]]
name = "bend"
pressure = { A = "60 kPa" }
objective = { kind = "maximize", motion = "bending_y" }
[mesh]
size = "6 mm"
"""
BOUNDS = {"A": (0.0, 0.06)}
LOADS = dict.fromkeys(FORCES, (-0.2, 0.2)) | dict.fromkeys(GRAVITIES, (-1.0, 1.0))
AT = np.array([0.04, 0.1, -0.15, 0.05, 0.6, -0.5, 0.3])


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def problem():
    return loads(problem_text(TEXT, chambers=(("A", 1.6, "4 mm", "0 mm"),), body='control_density = "0.3 /mm"'))


def test_slopes_are_those_of_exact_states(problem):
    states = States(Explorer(problem, pm.starting_design(problem).body), BOUNDS, loads=LOADS)
    here = states.at(AT)
    assert isinstance(here, Sample) and here.slopes.shape == (7, 7)
    for column, step in enumerate([1e-4, *[1e-3] * 3, *[1e-2] * 3]):
        ends = [states.at(AT + sign * step * np.eye(7)[column]).values for sign in (1, -1)]
        expected = (ends[0] - ends[1]) / (2 * step)
        assert np.abs(here.slopes[:, column] - expected).max() < 2e-4 * np.abs(expected).max() + 1e-7
    # Against a force the tip is as soft as its compliance says.
    np.testing.assert_allclose(here.slopes[:3, 1:4], here.compliance[:3, :3], rtol=1e-6, atol=1e-9)


def test_gravity_that_turns_keeps_its_size(problem):
    under = pm.starting_design(problem).explorer().under
    turned = acting_at(under, {"gravity_x": 0.0, "gravity_y": 0.6, "gravity_z": -0.8, "force_y": 0.3})
    np.testing.assert_allclose(turned.acceleration, np.array([0, 0.6, -0.8]) * np.linalg.norm(under.acceleration))
    assert turned.force == (0.0, 0.3, 0.0)
    assert acting_at(under, dict.fromkeys(GRAVITIES, 0.0)).acceleration == (0.0, 0.0, 0.0)


def test_a_model_with_forces(tmp_path, problem):
    (tmp_path / "one.toml").write_text(
        problem_text(TEXT, chambers=(("A", 1.6, "4 mm", "0 mm"),), body='control_density = "0.3 /mm"')
    )
    result = run("model", tmp_path / "one.toml", "--force", "0.2 N")
    assert result.exit_code == 0, result.output
    model = Model(tmp_path / "one.npz")
    assert model.loads == FORCES and model.header["version"] == 2 and model.bounds.shape == (4, 2)
    states = States(
        Explorer(problem, pm.starting_design(problem).body), BOUNDS, loads=dict.fromkeys(FORCES, (-0.2, 0.2))
    )
    for p in np.random.default_rng(7).uniform(*model.bounds.T, (3, 4)):
        exact = states.at(p)
        off = model.pose(p).translation - exact.values[:3]
        assert np.linalg.norm(off) < 0.01 * model.header["ranges"]["translation_mm"]
        slopes = model.jacobian(p)
        np.testing.assert_allclose(slopes, exact.slopes[:6], atol=0.05 * np.abs(exact.slopes[:6]).max(axis=0).max())
    # The same place, whatever hangs at the tip: other pressures, as an exact state confirms.
    wanted = {"shift_x": float(model.pose({"A": 0.03}).translation[0])}
    found = model.pressures_for(wanted, loads={"force_x": 0.01})
    assert found.reached and abs(found.pressures["A"] - 0.03) > 1e-4
    exact = states.at(np.array([found.pressures["A"], 0.01, 0.0, 0.0]))
    assert exact.values[0] == pytest.approx(wanted["shift_x"], abs=3 * model.errors["translation_mm"])
    assert model.pose({"A": 0.03}).translation == pytest.approx(model.pose([0.03]).translation)
    for question, words in [({"force_q": 1.0}, "no such chamber or load"), ({"force_x": 1.0}, "1 N is not in")]:
        with pytest.raises(ModelError, match=words):
            model.pose(question)
    assert run("model", tmp_path / "one.toml", "--check", tmp_path / "one.npz").exit_code == 0
    assert run("workspace", tmp_path / "one.npz").exit_code == 0


@pytest.mark.slow
def test_states_from_workers_are_those_of_one_process(tmp_path, problem):
    states = [States(Explorer(problem, pm.starting_design(problem).body), BOUNDS) for _ in range(2)]
    points = [np.array([p]) for p in (0.01, 0.03, 0.05)]
    with connected(None, 2) as client:
        found = StatesOnWorkers(client, states[0])
        answers = found.all_searched(points, np.zeros(1))
    for point, answer in zip(points, answers, strict=True):
        np.testing.assert_allclose(answer.values, states[1].at(point).values, rtol=1e-5, atol=1e-6)
    assert found.solved == 3 and found.dofs == states[1].dofs


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--force", "2"), "force: "),
        (("--force", "-2N"), "force: "),
        (("--force", "2 mm"), "force: "),
        (("--gravity",), "gravity: the body has no weight"),
    ],
)
def test_a_mistake_is_one_line(tmp_path, options, words):
    (tmp_path / "tiny.toml").write_text(problems.tiny(spring='{ axial = "4 N/mm" }'))
    result = run("model", tmp_path / "tiny.toml", *options)
    assert result.exit_code == 2 and words in result.stderr and result.stderr.count("\n") == 1
