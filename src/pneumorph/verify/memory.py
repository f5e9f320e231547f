"""Rubber that relaxes and softens, pulled as a cube of distorted mixed elements, against one-dimensional integrals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.integrate import quad
from scipy.special import erf

from pneumorph.mechanics import Rubber, Tangent, build_loads, build_model, configure
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.memory import Memory, Softening
from pneumorph.mechanics.solve.memory_sweep import past_after, rested, with_memory
from pneumorph.verify.prescribed import equilibrium, prescribed, residual
from pneumorph.verify.solids import distorted_cube
from pneumorph.verify.verdict import Verdict, relative

SHEAR, POWER = 0.02, 2.6
"""Of Ogden's energy with one term, μ in MPa and α."""

PARAMETERS = (SHEAR, POWER, 1e6 * SHEAR)
"""Of the rubber, which is nearly incompressible."""

SHARES, TIMES = (0.2, 0.15), (5.0, 60.0)
"""Of the moduli, that relax in these times, s."""

SOFTENING = Softening(1.0 / 1.8, 0.004, 0.1)

PERIOD, HIGH = 20.0, 0.5
"""Of a cycle, s, and half the strain at its top."""

STEPS = 60
"""Of the sweep through one cycle and a half; errors fall with the square of their number."""


def held(tolerance: float = 1e-5) -> Iterator[Verdict]:
    """A stretch that is reached at once and held: the stress is the elastic one times the Prony series."""
    times = np.array([0.0, 1.0, 20.0, 200.0])
    memory = Memory(energies.ogden, PARAMETERS, SHARES, TIMES)
    forces = pulled(memory, [1.8] * len(times), np.diff(times, prepend=0.0))
    for time, force in zip(times, forces, strict=True):
        series = 1.0 - sum(g * (1.0 - np.exp(-time / t)) for g, t in zip(SHARES, TIMES, strict=True))
        yield relative(f"nominal stress after {time:g} s, MPa", force, series * _elastic(1.8), tolerance)


def cycled(count: int = STEPS, tolerance: float = 5e-4) -> Iterator[Verdict]:
    """A stretch that rises and falls: the hereditary integral of every part, by adaptive quadrature."""
    times = np.linspace(0.0, 1.5 * PERIOD, count + 1)
    memory = Memory(energies.ogden, PARAMETERS, SHARES, TIMES)
    forces = pulled(memory, [_stretch(time) for time in times], np.diff(times, prepend=0.0))
    for number, word in ((count // 3, "at the top"), (count // 2, "on the way back"), (count, "at the second top")):
        yield relative(f"nominal stress {word}, MPa", forces[number], _hereditary(times[number]), tolerance)


def softened(tolerance: float = 1e-5) -> Iterator[Verdict]:
    """Pulls to rising stretches with unloading between them: Ogden and Roxburgh's factor of the elastic stress."""
    path = [1.5, 2.0, 1.4, 1.8, 2.2, 1.6]
    forces = pulled(Memory(energies.ogden, PARAMETERS, softening=SOFTENING), path, [1.0] * len(path))
    worst = 0.0
    for number, (stretch, force) in enumerate(zip(path, forces, strict=True), start=1):
        psi = 2.0 * SHEAR / POWER**2 * (stretch**POWER + 2.0 * stretch ** (-POWER / 2.0) - 3.0)
        worst = max(worst, psi)
        eta = 1.0 - SOFTENING.most * float(erf((worst - psi) / (SOFTENING.energy + SOFTENING.slope * worst)))
        quantity = f"nominal stress at stretch {stretch:g}, step {number}, MPa"
        yield relative(quantity, force, eta * _elastic(stretch), tolerance)


def pulled(memory: Memory, stretches: Sequence[float], durations: Sequence[float] | np.ndarray) -> np.ndarray:
    """Nominal stresses (n,) in MPa at the end of every step, of a unit cube whose other sides are free.

    Parameters
    ----------
    memory : Memory
        Of the rubber.
    stretches : at the end of every step.
    durations : of the steps, s.
    """
    mesh = distorted_cube(1)
    X, far = mesh.points, np.abs(mesh.points - 1.0) < 1e-9
    far[:, 1:] = False
    rubber = Rubber(memory.isochoric, memory.parameters, 1e-9, memory=memory)
    supports = (np.abs(X) < 1e-9) | far
    model = build_model(mesh, rubber, plate=False, supports=supports, mixed=True, weight=False)
    pasts, tangent, forces = rested(model), Tangent(model), []
    for stretch, duration in zip(stretches, durations, strict=True):
        at = configure(with_memory(model, pasts, duration), X, build_loads(model, {}))
        side = stretch**-0.5
        found = equilibrium(at, tangent, prescribed(at, X * (np.array([stretch, side, side]) - 1.0)))
        reactions = np.asarray(model.state(residual(at, found)).u)
        forces.append(reactions[far[:, 0], 0].sum())
        pasts = past_after(at, model.state(found), pasts, duration)
    return np.array(forces)


def _stretch(time: float) -> float:
    return 1.0 + HIGH * (1.0 - float(np.cos(2.0 * np.pi * time / PERIOD)))


def _principal(stretch: float) -> tuple[float, float]:
    """The elastic S along and across an incompressible pull, MPa, free of stress at rest."""
    along, across = (2.0 * SHEAR / POWER * (each**POWER - 1.0) / each**2 for each in (stretch, stretch**-0.5))
    return along, across


def _elastic(stretch: float) -> float:
    along, across = _principal(stretch)
    return stretch * along - across / stretch**2


def _hereditary(end: float) -> float:
    """The nominal stress at a time, MPa: S less what its parts have lost, ∫ g/τ exp((s − t)/τ) S(s) ds."""

    def left(k: int) -> float:
        def lost(s: float, share: float, time: float) -> float:
            return share / time * float(np.exp((s - end) / time)) * _principal(_stretch(s))[k]

        parts = (quad(lost, 0.0, end, args=each, epsabs=1e-13)[0] for each in zip(SHARES, TIMES, strict=True))
        return _principal(_stretch(end))[k] - sum(parts)

    stretch = _stretch(end)
    return stretch * left(0) - left(1) / stretch**2
