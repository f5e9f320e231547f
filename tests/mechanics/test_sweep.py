"""A sweep starts every equilibrium from the ones before it, and stops where there is none."""

from types import SimpleNamespace
from typing import Any, cast

import jax.numpy as jnp
import pytest

from pneumorph.mechanics import Configuration, NoEquilibrium
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mechanics.solve import sweep as module

SOLVER = cast(Any, SimpleNamespace(indefinite=0))


def at(pressure: float, contact: bool = True) -> Configuration:
    none, model = jnp.zeros(6), SimpleNamespace(contact="a wall" if contact else None)
    loads = Loads(jnp.array([pressure]), jnp.zeros(3), none, none)
    return Configuration(cast(Any, model), none, loads, cast(Any, None))


@pytest.fixture
def starts(monkeypatch):
    """A body that moves as its pressure, up to 0.1 MPa; the starts that were tried."""
    tried = []

    def solve(at, tangent, start=None, since=None, most=None, earlier=()):
        if most is None:
            return NoEquilibrium("without pressure none is looked for", 0.0, None)
        tried.append(None if start is None else float(start.plate[2]))
        # Where the secant leads nowhere, the load goes on from the step before.
        assert start is None or since is not None
        assert since is None or float(since[1].plate[2]) == float(since[0].loads.pressure[0])
        pressure = at.loads.pressure[0]
        if pressure > 0.1:
            return NoEquilibrium("it balloons", 0.0, None)
        return SimpleNamespace(stable=True, buckled={}, state=State(jnp.zeros((1, 3)), jnp.full(6, pressure)))

    monkeypatch.setattr(module, "solve", solve)
    monkeypatch.setattr(module, "predict_change", lambda begin, tangent, state, at: state)
    monkeypatch.setattr(module, "through", lambda *steps: steps[-1])
    monkeypatch.setattr(module, "diagnose", lambda at, tangent, failure: failure)
    return tried


def test_without_contact_every_step_is_predicted_from_the_one_before(starts):
    list(module.sweep((at(pressure, contact=False) for pressure in (0.0, 0.02, 0.04)), SOLVER))
    assert starts == [None, None, None]


def test_with_contact_every_step_starts_on_the_secant(starts):
    list(module.sweep(map(at, (0.0, 0.02, 0.04, 0.05, 0.05)), SOLVER))
    assert starts == [None, 0.0, pytest.approx(0.04), pytest.approx(0.05), pytest.approx(0.05)]


def test_it_stops_where_there_is_none(starts):
    found = list(module.sweep(map(at, (0.08, 0.12, 0.16)), SOLVER))
    assert len(starts) == 2
    assert found[1].reason == "it balloons"
    assert found[2].reason == "not tried, the sweep stopped before it: it balloons"
