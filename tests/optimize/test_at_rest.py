"""Designs leave obstacles in their places their room: without pressure the body does not reach into them."""

import pytest

import pneumorph as pm
from pneumorph.mechanics import model_of
from pneumorph.problem import load


@pytest.mark.slow
def test_fingers_do_not_reach_into_the_ball_at_rest(tmp_path):
    path = pm.bodies.hand(2, "14 mm", "4 mm", "20 mm", "12 mm", "11 mm", 1).write(tmp_path / "hand")
    changes = {
        "mesh.size": "4.5 mm",
        "obstacle[0].radius": "6.6 mm",
        "optimizer.iterations": 4,
        "optimizer.step": "0.3 mm",
    }
    problem = load(path).with_changes(changes)
    designs = list(pm.designs(problem))
    assert designs[-1].entry.objective < designs[0].entry.objective
    for design in designs:
        # Refuses a body that an obstacle touches at rest.
        assert model_of(problem, design.fields.mesh if design.stored is None else design.stored.mesh).contact
