"""Rubber that remembers: relaxation against its integrals, softening against its formula, and no energy from nothing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import erf

from pneumorph.mechanics import Rubber
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.homogeneous import nominal_stress
from pneumorph.mechanics.material.memory import Memory, Softening, after, at_rest, in_step, step_of
from pneumorph.mechanics.material.memory import PointParameters
from pneumorph.mechanics.material.rubber import nominal_stress as stress_of

OGDEN = (0.02, 2.6, 0.001, 4.9, 15.0)
RELAXING = Memory(energies.ogden, OGDEN, (0.2, 0.15), (5.0, 60.0))
SOFTENING = Memory(energies.ogden, OGDEN, softening=Softening(1 / 1.8, 0.004, 0.1))
BOTH = replace(RELAXING, softening=SOFTENING.softening)


def pulled(stretch: float) -> np.ndarray:
    """F (3, 3, 1) of an incompressible uniaxial pull."""
    return np.diag([stretch, stretch**-0.5, stretch**-0.5])[:, :, None]


def stresses(memory: Memory, stretches, durations, deform=pulled) -> np.ndarray:
    """Nominal stress along the first axis at the end of every step, the third free of stress."""
    past, found = at_rest(memory, (1,)), []
    own = np.array(memory.parameters)
    for stretch, duration in zip(stretches, durations, strict=True):
        F = deform(stretch)
        share, held = step_of(memory, past, duration)
        given = PointParameters(held, past.worst, share, np.array(memory.softening), own, own[-1])
        P = stress_of(in_step(memory.isochoric), F, given)[..., 0]
        past = after(memory, past, F, duration)
        found.append(P[0, 0] - P[2, 2] * F[2, 2, 0] / F[0, 0, 0])
    return np.array(found)


def elastic(memory: Memory, stretch) -> np.ndarray:
    return nominal_stress(memory.isochoric, np.array(memory.parameters[:-1]), np.atleast_1d(stretch))


def extra(memory: Memory, stretch: float) -> tuple[float, float]:
    """The elastic S along and across, of Ogden's energy, that are zero at rest."""
    terms = np.reshape(memory.parameters[:-1], (-1, 2))
    along, across = stretch, stretch**-0.5
    return tuple(sum(2 * m / a * (each**a - 1) for m, a in terms) / each**2 for each in (along, across))


def test_a_held_stretch_relaxes_as_the_prony_series():
    times = np.array([0.0, 0.5, 3.0, 10.0, 100.0])
    found = stresses(RELAXING, [1.8] * 5, np.diff(times, prepend=0.0))
    series = 1 - sum(g * (1 - np.exp(-times / t)) for g, t in zip(RELAXING.shares, RELAXING.times, strict=True))
    np.testing.assert_allclose(found, series * elastic(RELAXING, 1.8), rtol=1e-12)


def sine(time: float) -> float:
    return 1.0 + 0.5 * (1 - np.cos(2 * np.pi * time / 20.0))


def integral(memory: Memory, end: float) -> float:
    """The nominal stress of the hereditary integral at a time, by quadrature."""
    along, across = extra(memory, sine(end))
    for g, t in zip(memory.shares, memory.times, strict=True):
        lost = [
            quad(lambda s, k=k, g=g, t=t: g / t * np.exp((s - end) / t) * extra(memory, sine(s))[k], 0, end, epsabs=1e-14)[0]
            for k in (0, 1)
        ]
        along, across = along - lost[0], across - lost[1]
    stretch = sine(end)
    return stretch * along - across / stretch**2


def test_cycles_converge_to_the_hereditary_integral_with_the_square_of_the_step():
    exact, errors = integral(RELAXING, 35.0), []
    for count in (35, 70, 140):
        times = np.linspace(0.0, 35.0, count + 1)
        errors.append(abs(stresses(RELAXING, list(map(sine, times)), np.diff(times, prepend=0.0))[-1] - exact))
    assert errors[-1] < 1e-3 * abs(exact)
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.4)
    assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.2)


@pytest.mark.parametrize(("duration", "share"), [(0.0, 1.0), (np.inf, 0.65)])
def test_infinitely_fast_and_slow_it_is_elastic(duration, share):
    path = [1.0, 1.3, 2.0, 1.5, 1.1]
    np.testing.assert_allclose(
        stresses(RELAXING, path, [duration] * 5), share * elastic(RELAXING, path), rtol=1e-12, atol=1e-15
    )


def test_softening_is_ogden_and_roxburghs():
    path = [1.5, 2.0, 1.6, 1.2, 1.7, 2.2, 1.7]
    first = elastic(SOFTENING, path)
    terms = np.reshape(OGDEN[:-1], (-1, 2))
    psi = sum(2 * m / a**2 * (np.power(path, a) + 2 * np.power(path, -a / 2) - 3) for m, a in terms)
    worst = np.maximum.accumulate(psi)
    most, energy, slope = SOFTENING.softening
    eta = 1 - most * erf((worst - psi) / (energy + slope * worst))
    assert eta.min() < 0.8
    np.testing.assert_allclose(stresses(SOFTENING, path, [1.0] * 7), eta * first, rtol=1e-12)


def rotating(angle: float) -> np.ndarray:
    """F (3, 3, 1) of pure shear along axes that turn beside the body: principal directions are others at every step."""
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    return (turn @ np.diag([1.6, 1 / 1.6, 1.0]) @ turn.T)[:, :, None]


def work(memory: Memory, path: list[np.ndarray], durations) -> np.ndarray:
    """The work in MPa on a point in every step: in each, the potential is that of an elastic body."""
    past, own, done = at_rest(memory, (1,)), np.array(memory.parameters), []
    before = np.eye(3)[:, :, None]
    for F, duration in zip(path, durations, strict=True):
        share, held = step_of(memory, past, duration)
        given = PointParameters(held, past.worst, share, np.array(memory.softening), own, own[-1])
        ends = (float(in_step(memory.isochoric)(each, given)[0]) for each in (before, F))
        done.append(-next(ends) + next(ends))
        past, before = after(memory, past, F, duration), F
    return np.array(done)


@pytest.mark.parametrize("seconds", [0.5, 8.0, 200.0])
@pytest.mark.parametrize("memory", [RELAXING, BOTH], ids=["relaxing", "softening too"])
def test_no_cycle_gains_energy(memory, seconds):
    """Cycles of pulls, of turning axes, and of both at random, after as many as make them periodic."""
    random = np.random.default_rng(2)
    cycle = [random.standard_normal((3, 3)) for _ in range(3)]
    deformed = [np.eye(3) + 0.3 * each / np.linalg.norm(each) for each in cycle]
    loops = {
        "pulls": [pulled(1.0 + 0.4 * (1 - np.cos(a))) for a in np.linspace(0, 2 * np.pi, 41)[1:]],
        "turns": [rotating(a) for a in np.linspace(0, np.pi, 41)[1:]],
        "random": [
            ((1 - w) * one + w * other)[:, :, None]
            for one, other in zip(deformed, [*deformed[1:], deformed[0]], strict=True)
            for w in np.linspace(0, 1, 15)[1:]
        ],
    }
    for loop in loops.values():
        times = int(400 / seconds) + 2 if seconds < 8 else 30
        times = min(times, 60)
        done = work(memory, loop * times, [seconds / len(loop)] * len(loop) * times)
        last = done[-len(loop) :].sum()
        assert last > 0.0
