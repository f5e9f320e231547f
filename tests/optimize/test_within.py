"""Motions back within the limits: what can be mended is, and what cannot ends soon."""

import numpy as np
import pytest
from tiny import tiny

from pneumorph.limits.certify import LimitReport, certify
from pneumorph.optimize import within
from pneumorph.optimize.standing import Setting
from pneumorph.optimize.within import LOST, Within
from pneumorph.problem import loads


@pytest.fixture(scope="module")
def setting() -> Setting:
    return Setting(loads(tiny()))


def bulged(setting: Setting, amount: float) -> np.ndarray:
    """The start with bumps of an amount (mm) on all surfaces."""
    bumps = np.random.default_rng(0).normal(size=setting.space.n)
    return setting.space.start + amount * setting.smooth.apply(bumps)


def test_bumps_are_smoothed(setting: Setting) -> None:
    phi = bulged(setting, 0.5)
    assert not certify(setting.space.body(phi), setting.problem.limits).satisfied()
    found = setting.within(phi)
    assert isinstance(found, Within)
    assert certify(setting.space.body(found.phi), setting.problem.limits).satisfied()


def test_what_cannot_be_mended_ends_soon(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a motion comes no nearer to the limits, others from there hardly ever do."""
    motions, move = [], within.least_motion

    def counted(*args):
        motions.append(args)
        return move(*args)

    monkeypatch.setattr(within, "least_motion", counted)
    # No variable may move back far enough.
    found = setting.within(bulged(setting, 0.7), reach=0.02)
    assert isinstance(found, LimitReport)
    assert not found.satisfied()
    # Of 112 that there would be.
    assert LOST <= len(motions) < 40
