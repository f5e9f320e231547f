"""Fit the parameters of rubber models to a uniaxial tension test, and check whether the fitted models are stable.

Stresses are derivatives of the energies. Every model is linear in its moduli, so these are found by linear least
squares, and only exponents and limits are searched (Golub and Pereyra 1973).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares, lsq_linear

from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.rubber import Energy

DIRECTIONS = {"uniaxial": (1.0, -0.5), "equibiaxial": (1.0, 1.0), "planar": (1.0, 0.0)}
"""Logarithms of the first two principal stretches over that of the first, for the isochoric tests of stability."""

POINTS = 200


@dataclass(frozen=True, eq=False)
class TensionTest:
    """Stretches (n,) and nominal stresses (n,) in MPa of a uniaxial test."""

    stretch: np.ndarray
    stress: np.ndarray


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


@dataclass(frozen=True, eq=False)
class Fit:
    """A form fitted to a test.

    Attributes
    ----------
    parameters : of the form's energy, without κ.
    rms : root mean square of the differences of nominal stress, MPa.
    r2 : coefficient of determination R² of the stresses.
    stable : for each mode, the largest stretch of the test up to which the model is stable.
    reach : the largest stretch of the test.
    """

    form: Form
    parameters: np.ndarray
    rms: float
    r2: float
    stable: dict[str, float]
    reach: float

    @property
    def is_stable(self) -> bool:
        return all(stretch >= self.reach for stretch in self.stable.values())

    def stress(self, stretch: np.ndarray) -> np.ndarray:
        """Nominal stress (n,) in MPa in uniaxial tension."""
        return nominal_stress(self.form.energy, self.parameters, stretch)


def _alone(moduli: np.ndarray, searched: np.ndarray) -> np.ndarray:
    return np.r_[moduli, searched]


def _pairs(moduli: np.ndarray, searched: np.ndarray) -> np.ndarray:
    return np.ravel(np.column_stack([moduli, searched]))


def forms(test: TensionTest) -> list[Form]:
    """Every model that can be fitted to a test, from the fewest to the most parameters."""
    # Limits are kept beyond what the specimen bore.
    borne = float(np.max(_uniaxial_invariant(test.stretch)))
    least = max(1.02 * (borne - 3.0), 1e-3)
    locking = max(np.sqrt(borne / 3.0), 1.02)
    steps = (1.02, 2.0, 8.0, 50.0)
    return [
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


def fit(form: Form, test: TensionTest) -> Fit:
    """The best parameters of a form over all its starts, by least squares of the nominal stress."""
    searched = min((_search(form, test, start) for start in form.starts), key=lambda found: found[1])[0]
    moduli, difference = _moduli(form, test, searched)
    parameters = form.arrange(moduli, searched)
    variance = float(np.sum((test.stress - test.stress.mean()) ** 2))
    reach = float(test.stretch.max())
    return Fit(
        form,
        parameters,
        rms=float(np.sqrt(np.mean(difference**2))),
        r2=1.0 - float(np.sum(difference**2)) / variance,
        stable={mode: stable_up_to(form.energy, parameters, mode, reach) for mode in DIRECTIONS},
        reach=reach,
    )


def ranked(fits: list[Fit]) -> list[Fit]:
    """Stable ones first, among them the closest first, and of equally close ones that with fewer parameters."""
    return sorted(fits, key=lambda one: (not one.is_stable, float(f"{one.rms:.2g}"), len(one.parameters)))


def _search(form: Form, test: TensionTest, start: tuple[float, ...]) -> tuple[np.ndarray, float]:
    if not start:
        return np.zeros(0), 0.0
    found = least_squares(
        lambda searched: _moduli(form, test, searched)[1], start, bounds=form.bounds, x_scale=np.abs(start) + 1e-3
    )
    return found.x, float(found.cost)


def _moduli(form: Form, test: TensionTest, searched: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The best moduli for the searched parameters, and the differences of stress (n,) that remain."""
    # At an exponent of zero the energy is 0/0; close to it, the power is a logarithm.
    searched = np.where(np.abs(searched) < 1e-4, 1e-4, searched)
    units = np.eye(form.moduli)
    columns = [nominal_stress(form.energy, form.arrange(unit, searched), test.stretch) for unit in units]
    basis = np.column_stack(columns)
    scale = np.linalg.norm(basis, axis=0)
    least = 0.0 if form.convex else -np.inf
    moduli = lsq_linear(basis / scale, test.stress, bounds=(least, np.inf)).x / scale
    return moduli, basis @ moduli - test.stress


def nominal_stress(energy: Energy, parameters: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Nominal stress (n,) in MPa of an incompressible rubber in uniaxial tension, dψ/dλ of diag(λ, λ^−½, λ^−½)."""
    return np.asarray(_nominal_stress(energy, _with_bulk(parameters), jnp.asarray(stretch, dtype=float)))


@partial(jax.jit, static_argnums=0)
def _nominal_stress(energy: Energy, parameters: jax.Array, stretch: jax.Array) -> jax.Array:
    def work(stretch: jax.Array) -> jax.Array:
        logs = jnp.log(stretch)
        return jnp.sum(_principal_energy(energy, parameters, jnp.stack([logs, -0.5 * logs])))

    return jax.grad(work)(stretch)


def stable_up_to(energy: Energy, parameters: np.ndarray, mode: str, reach: float) -> float:
    """The stretch up to which Drucker's condition holds, from 1 to `reach` at most, in a mode of `DIRECTIONS`.

    It asks Σ dτ_a dε_a > 0 of the Kirchhoff stresses τ for every isochoric change of the logarithmic strains ε: the
    second derivative of ψ with regard to two of them, with −ε₁ − ε₂ as the third, is positive definite.
    """
    stretch = np.linspace(1.0, reach, POINTS)
    logs = np.log(stretch) * np.array(DIRECTIONS[mode])[:, None]
    softest = np.linalg.eigvalsh(np.moveaxis(np.asarray(_hessian(energy, _with_bulk(parameters), logs)), -1, 0))[:, 0]
    failed = np.flatnonzero(~(softest > 0))
    return float(stretch[max(failed[0] - 1, 0)]) if len(failed) else float(reach)


@partial(jax.jit, static_argnums=0)
def _hessian(energy: Energy, parameters: jax.Array, logs: jax.Array) -> jax.Array:
    """∂²ψ/∂ε∂ε (2, 2, n)."""
    slope = jax.grad(lambda logs: jnp.sum(_principal_energy(energy, parameters, logs)))
    units = jnp.broadcast_to(jnp.eye(2)[:, :, None], (2, *logs.shape))
    return jax.vmap(lambda unit: jax.jvp(slope, (logs,), (unit,))[1])(units)


def _principal_energy(energy: Energy, parameters: jax.Array, logs: jax.Array) -> jax.Array:
    """ψ (n,) of isochoric stretches along the axes, from the logarithms of the first two (2, n)."""
    stretches = jnp.exp(jnp.stack([logs[0], logs[1], -logs[0] - logs[1]]))
    return energy(jnp.eye(3)[:, :, None] * stretches[:, None], parameters)


def _with_bulk(parameters: np.ndarray) -> jax.Array:
    """The parameters with a bulk modulus at the end, which isochoric energies do not use."""
    return jnp.append(jnp.asarray(parameters, dtype=float), 0.0)


def _uniaxial_invariant(stretch: np.ndarray) -> np.ndarray:
    return stretch**2 + 2.0 / stretch


def material_keys(found: Fit) -> Iterator[tuple[str, object]]:
    """Keys and values of the table [material] for the parameters of a fit; moduli are floats in MPa."""
    numbers = [float(number) for number in found.parameters]
    match found.form.model:
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
            # Leave out terms whose fitted modulus is zero.
            yield "terms", tuple({"modulus": m, "exponent": a} for m, a in terms if abs(m) > 1e-9)
