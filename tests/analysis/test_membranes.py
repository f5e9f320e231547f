"""Soft membranes, whose deflection under the first pressure is far less than it begins, and large after that."""

import pytest
from texts import problem_text

from pneumorph.interface.design import starting_design
from pneumorph.mechanics import Equilibrium, Tangent, configure, loads_of, sweep
from pneumorph.problem import loads

ROOF = """
[[body.chamber]]
name = "A"
radius = "22 mm"
center = ["0 mm", "0 mm"]
span = ["6 mm", "10.5 mm"]
[limits]
wall = "1.2 mm"
[end_effector]
kind = "free"
[[task]]
name = "lift"
pressure = { A = "1 kPa" }
objective = { kind = "maximize", motion = "extension" }
[mesh]
size = "8 mm"
"""


@pytest.mark.slow
def test_a_disc_of_soft_rubber_is_inflated_in_few_factorisations():
    """To a stretch of 1.7: in one step from rest, which is divided, and in steps that are not."""
    body = 'control_density = "0.5 /mm"\nsymmetry = { mirror = ["xz", "yz"] }'
    problem = loads(problem_text(ROOF, 12, 25, (), body, 'name = "Ecoflex 00-30"'))
    simulation = starting_design(problem).prepare_simulation({"A": "1 kPa"})
    model = simulation.model

    def inflated(*pressures):
        tangent = Tangent(model)
        path = [
            configure(model, simulation.mesh.points, loads_of(problem, model, {"A": 1e-3 * each})) for each in pressures
        ]
        *before, last = sweep(path, tangent)
        assert all(isinstance(each, Equilibrium) and each.stable for each in before)
        assert isinstance(last, Equilibrium) and last.stable
        return last, tangent.factorisations

    once, cost = inflated(3.0)
    assert once.max_stretch > 1.5 and cost <= 100
    steps, cost_of_steps = inflated(0.5, 1.0, 2.0, 3.0)
    assert abs(steps.volumes["A"] / once.volumes["A"] - 1.0) < 1e-8
    assert cost_of_steps <= 100
