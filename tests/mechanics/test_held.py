"""A plate that is held at a value: reactions, work, prediction, and loads that break a symmetry."""

import numpy as np
import pytest

from pneumorph.mechanics import Equilibrium, Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.mechanics.solve.prediction import predict_change
from pneumorph.verify.solids import tube

BENDING = 4
SILICONE = {"plain": neo_hookean_rubber(0.49, 4.80, 1.1e-9), "mixed": neo_hookean_rubber(0.49, 490.0, 1.1e-9)}


def held_at(model, mesh, component, value, pressure=0.03, start=None, tangent=None):
    loads = build_loads(model, {"A": pressure}, held=value * np.eye(6)[component])
    at = configure(model, mesh.points, loads, np.arange(6) == component)
    found = solve(at, tangent or Tangent(model), start)
    assert isinstance(found, Equilibrium), found
    return at, found


@pytest.fixture(scope="module", params=SILICONE)
def built(request):
    mesh = tube(4, 8, 24, (1, 8, 4))
    return mesh, build_model(mesh, SILICONE[request.param], mixed=request.param == "mixed")


@pytest.mark.parametrize(("component", "value"), [(BENDING, np.radians(30.0)), (2, 3.0), (5, np.radians(-20.0))])
def test_a_load_as_large_as_the_reaction_holds_the_plate_too(built, component, value):
    mesh, model = built
    _, found = held_at(model, mesh, component, value)
    assert found.plate[component] == pytest.approx(value, abs=1e-14)
    pushed = build_loads(model, {"A": 0.03}, wrench=-found.reaction)
    free = solve(configure(model, mesh.points, pushed), Tangent(model), found.state)
    assert free.plate == pytest.approx(found.plate, abs=1e-5 * abs(value))
    assert np.count_nonzero(found.reaction) == 1 and abs(found.reaction[component]) > 1e-2


def test_where_it_would_go_by_itself_nothing_is_needed_to_hold_it(built):
    mesh, model = built
    free = solve(configure(model, mesh.points, build_loads(model, {"A": 0.03})), Tangent(model))
    _, found = held_at(model, mesh, 2, free.plate[2])
    _, blocked = held_at(model, mesh, 2, 0.0)
    assert abs(found.reaction[2]) < 1e-5 * abs(blocked.reaction[2])


def test_the_prediction_of_a_motion_is_of_first_order(built):
    mesh, model = built
    tangent = Tangent(model)
    at, found = held_at(model, mesh, BENDING, 0.1, tangent=tangent)
    errors = []
    for step in (0.04, 0.02, 0.01):
        there, exact = held_at(model, mesh, BENDING, 0.1 + step, start=found.state)
        ahead = predict_change(at, tangent, found.state, there)
        errors.append(np.linalg.norm(model.vector(ahead)[:-6] - model.vector(exact.state)[:-6]))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(2.0, abs=0.15)
