"""Rubbers of which only the stiffness at rest is known: Young's modulus, or a hardness; both become neo-Hookean."""

from __future__ import annotations

import re
from typing import Any

from pneumorph import units
from pneumorph.errors import short
from pneumorph.problem.table import InvalidKey, Quantity

INCOMPRESSIBLE = 1000.0
"""Bulk over shear modulus of a rubber said to be incompressible: Poisson's ratio is 0.4995."""

FOAM = 3.0
"""Bulk over shear modulus below which a rubber is to be confirmed: Poisson's ratio is then below 0.35, as of foams."""

HARD, HARDEST, SOFTEST = 50.0, 1000.0, 1e-5
"""Young's moduli in MPa: above the first a rubber is doubted, and none is beyond the others.

Polyurethane of Shore D 50 has 100 to 200 MPa, hard plastics have thousands; the softest gels have 1e-4 MPa.
"""

MEASURED = 0.43, 0.30, 0.50
"""Initial shear moduli over those of Gent's relation: their median, least and largest.

Of ten silicones of Shore A 10 to 44 that Marechal and others pulled for the first time (Soft Robotics 8 (2021) 284),
fitted by pneumorph up to a stretch of 3: Dragon Skin 10, 20 and 30, Mold Star 16 and 20T, PlatSil Gel 10, Rebound 25,
SortaClear 40, RTV615, WAGNERSIL 20.
"""

_MODULUS = Quantity(units.MODULUS, "positive")
_KEYS = ("youngs_modulus", "poisson", "poisson_ratio", "shore")


def gent(hardness: float) -> float:
    """Young's modulus in MPa of a Shore A hardness (A. N. Gent, Rubber Chemistry and Technology 31 (1958) 896)."""
    return 0.0981 * (56.0 + 7.66 * hardness) / (0.137505 * (254.0 - 2.54 * hardness))


def neo_hookean_table(table: dict[Any, Any]) -> dict[Any, Any]:
    """A table [material] with its `youngs_modulus` or `shore` replaced by what they mean; others stay as they are.

    Raises
    ------
    InvalidKey
        If they do not go together, or have no such value.
    """
    if not ("youngs_modulus" in table or "shore" in table):
        return table
    rest = {key: value for key, value in table.items() if key not in _KEYS}
    key = "shore" if "shore" in table else "youngs_modulus"
    others = [other for other in ("youngs_modulus", "shear_modulus") if other in table and other != key]
    if others:
        raise InvalidKey(key, f"is given together with {others[0]}; leave one of them out")
    if rest.get("model", "neo-hookean") != "neo-hookean":
        raise InvalidKey(
            key, f'gives a neo-Hookean rubber, but the model is "{short(str(rest["model"]))}"; leave it out'
        )
    if key == "shore":
        shear, source = _of_hardness(table["shore"])
        rest = {"name": f"Shore A {_scale_and_number(table['shore'])[1]:g}", "source": source} | rest
        ratio = _bulk_over_shear(table, "incompressible")
    else:
        young = _read(key, table[key])
        if reason := no_rubber(young):
            raise InvalidKey(key, f"{young:.3g} MPa is {reason}")
        ratio = _bulk_over_shear(table, None)
        if ratio < FOAM and not table.get("compressible"):
            own = "poisson_ratio" if "poisson_ratio" in table else "poisson"
            raise InvalidKey(
                own,
                f"{table[own]} is that of a foam; rubber hardly changes its volume: write {own} = "
                '"incompressible" or, if it is a foam, add compressible = true',
            )
        # E = 9 κ μ / (3 κ + μ).
        shear = young * (3.0 * ratio + 1.0) / (9.0 * ratio)
    if "bulk_modulus" in rest:
        raise InvalidKey("bulk_modulus", f"is given together with {key}, from which it follows; leave it out")
    return rest | {"shear_modulus": f"{shear:.6g} MPa", "bulk_modulus": f"{ratio * shear:.6g} MPa"}


def no_rubber(young: float) -> str | None:
    """Why no rubber has a Young's modulus in MPa, to follow "is "; None for what rubbers and gels may have."""
    if young > HARDEST:
        return f"that of a hard plastic or a metal; rubbers have 0.01 to {HARD:g} MPa, so check the number and its unit"
    if young < SOFTEST:
        return f"softer than any gel; rubbers have 0.01 to {HARD:g} MPa, so check the number and its unit"
    return None


def _read(key: str, given: Any) -> float:
    try:
        return _MODULUS.read(given)
    except ValueError as error:
        raise InvalidKey(key, str(error)) from None


def _bulk_over_shear(table: dict[Any, Any], otherwise: str | None) -> float:
    key = "poisson_ratio" if "poisson_ratio" in table else "poisson"
    given = table.get(key, otherwise)
    if given == "incompressible":
        return INCOMPRESSIBLE
    if not isinstance(given, int | float) or isinstance(given, bool) or not 0.0 <= given <= 0.5:
        wrong = "is missing" if given is None else f"{short(str(given))} is no ratio from 0 to 0.5"
        raise InvalidKey(key, f'{wrong}; write poisson = "incompressible" for rubber, or e.g. poisson = 0.49')
    return min(2.0 * (1.0 + given) / (3.0 * (1.0 - 2.0 * given) or 1e-9), INCOMPRESSIBLE)


def _scale_and_number(shore: Any) -> tuple[str, float]:
    """Scale and number of a hardness as data sheets write it: "A 30", "30A", "Shore A 30", "00-30"; else no scale."""
    text = " ".join(str(shore).upper().split()).removeprefix("SHORE ")
    scale, number = r"(?P<scale>A|D|OO|O|00|0)", r"(?P<number>\d+(?:\.\d+)?)"
    # A number before a scale that begins with a zero is set apart from it.
    match = re.fullmatch(rf"{scale}[ -]?{number}", text) or re.fullmatch(rf"{number}(?:[ -]|(?=[A-Z])){scale}", text)
    return (match["scale"], float(match["number"])) if match and isinstance(shore, str) else ("", 0.0)


def _of_hardness(shore: Any) -> tuple[float, str]:
    """Shear modulus in MPa of a hardness, and how it was found."""
    scale, hardness = _scale_and_number(shore)
    if scale == "D":
        raise InvalidKey(
            "shore",
            "is a hardness on the scale D, of hard plastics, which no soft actuator is made of; give the hardness on "
            'the scale A, e.g. shore = "A 30", or youngs_modulus and poisson',
        )
    if scale in ("00", "OO", "0", "O"):
        raise InvalidKey(
            "shore",
            f"{scale} is a scale without a relation to a modulus that soft silicones keep to; take a rubber of the "
            "library (pneumorph material list), or give shear_modulus",
        )
    if scale != "A" or not 5.0 <= hardness <= 90.0:
        raise InvalidKey("shore", f'"{short(str(shore))}" is no hardness from A 5 to A 90; write e.g. shore = "A 30"')
    middle, least, most = MEASURED
    low, high = (100.0 * (end / middle - 1.0) for end in (least, most))
    return (
        middle * gent(hardness) / 3.0,
        f"Shore A {hardness:g}: {middle:g} times Gent's relation (1958), the median of ten silicones measured by "
        f"Marechal et al., Soft Robotics 8 (2021) 284; single ones are from {low:.0f} % to +{high:.0f} % of it",
    )
