"""Motions back within the limits: what can be repaired is, and what cannot ends soon."""

import numpy as np
import pytest
from certifying import certified
from tiny import tiny

from pneumorph.errors import Hopeless
from pneumorph.limits.report import LimitReport
from pneumorph.limits.table import ROWS
from pneumorph.optimize import within
from pneumorph.optimize.linear_limits import linear_limits
from pneumorph.optimize.setup import Setup, build_setup
from pneumorph.optimize.start import begin_within
from pneumorph.optimize.within import Kept, Within
from pneumorph.problem import loads


@pytest.fixture(scope="module")
def setup() -> Setup:
    return build_setup(loads(tiny()))


def bulged(setup: Setup, amount: float) -> np.ndarray:
    """The start with bumps of an amount (mm) on all surfaces."""
    bumps = np.random.default_rng(0).normal(size=setup.space.n)
    return setup.space.start + amount * setup.smooth.apply(bumps)


def test_bumps_are_smoothed(setup: Setup) -> None:
    phi = bulged(setup, 0.5)
    assert not certified(setup.space.body(phi), setup.problem.limits).satisfied()
    found = setup.within(phi)
    assert isinstance(found, Within)
    assert certified(setup.space.body(found.phi), setup.problem.limits).satisfied()


def test_what_a_repair_is_to_keep_is_kept(setup: Setup) -> None:
    """Smoothing bumps moves some surfaces out; told to keep their mean place, it moves others instead."""
    phi = bulged(setup, 0.5)
    alone = setup.within(phi)
    assert isinstance(alone, Within)
    way = alone.phi - phi
    some = way > 0.1 * way.max()
    kept = Kept(phi, np.zeros(1), (some / some.sum())[None], 0.05 * float(way[some].mean()))
    assert kept.at(alone.phi) > 5 * kept.accuracy
    found = setup.within(phi, kept=kept)
    assert isinstance(found, Within)
    assert certified(setup.space.body(found.phi), setup.problem.limits).satisfied()
    assert kept.at(found.phi) <= kept.accuracy


def test_what_cannot_be_kept_is_let_go(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    """The shape comes first: what is kept besides is judged by itself later. Nothing waits for it."""
    motions, move = [], within.least_motion
    monkeypatch.setattr(within, "least_motion", lambda *given: motions.append(given) or move(*given))
    phi = bulged(setup, 0.5)
    alone = setup.within(phi)
    assert isinstance(alone, Within)
    way, needed = alone.phi - phi, len(motions)
    found = setup.within(phi, kept=Kept(phi, np.ones(1), np.zeros((1, setup.space.n)), 0.01))
    assert isinstance(found, Within) and np.array_equal(found.phi - phi, way)
    assert len(motions) - needed <= 4 * needed


def test_what_cannot_be_repaired_ends_soon(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a motion comes no nearer to the limits, others from there hardly ever do."""
    motions, move = [], within.least_motion

    def counted(*args):
        motions.append(args)
        return move(*args)

    monkeypatch.setattr(within, "least_motion", counted)
    # No variable may move back far enough.
    found = setup.within(bulged(setup, 0.7), reach=0.02)
    assert isinstance(found, LimitReport)
    assert not found.satisfied()
    # Of 112 that there would be.
    assert setup.settings.repair.motions_in_vain <= len(motions) < 40


def test_limits_that_conflict_are_named_with_how_far_they_are_missed() -> None:
    """A chamber 7 mm wide between walls of 2.9 mm needs 6.4 mm, of which the envelope has 6.1 mm."""
    rest = '[limits]\nwall = "2.9 mm"\nfold = { distance = "7 mm", neighbourhood = "7.5 mm" }\n'
    asked = loads(tiny().replace("[mesh]", f'{rest}envelope = {{ radius = "6.1 mm" }}\n[mesh]'))
    with pytest.raises(Hopeless) as caught:
        begin_within(build_setup(asked))
    message = str(caught.value)
    assert "violates limits." in message and " %, " in message and "\n" not in message
    assert sum(f"limits.{name}" in message for name in ("wall", "fold", "envelope")) > 1, message


def test_distances_change_as_they_are_expected_to_near_a_design(setup: Setup) -> None:
    space, (distances, others) = setup.space, setup.limits.of_distances
    phi, rng, spec = bulged(setup, 0.3), np.random.default_rng(1), setup.problem.limits
    here = linear_limits(space, distances, phi, 0.5, -0.5)
    change = setup.smooth.apply(rng.standard_normal(space.n))
    change *= setup.settings.repair.straight * min(spec.wall, spec.fold.distance) / np.abs(change).max()
    expected, there = here.moved(change), linear_limits(space, distances, phi + change, 0.5, -0.5)
    for kind in np.unique(there.rows.kind):
        worst = (float(rows.value[rows.kind == kind].max()) for rows in (expected.rows, there.rows))
        assert abs(next(worst) - next(worst)) < 5e-4, ROWS[kind]
    # Together with the others they are all limits.
    every = linear_limits(space, setup.limits, phi, 0.5, -0.5)
    both = here.with_others(linear_limits(space, others, phi, 0.5, -0.5))
    assert np.sort(both.rows.value) == pytest.approx(np.sort(every.rows.value))
    assert np.sort(both.jacobian @ change) == pytest.approx(np.sort(every.jacobian @ change))
