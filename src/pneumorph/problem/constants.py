"""The constants of a material by their names, and materials with others."""

from __future__ import annotations

from collections.abc import Mapping

from pneumorph.problem.material import (
    ArrudaBoyce,
    Gent,
    Material,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    OgdenTerm,
    Yeoh,
)

BULK = "bulk_modulus"
"""The last constant of every material."""

PURE = ("limit", "locking_stretch", "alpha")
"""How the names of constants begin that are pure numbers; all others are moduli, MPa."""


def constants(material: Material) -> dict[str, float]:
    """The constants of a material by their names, MPa or pure numbers, in the order of its energy's parameters.

    They have the names of their keys; c1, c2, … are Yeoh's coefficients, and mu1, alpha1, … the moduli and exponents
    of Ogden's terms.
    """
    match material:
        case NeoHookean():
            own = {"shear_modulus": material.shear_modulus}
        case MooneyRivlin():
            second = {"c20": material.c20, "c11": material.c11, "c02": material.c02}
            own = {"c10": material.c10, "c01": material.c01} | (second if any(second.values()) else {})
        case Yeoh():
            own = {f"c{k}": value for k, value in enumerate(material.coefficients, 1)}
        case Gent():
            own = {"shear_modulus": material.shear_modulus, "limit": material.limit}
        case ArrudaBoyce():
            own = {"shear_modulus": material.shear_modulus, "locking_stretch": material.locking_stretch}
        case Ogden():
            own = {}
            for k, term in enumerate(material.terms, 1):
                own |= {f"mu{k}": term.modulus, f"alpha{k}": term.exponent}
    return own | {BULK: material.bulk_modulus}


def is_modulus(constant: str) -> bool:
    """Whether the energy is proportional to a constant, with all others that are moduli."""
    return not constant.startswith(PURE)


def with_constants(material: Material, values: Mapping[str, float]) -> Material:
    """A material with other values of some constants, which are not checked.

    Parameters
    ----------
    material : the material.
    values : by names of its constants.
    """
    own = constants(material) | dict(values)
    match material:
        case Yeoh():
            count = len(material.coefficients)
            changed = {"coefficients": tuple(own[f"c{k}"] for k in range(1, count + 1)), BULK: own[BULK]}
        case Ogden():
            numbers = range(1, len(material.terms) + 1)
            terms = (OgdenTerm.model_construct(modulus=own[f"mu{k}"], exponent=own[f"alpha{k}"]) for k in numbers)
            changed = {"terms": tuple(terms), BULK: own[BULK]}
        case _:
            changed = own
    return material.model_copy(update=changed)
