"""The constants of a material by their names, with the bulk modulus, and materials with others."""

from __future__ import annotations

import re
from collections.abc import Mapping

from pneumorph.problem.material import Material, Ogden, OgdenTerm, Yeoh

BULK = "bulk_modulus"
"""The last constant of every material."""

PURE = ("limit", "locking_stretch", "alpha")
"""How the names of constants begin that are pure numbers; all others are moduli, MPa."""


_ANY = re.compile(r"c\d{1,2}|mu\d|alpha\d|shear_modulus|limit|locking_stretch|bulk_modulus")


def constants(material: Material) -> dict[str, float]:
    """All constants of a material by their names, MPa or pure numbers, in the order of its energy's parameters."""
    return material.constants | {BULK: material.bulk_modulus}


def is_modulus(constant: str) -> bool:
    """Whether the energy is proportional to a constant, with all others that are moduli."""
    return not constant.startswith(PURE)


def may_be_constant(name: str) -> bool:
    """Whether some rubber has a constant with this name."""
    return _ANY.fullmatch(name.rpartition(".")[2]) is not None


def named(region: str, constant: str) -> str:
    """What a constant of a region's rubber is called; the only rubber has the region ""."""
    return f"{region}.{constant}" if region else constant


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
            coefficients = tuple(own[name] for name in material.constants)
            changed = {"coefficients": coefficients, BULK: own[BULK]}
        case Ogden():
            numbers = range(1, len(material.terms) + 1)
            terms = (OgdenTerm.model_construct(modulus=own[f"mu{k}"], exponent=own[f"alpha{k}"]) for k in numbers)
            changed = {"terms": tuple(terms), BULK: own[BULK]}
        case _:
            changed = own
    return material.model_copy(update=changed)
