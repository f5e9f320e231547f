"""What a fit is worth: how close, how stable, how plausible where nothing was measured, how well determined.

A tension test says little about other modes: models that fit it equally well may differ a thousandfold in equibiaxial
tension. A fit is therefore compared in all three modes with a neo-Hookean rubber of the same initial modulus, and the
covariance of its parameters gives the error of its stress in each of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.material.energies import neo_hookean
from pneumorph.mechanics.material.fit import Form, MeasuredPoints, TensionTest, borne, forms, points, roots
from pneumorph.mechanics.material.homogeneous import DIRECTIONS, nominal_stress, shear_modulus, stable_up_to, stretch_at

ACCURACY = 0.005
"""Relative error of stress that every test is assumed to have, that of a machine of class 0.5 (ISO 7500-1)."""

INDEPENDENT = 100
"""Largest number of points that count: neighbouring points of a recorded curve have the same errors."""

FACTOR = 3.0
"""Largest factor by which stiffening or softening in a mode may exceed that in the modes that were measured."""

WIDEST = 0.25
"""Largest error of the stress, two standard deviations over the stress, with which a mode counts as determined."""

MARGIN = 10.0
"""Differences of the Bayesian information criterion up to which a model is as good as another (Kass, Raftery 1995)."""

GRID = 60
"""Stretches of each mode at which curves and their errors are computed; the curves are smooth."""


@dataclass(frozen=True, eq=False)
class ModeCurve:
    """Nominal stress (n,) in MPa over stretch (n,) in a mode, with its standard deviation (n,)."""

    stretch: np.ndarray
    stress: np.ndarray
    deviation: np.ndarray

    @property
    def error(self) -> float:
        """The largest two standard deviations over the stress, away from rest."""
        half = self.stretch > 1.0 + 0.25 * (self.stretch[-1] - 1.0)
        return float(np.max(2 * self.deviation[half] / np.maximum(np.abs(self.stress[half]), 1e-12)))


@dataclass(frozen=True, eq=False)
class Fit:
    """A form fitted to tests.

    Attributes
    ----------
    parameters : of the form's energy, without κ.
    covariance : of their errors, (m, m); large where the tests say nothing about one.
    square : mean square of the differences of nominal stress, relative to the stresses of their tests.
    rms : root mean square of the differences of nominal stress, MPa.
    r2 : smallest coefficient of determination R² of the tests.
    criterion : Bayesian information criterion; smaller is better.
    stable : for each mode, the largest stretch of the tests up to which the model is stable.
    reach : the largest stretch of the tests.
    curves : for each mode, the curve up to the largest Ī₁ of the tests.
    ratios : for each mode, the least and the largest stress over that of a neo-Hookean rubber of the same modulus.
    measured : the modes of the tests.
    """

    form: Form
    parameters: np.ndarray
    covariance: np.ndarray
    square: float
    rms: float
    r2: float
    criterion: float
    stable: dict[str, float]
    reach: float
    curves: dict[str, ModeCurve]
    ratios: dict[str, tuple[float, float]]
    measured: frozenset[str]

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations (m,) of the parameters."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def is_stable(self) -> bool:
        return all(stretch >= self.reach for stretch in self.stable.values())

    @property
    def implausible(self) -> list[str]:
        """Modes without a test in which it stiffens or softens far more than in those with one."""
        least = min(1.0, *(self.ratios[mode][0] for mode in self.measured))
        most = max(1.0, *(self.ratios[mode][1] for mode in self.measured))
        # Written so that NaN is implausible.
        return [
            mode
            for mode, (low, high) in self.ratios.items()
            if mode not in self.measured and not (low >= least / FACTOR and high <= most * FACTOR)
        ]

    @property
    def distance(self) -> float:
        """The largest logarithm of its stress over a neo-Hookean one in the modes without a test, of either sign."""
        ends = [end for mode, ends in self.ratios.items() if mode not in self.measured for end in ends]
        return max((abs(float(np.log(end))) if end > 0 else np.inf for end in ends), default=0.0)

    @property
    def undetermined(self) -> list[int]:
        """Indices of parameters that the tests do not tell from zero."""
        return [k for k, known in enumerate(np.abs(self.parameters) > 2 * self.deviations) if not known]

    @property
    def uncertain(self) -> list[str]:
        """Modes in which the errors of the parameters make the stress too uncertain."""
        return [mode for mode, curve in self.curves.items() if not curve.error <= WIDEST]

    @property
    def is_acceptable(self) -> bool:
        """Whether it can be recommended.

        Single parameters need not be determined: Ogden's small moduli and their exponents make up for one another.
        """
        return self.is_stable and not (self.implausible or self.uncertain)

    def stress(self, stretch: np.ndarray, mode: str = "uniaxial") -> np.ndarray:
        """Nominal stress (n,) in MPa in a mode."""
        return nominal_stress(self.form.energy, self.parameters, stretch, mode)


def fit(form: Form, tests: Sequence[TensionTest]) -> Fit:
    """The best parameters of a form over all its starts, judged."""
    return ranked([judged(form, parameters, tests) for parameters in roots(form, tests)])[0]


def fit_all(tests: Sequence[TensionTest], model: str | None = None) -> list[Fit]:
    """Every form, or every form of a model, fitted to the tests and ranked."""
    return ranked([fit(form, tests) for form in forms(tests) if model in (None, form.model)])


def ranked(fits: Sequence[Fit]) -> list[Fit]:
    """Acceptable ones first, and stable before unstable ones; among them the simplest of those that are as good.

    Of equally simple ones, that comes first which is closest to a neo-Hookean rubber in the modes that were not
    measured: where two are equally close, they say the same there, and it does not matter which is taken.
    """
    order: list[Fit] = []
    for acceptable, stable in ((True, True), (False, True), (False, False)):
        group = [one for one in fits if (one.is_acceptable, one.is_stable) == (acceptable, stable)]
        best = min((one.criterion for one in group), default=0.0)
        near = [one for one in group if one.criterion <= best + MARGIN]
        order += sorted(near, key=lambda one: (one.form.count, one.distance, one.criterion))
        order += sorted((one for one in group if one not in near), key=lambda one: one.criterion)
    return order


def as_good(fits: Sequence[Fit]) -> list[Fit]:
    """The fits that are stable, plausible and as close as the first, or closer."""
    return [
        one
        for one in fits
        if one is fits[0] or (one.is_stable and not one.implausible and one.criterion <= fits[0].criterion + MARGIN)
    ]


def as_good_in(fits: Sequence[Fit], mode: str) -> list[Fit]:
    """The fits that are as good as the first, without those whose errors make the stress in a mode too uncertain."""
    return [one for one in as_good(fits) if one is fits[0] or mode not in one.uncertain]


def reports(fits: Sequence[Fit]) -> list[str]:
    """What the tests cannot decide about the first of ranked fits, in sentences."""
    best, alike = fits[0], as_good(fits)
    told = []
    for mode, curve in best.curves.items():
        low, high = (float(edge[-1]) for edge in band(fits, mode))
        middle, stretch = float(curve.stress[-1]), float(curve.stretch[-1])
        if mode in best.measured or high - low <= 0.1 * middle:
            continue
        models = f"the {len(alike)} models that fit as well say" if len(alike) > 1 else "the fit says"
        told.append(
            f"the tests do not decide {mode} tension: {models} {low:.3g} to {high:.3g} MPa at a stretch of "
            f"{stretch:.3g}, within two standard deviations; measure it and give {mode}=FILE"
        )
    for one in fits[1:]:
        if one.criterion < best.criterion - MARGIN and not one.is_acceptable:
            told.append(f"{one.form.label} is closer, but {', '.join(faults(one))}")
    return told


def faults(one: Fit) -> list[str]:
    """Why a fit is not recommended, in words; none if it can be."""
    told = [f"not stable in {mode} tension beyond {at:.3g}" for mode, at in one.stable.items() if at < one.reach]
    for mode in one.implausible:
        low, high = one.ratios[mode]
        times = high if not high <= FACTOR else low
        told.append(f"implausible in {mode} tension ({times:.3g} times a neo-hookean of its modulus)")
    certain = [mode for mode in one.uncertain if mode not in one.implausible]
    told += [f"uncertain in {mode} tension (±{100 * min(one.curves[mode].error, 99):.0f} %)" for mode in certain]
    return told


def band(fits: Sequence[Fit], mode: str) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest stress (n,) in MPa of the fits that are as good as the first, with two standard deviations."""
    curves = [one.curves[mode] for one in as_good_in(fits, mode)]
    return (
        np.min([curve.stress - 2 * curve.deviation for curve in curves], axis=0),
        np.max([curve.stress + 2 * curve.deviation for curve in curves], axis=0),
    )


def judged(form: Form, parameters: np.ndarray, tests: Sequence[TensionTest]) -> Fit:
    """Parameters of a form (m,), without κ, judged by tests."""
    data = points(tests)
    difference = nominal_stress(form.energy, parameters, data.stretch, data.mode) - data.stress
    count, square = len(difference), float(np.mean((difference * data.scale) ** 2))
    counted = min(count, INDEPENDENT)
    criterion = counted * np.log(square + ACCURACY**2) + form.count * np.log(counted)
    covariance = covariance_of(form, parameters, data, square)
    top = borne(tests)
    grids = {mode: np.linspace(1.0, stretch_at(top, mode), GRID)[1:] for mode in DIRECTIONS}
    stretch, modes = np.concatenate(list(grids.values())), np.repeat(list(grids), GRID - 1)
    stress = nominal_stress(form.energy, parameters, stretch, modes)
    slopes = _slopes(form, parameters, stretch, modes)
    deviation = np.sqrt(np.maximum(np.einsum("np,pq,nq->n", slopes, covariance, slopes), 0.0))
    shear = shear_modulus(form.energy, parameters)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = stress / nominal_stress(neo_hookean, np.array([shear]), stretch, modes)
    reach = max(float(test.stretch.max()) for test in tests)
    variance = [float(np.sum((test.stress - test.stress.mean()) ** 2)) for test in tests]
    remains = [float(np.sum(difference[data.test == k] ** 2)) for k in range(len(tests))]
    return Fit(
        form,
        parameters,
        covariance=covariance,
        square=square,
        rms=float(np.sqrt(np.mean(difference**2))),
        r2=min(1.0 - left / all_ for left, all_ in zip(remains, variance, strict=True)),
        criterion=float(criterion),
        stable={mode: stable_up_to(form.energy, parameters, mode, reach) for mode in DIRECTIONS},
        reach=reach,
        curves={mode: ModeCurve(grids[mode], stress[modes == mode], deviation[modes == mode]) for mode in grids},
        ratios={mode: (float(ratio[modes == mode].min()), float(ratio[modes == mode].max())) for mode in grids},
        measured=frozenset(test.mode for test in tests),
    )


def covariance_of(form: Form, parameters: np.ndarray, data: MeasuredPoints, square: float) -> np.ndarray:
    """Covariance (m, m) of least squares with the errors of stress that the fit leaves, and those of the machine."""
    count = len(data.stress)
    variance = square * count / max(count - form.count, 1) + ACCURACY**2
    slopes = _slopes(form, parameters, data.stretch, data.mode) * data.scale[:, None]
    size = np.where(parameters == 0, 1.0, np.abs(parameters))
    _, singular, directions = np.linalg.svd(slopes * size, full_matrices=False)
    # A direction about which the tests say nothing has a large error, not an infinite one that would give NaN.
    inverse = directions.T / np.maximum(singular, 1e-9 * singular[0])
    return variance * count / min(count, INDEPENDENT) * np.outer(size, size) * (inverse @ inverse.T)


def _slopes(form: Form, parameters: np.ndarray, stretch: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Derivatives (n, m) of the nominal stress by the parameters, by central differences."""
    columns = []
    for k, number in enumerate(parameters):
        step = np.zeros(len(parameters))
        step[k] = 1e-4 * max(abs(number), 1e-4)
        ahead, behind = (nominal_stress(form.energy, parameters + sign * step, stretch, modes) for sign in (1, -1))
        columns.append((ahead - behind) / (2 * step[k]))
    return np.column_stack(columns)
