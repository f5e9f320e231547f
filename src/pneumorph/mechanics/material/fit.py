"""Fit the parameters of rubber models to tension tests in one or several modes.

Stresses are derivatives of the energies. Every model is linear in its moduli, so these are found by linear least
squares, and only exponents and limits are searched (Golub and Pereyra 1973). What a fit is worth is in `judge.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.energies import Energy
from pneumorph.mechanics.material.homogeneous import first_invariant, nominal_stress


@dataclass(frozen=True, eq=False)
class TensionTest:
    """Stretches (n,) and nominal stresses (n,) in MPa of a test, its mode (of `DIRECTIONS`) and its weight."""

    stretch: np.ndarray
    stress: np.ndarray
    mode: str = "uniaxial"
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """The points of all tests: stretch, stress, mode and scale, each (n,).

    A difference of stress times its scale is relative to the root mean square of the stresses of its test; every test
    counts as its weight says, however many points it has.
    """

    stretch: np.ndarray
    stress: np.ndarray
    mode: np.ndarray
    scale: np.ndarray
    test: np.ndarray


def points(tests: Sequence[TensionTest]) -> MeasuredPoints:
    """The points of all tests, scaled."""
    count, weights = sum(len(test.stretch) for test in tests), sum(test.weight for test in tests)
    size = [np.sqrt(test.weight / weights * count / len(test.stretch) / np.mean(test.stress**2)) for test in tests]

    def repeated(values: Sequence[object]) -> np.ndarray:
        return np.concatenate([np.full(len(test.stretch), value) for test, value in zip(tests, values, strict=True)])

    return MeasuredPoints(
        np.concatenate([test.stretch for test in tests]),
        np.concatenate([test.stress for test in tests]),
        repeated([test.mode for test in tests]),
        repeated(size),
        repeated(range(len(tests))),
    )


def borne(tests: Sequence[TensionTest]) -> float:
    """The largest Ī₁ of the tests."""
    return max(float(np.max(first_invariant(test.stretch, test.mode))) for test in tests)


@dataclass(frozen=True)
class Form:
    """A model to be fitted: linear in its `moduli`; its other parameters are searched from `starts`.

    Attributes
    ----------
    model : str
        Its name in a problem file.
    label : str
        Its name with the number of terms.
    arrange : callable
        Makes the parameters of `energy`, without κ, from the moduli and the searched ones.
    starts : tuple
        Starts of the search; a single empty tuple where nothing is searched.
    bounds : tuple
        Lower and upper bounds of the searched parameters.
    convex : bool
        Whether moduli are kept from going below zero.
    """

    model: str
    label: str
    energy: Energy
    moduli: int
    arrange: Callable[[np.ndarray, np.ndarray], np.ndarray]
    starts: tuple[tuple[float, ...], ...] = ((),)
    bounds: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    convex: bool = False

    @property
    def count(self) -> int:
        """Number of its parameters."""
        return self.moduli + len(self.starts[0])


def _alone(moduli: np.ndarray, searched: np.ndarray) -> np.ndarray:
    return np.r_[moduli, searched]


def _pairs(moduli: np.ndarray, searched: np.ndarray) -> np.ndarray:
    return np.ravel(np.column_stack([moduli, searched]))


def forms(tests: Sequence[TensionTest]) -> list[Form]:
    """Every model that can be fitted to tests: those with at least two points for each parameter."""
    # Limits are kept beyond what the specimen bore.
    most = borne(tests)
    least = max(1.02 * (most - 3.0), 1e-3)
    locking = max(np.sqrt(most / 3.0), 1.02)
    steps = (1.02, 2.0, 8.0, 50.0)
    every = [
        Form("neo-hookean", "neo-hookean", energies.neo_hookean, 1, _alone),
        Form("mooney-rivlin", "mooney-rivlin", energies.mooney_rivlin, 2, _alone),
        Form("yeoh", "yeoh, 2 terms", energies.yeoh, 2, _alone),
        Form("yeoh", "yeoh, 3 terms", energies.yeoh, 3, _alone),
        Form(
            "gent", "gent", energies.gent, 1, _alone,
            tuple((least * step,) for step in steps), ((least,), (1e5 * least,)),
        ),
        Form(
            "arruda-boyce", "arruda-boyce", energies.arruda_boyce, 1, _alone,
            tuple((locking * step,) for step in steps), ((locking,), (1e3 * locking,)),
        ),
        Form("ogden", "ogden, 1 term", energies.ogden, 1, _pairs, ((2.0,), (6.0,), (-3.0,)), ((-20.0,), (20.0,)), True),
        Form(
            "ogden", "ogden, 2 terms", energies.ogden, 2, _pairs,
            ((1.5, 5.0), (2.0, -2.0), (0.5, 3.0), (3.0, 10.0)), ((-20.0, -20.0), (20.0, 20.0)), True,
        ),
        Form(
            "ogden", "ogden, 3 terms", energies.ogden, 3, _pairs,
            ((1.3, 5.0, -2.0), (0.5, 3.0, 8.0), (2.0, -4.0, 12.0)), ((-20.0,) * 3, (20.0,) * 3), True,
        ),
    ]  # fmt: skip
    measured = sum(len(test.stretch) for test in tests)
    return [form for form in every if 2 * form.count <= measured]


def roots(form: Form, tests: Sequence[TensionTest]) -> list[np.ndarray]:
    """The parameters of a form, without κ, that a least-squares search finds from each of its starts."""
    data = points(tests)
    return [_arranged(form, data, _search(form, data, start)) for start in form.starts]


def _arranged(form: Form, data: MeasuredPoints, searched: np.ndarray) -> np.ndarray:
    return form.arrange(_moduli(form, data, searched)[0], searched)


def _search(form: Form, data: MeasuredPoints, start: tuple[float, ...]) -> np.ndarray:
    if not start:
        return np.zeros(0)
    return least_squares(
        lambda searched: _moduli(form, data, searched)[1], start, bounds=form.bounds, x_scale=np.abs(start) + 1e-3
    ).x


def _moduli(form: Form, data: MeasuredPoints, searched: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The best moduli for the searched parameters, and the scaled differences of stress (n,) that remain."""
    # At an exponent of zero the energy is 0/0; close to it, the power is a logarithm.
    searched = np.where(np.abs(searched) < 1e-4, 1e-4, searched)
    units = np.eye(form.moduli)
    columns = [
        nominal_stress(form.energy, form.arrange(unit, searched), data.stretch, data.mode) * data.scale
        for unit in units
    ]
    basis = np.column_stack(columns)
    scale = np.linalg.norm(basis, axis=0)
    least = 0.0 if form.convex else -np.inf
    measured = data.stress * data.scale
    moduli = lsq_linear(basis / scale, measured, bounds=(least, np.inf)).x / scale
    return moduli, basis @ moduli - measured


def is_term(modulus: Any) -> Any:
    """Whether a term of Ogden's with a fitted modulus (…) is one: where it is zero, it is left out."""
    return np.abs(modulus) > 1e-9


def material_keys(form: Form, parameters: np.ndarray) -> Iterator[tuple[str, object]]:
    """Keys and values of the table [material] for fitted parameters; moduli are floats in MPa."""
    numbers = [float(number) for number in parameters]
    match form.model:
        case "neo-hookean":
            yield "shear_modulus", numbers[0]
        case "mooney-rivlin":
            yield from zip(("c10", "c01"), numbers, strict=True)
        case "yeoh":
            yield "coefficients", tuple(numbers)
        case "gent":
            yield from zip(("shear_modulus", "limit"), numbers, strict=True)
        case "arruda-boyce":
            yield from zip(("shear_modulus", "locking_stretch"), numbers, strict=True)
        case "ogden":
            terms = zip(numbers[::2], numbers[1::2], strict=True)
            yield "terms", tuple({"modulus": m, "exponent": a} for m, a in terms if is_term(m))
