"""Every example goes through for a design on a coarse mesh, and gains by it."""

from pathlib import Path

import pytest

from pneumorph.optimize import DesignAccepted, Finished, design
from pneumorph.problem import load
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


@pytest.mark.slow
@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_an_example_goes_through(path):
    events = list(design(coarse(path)))
    accepted = [event for event in events if isinstance(event, DesignAccepted)]
    values = [event.entry.objective for event in accepted]
    assert len(values) >= 2
    assert values[1] < values[0]
    assert isinstance(events[-1], Finished)
    assert events[-1].held


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_a_study_is_sound(path):
    found = load_study(path)
    assert len(found.members) >= 5
    assert len({member.problem.to_toml() for member in found.members}) == len(found.members)
