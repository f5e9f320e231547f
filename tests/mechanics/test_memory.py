"""Rubber that remembers: relaxation against integrals, softening against its formula, and no energy from nothing."""

from dataclasses import replace
from functools import partial

import jax
import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.integrate import quad
from scipy.special import erf

from pneumorph.mechanics import (
    Equilibrium,
    Rubber,
    Tangent,
    build_loads,
    build_model,
    configure,
    rubber_of,
    sweep,
    sweep_with_memory,
)
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.homogeneous import nominal_stress
from pneumorph.mechanics.material.memory import (
    Memory,
    PointParameters,
    Softening,
    after,
    at_rest,
    in_step,
    step_of,
)
from pneumorph.mechanics.material.rubber import nominal_stress as stress_of
from pneumorph.mechanics.solve.memory_sweep import past_after, rested, with_memory
from pneumorph.problem.material import Material
from pneumorph.verify.prescribed import equilibrium, prescribed, residual
from pneumorph.verify.solids import distorted_cube, tube

OGDEN = (0.02, 2.6, 0.001, 4.9, 15.0)
RELAXING = Memory(energies.ogden, OGDEN, (0.2, 0.15), (5.0, 60.0))
SOFTENING = Memory(energies.ogden, OGDEN, softening=Softening(1 / 1.8, 0.004, 0.1))


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
        lost = []
        for k in (0, 1):

            def decayed(s: float, k=k, g=g, t=t) -> float:
                return g / t * np.exp((s - end) / t) * extra(memory, sine(s))[k]

            lost.append(quad(decayed, 0, end, epsabs=1e-14)[0])
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
    """F of pure shear along axes that turn beside the body: principal directions are others at every step."""
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    return turn @ np.diag([1.6, 1 / 1.6, 1.0]) @ turn.T


@partial(jax.jit, static_argnums=0)
def step_energy(energy, F, given):
    return in_step(energy)(F, given)


def work(memory: Memory, path: np.ndarray, durations) -> np.ndarray:
    """The work (steps, n) in MPa on points with F (steps, 3, 3, n): in every step the potential is an elastic one."""
    past, own, done = at_rest(memory, path.shape[3:]), np.array(memory.parameters), []
    before = path[-1]
    for F, duration in zip(path, durations, strict=True):
        share, held = step_of(memory, past, duration)
        given = PointParameters(held, past.worst, share, np.array(memory.softening), own, own[-1])
        begin, end = (np.asarray(step_energy(memory.isochoric, each, given)) for each in (before, F))
        done.append(end - begin)
        past, before = after(memory, past, F, duration), F
    return np.array(done)


@pytest.mark.parametrize("period", [2.0, 15.0, 300.0])
@pytest.mark.parametrize("softening", [Softening(), SOFTENING.softening], ids=["relaxing", "softening too"])
def test_no_cycle_gains_energy(softening, period):
    """Cycles of pulls, of axes that turn in the body, and of deformations at random, gone until they are periodic."""
    memory = Memory(energies.ogden, OGDEN, (0.2, 0.15), (1.0, 10.0), softening)
    random, angles = np.random.default_rng(2), np.linspace(0, 2 * np.pi, 31)[1:]
    corners = np.eye(3) + 0.25 * random.standard_normal((3, 3, 3))
    loops = [
        [pulled(1.0 + 0.4 * (1 - np.cos(angle)))[..., 0] for angle in angles],
        [rotating(angle / 2.0) for angle in angles],
        [(1 - w) * corners[k] + w * corners[k - 1] for k in (0, 2, 1) for w in np.linspace(0, 1, 11)[1:]],
    ]
    loop = np.stack(loops, axis=-1)
    count = 4 + int(60.0 / period)
    done = work(memory, np.concatenate([loop] * count), [period / 30] * 30 * count).reshape(count, 30, 3).sum(axis=1)
    assert done[-1] == pytest.approx(done[-2], rel=0.02)
    assert np.all(done[-1] > 0.0)


def test_a_cube_relaxes_and_softens_as_its_material_points():
    """Distorted mixed elements, nearly incompressible, pulled, held, and let back."""
    memory = replace(RELAXING, parameters=(*OGDEN[:-1], 2e4), softening=SOFTENING.softening)
    rubber = Rubber(energies.ogden, memory.parameters, 1e-9, memory=memory)
    mesh = distorted_cube(1)
    X, far = mesh.points, np.abs(mesh.points - 1) < 1e-9
    far[:, 1:] = False
    supports = (np.abs(X) < 1e-9) | far
    model = build_model(mesh, rubber, plate=False, supports=supports, mixed=True, weight=False)
    path, durations = [1.4, 1.4, 1.2, 1.5], [1.0, 20.0, 4.0, 3.0]
    pasts, tangent, forces = rested(model), Tangent(model), []
    for stretch, duration in zip(path, durations, strict=True):
        at = configure(with_memory(model, pasts, duration), X, build_loads(model, {}))
        pulls = np.array([stretch, stretch**-0.5, stretch**-0.5])
        found = equilibrium(at, tangent, prescribed(at, X * (pulls - 1)))
        reactions = np.asarray(model.state(residual(at, found)).u)
        forces.append(reactions[far[:, 0], 0].sum())
        pasts = past_after(at, model.state(found), pasts, duration)
    np.testing.assert_allclose(forces, stresses(memory, path, durations), rtol=1e-5)


def inflated(model, X, pressures, durations=None):
    """The volumes of a tube along a sweep."""
    path = [configure(model, X, build_loads(model, {"A": p})) for p in pressures]
    tangent = Tangent(model)
    answers = (
        list(sweep(path, tangent))
        if durations is None
        else [answer for _, answer in sweep_with_memory(path, durations, tangent)]
    )
    return np.array([answer.volumes["A"] for answer in answers if isinstance(answer, Equilibrium)])


def test_a_tube_is_elastic_infinitely_fast_and_slow_and_loses_energy_between():
    memory = Memory(energies.neo_hookean, (0.05, 0.5), (0.2, 0.1), (2.0, 20.0))
    mesh = tube(4, 8, 8, (1, 6, 1))
    stiff, soft = (Rubber(energies.neo_hookean, (each, 0.5), 1e-9, memory=memory) for each in (0.05, 0.035))
    models = [build_model(mesh, each, weight=False) for each in (stiff, soft)]
    up = np.linspace(0.0, 0.016, 5)
    cycle = np.r_[up, up[-2::-1]]
    elastic = [inflated(model, mesh.points, cycle) for model in models]
    fast, slow = (inflated(models[0], mesh.points, cycle, [each] * 9) for each in (0.0, np.inf))
    np.testing.assert_allclose(fast, elastic[0], rtol=1e-9)
    np.testing.assert_allclose(slow, elastic[1], rtol=1e-9)

    between = inflated(models[0], mesh.points, cycle, [np.inf] + [1.0] * 8)
    assert np.all(between[1:] > elastic[0][1:])
    assert np.all(between[1:5] < elastic[1][1:5])
    assert np.trapezoid(cycle, between) > 0.02 * np.trapezoid(up, between[:5])


def states(state: str) -> Rubber:
    table = {
        "name": "Dragon Skin 30",
        "relaxation": [{"share": 0.2, "time": "5 s"}],
        "softening": {"r": 2.0, "m": "20 kPa", "beta": 0.1, "stretch": 1.8},
        "state": state,
    }
    return rubber_of(TypeAdapter(Material).validate_python(table))


def test_designs_are_elastic_in_a_state():
    """Relaxed it has what is left of the moduli; softened, the stress of a second pull."""
    first, relaxed, softened, both = map(states, ("first pull", "relaxed", "softened", "softened and relaxed"))
    pulls = np.array([1.2, 1.5, 1.7, 2.5])
    at_first, at_relaxed, at_softened, at_both = (
        nominal_stress(each.isochoric, np.array(each.parameters[:-1]), pulls)
        for each in (first, relaxed, softened, both)
    )
    np.testing.assert_allclose(at_relaxed, 0.8 * at_first, rtol=1e-10)
    np.testing.assert_allclose(at_both, 0.8 * at_softened, rtol=1e-10)
    assert relaxed.bulk_modulus == first.bulk_modulus == both.bulk_modulus
    again = stresses(replace(first.memory, shares=(), times=()), [1.8, *pulls], [1.0] * 5)[1:]
    np.testing.assert_allclose(at_softened, again, rtol=1e-10)
    assert at_softened[0] < 0.8 * at_first[0]
    assert at_softened[-1] == pytest.approx(at_first[-1], rel=1e-12)
    assert softened.memory.worst > first.memory.worst == 0.0
