"""Constants that tests do not determine, and by which further test they would be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pneumorph.mechanics.material.fit import TensionTest, borne, is_term, material_keys, points
from pneumorph.mechanics.material.homogeneous import DIRECTIONS, stable_up_to, stretch_at
from pneumorph.mechanics.material.judge import Fit, covariance_of

FARTHER = (1.25, 1.5, 2.0, 3.0)
"""Factors of the largest stretch up to which a further test of a mode that was measured is tried."""

CERTAIN = 4.0
"""Standard deviations by which a further test should tell a constant from zero: twice what is needed, since how large
the constant is, is not known yet."""


def kept(one: Fit) -> np.ndarray:
    """Which parameters (m,) the table [material] has: not those of Ogden terms that are zero."""
    if one.form.model == "ogden":
        return np.repeat(is_term(one.parameters[::2]), 2)
    return np.ones(len(one.parameters), bool)


def undetermined(one: Fit) -> dict[str, int]:
    """Names and indices of the parameters in the table [material] that the tests do not tell from zero."""
    indices = np.flatnonzero(kept(one))
    if one.form.model == "ogden":
        names = [f"{key} {k + 1}" for k in range(len(indices) // 2) for key in ("modulus", "exponent")]
    elif one.form.model == "yeoh":
        names = [f"coefficient {k + 1}" for k in range(len(indices))]
    else:
        names = [key for key, _ in material_keys(one.form, one.parameters)]
    return {name: int(k) for name, k in zip(names, indices, strict=True) if k in one.undetermined}


def sentences(one: Fit, tests: Sequence[TensionTest]) -> Iterator[str]:
    """Of each constant that the tests do not determine: how well it is known, and what would determine it.

    A further test is taken to have as many points as the largest of the tests, with the stresses of the fit and errors
    like those of the others.
    """
    for name, k in undetermined(one).items():
        unit = "" if name.startswith(("limit", "locking", "exponent")) else " MPa"
        number, deviation = float(one.parameters[k]), float(one.deviations[k])
        helping: dict[str, str] = {}
        for further in _further(one, tests):
            if further.mode not in helping and _determines(one, k, [*tests, further]):
                article, end = "an" if further.mode == "equibiaxial" else "a", further.stretch[-1]
                helping[further.mode] = f"{article} {further.mode} test up to a stretch of {end:.3g}"
        if helping:
            would = f"{' or '.join(helping.values())} would, if the model holds there"
        else:
            would = "no single further test would; take a model with fewer constants"
        yield (
            f"the tests do not determine {name} of {one.form.label}, {number:.3g} ± {2 * deviation:.2g}{unit} within "
            f"two standard deviations: {would}"
        )


def _further(one: Fit, tests: Sequence[TensionTest]) -> Iterator[TensionTest]:
    """Tests that could be made: of every other mode as far as the rubber was stretched, of those measured farther.

    The nearest ones of a mode come first, and none is where the model is not stable.
    """
    count, top = max(len(test.stretch) for test in tests), borne(tests)
    for mode in DIRECTIONS:
        ends = [stretch_at(top, mode)]
        if mode in one.measured:
            longest = max(test.stretch.max() for test in tests if test.mode == mode)
            ends = [longest * factor for factor in FARTHER]
        for end in ends:
            stretch = np.linspace(1.0, float(end), count + 1)[1:]
            with np.errstate(all="ignore"):
                stress = one.stress(stretch, mode)
            holds = stable_up_to(one.form.energy, one.parameters, mode, float(end)) >= end
            if holds and np.all(np.isfinite(stress)) and np.all(stress > 0.0):
                yield TensionTest(stretch, stress, mode)


def _determines(one: Fit, k: int, tests: Sequence[TensionTest]) -> bool:
    covariance = covariance_of(one.form, one.parameters, points(tests), one.square)
    return bool(np.abs(one.parameters[k]) > CERTAIN * np.sqrt(covariance[k, k]))
