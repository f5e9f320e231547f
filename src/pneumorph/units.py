"""Quantities at the edge of the program: "60 kPa" in the file, 0.06 inside.

Inside, everything is a float in mm, N, MPa, t, s, rad (N = t·mm/s², MPa = N/mm²). Text becomes a float here and nowhere
else, and a float becomes text that reads back as the same float to the last bit: the arithmetic is decimal.
"""

import re
from dataclasses import dataclass
from decimal import Context, Decimal
from tokenize import TokenError
from typing import Any, cast

import pint

# pint documents Decimal here; its annotation knows float alone.
_registry = pint.UnitRegistry(non_int_type=cast(type[float], Decimal))

LARGEST, SMALLEST = 1e30, 1e-30
"""No quantity is larger, and none that has to be above zero is smaller: powers of it would overflow."""

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_QUANTITY = re.compile(rf"\s*({NUMBER})\s*(.*?)\s*")
_UNIT = re.compile(r"(?:1?\s*/\s*)?[A-Za-zµμ°](?:[A-Za-zµμ°²³·*/() ]|\^-?\d(?!\d))*")


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: what it is called, its unit inside, the unit it is written in, and an example."""

    name: str
    inside: str
    written: str
    example: str


LENGTH = Kind("a length", "mm", "mm", "80 mm")
PER_LENGTH = Kind("a number per length", "1/mm", "/mm", "0.6 /mm")
CURVATURE = Kind("a number per area", "1/mm^2", "/mm^2", "0.3 /mm^2")
PRESSURE = Kind("a pressure", "MPa", "kPa", "60 kPa")
MODULUS = Kind("a modulus", "MPa", "MPa", "0.49 MPa")
DENSITY = Kind("a density", "t/mm^3", "g/cm^3", "1.10 g/cm^3")
ACCELERATION = Kind("an acceleration", "mm/s^2", "m/s^2", "9.81 m/s^2")
ANGLE = Kind("an angle", "rad", "deg", "30 deg")
FORCE = Kind("a force", "N", "N", "2 N")
MOMENT = Kind("a moment", "N*mm", "N*mm", "50 N*mm")
STIFFNESS = Kind("a stiffness", "N/mm", "N/mm", "4 N/mm")
ROTATIONAL_STIFFNESS = Kind("a stiffness against turning", "N*mm/rad", "N*mm/rad", "100 N*mm/rad")


def text_of(quantity: Any) -> Any:
    """A pint quantity, of any registry, as text with its unit; all else as it is."""
    if hasattr(quantity, "magnitude") and hasattr(quantity, "units"):
        unit = format(quantity.units, "C").replace("**", "^")
        return f"{quantity.magnitude} {unit}"
    return quantity


def parse(text: Any, kind: Kind) -> float:
    """The value of a quantity in its inside unit.

    Parameters
    ----------
    text : str or pint quantity
        A number and a unit, e.g. ``"60 kPa"``, ``"0.6 /mm"``, ``"1.10 g/cm^3"``.
    kind : Kind
        What the quantity has to be.

    Raises
    ------
    ValueError
        Says what is wrong (no unit, no number, an unknown unit, another dimension) and how to fix it.
    """
    fix = f'write e.g. "{kind.example}"'
    text = text_of(text)
    if not isinstance(text, str):
        if isinstance(text, (int, float)) and not isinstance(text, bool):
            raise ValueError(f"the number {text} has no unit; {fix}")
        raise ValueError(f"{kind.name} with its unit is needed here; {fix}")
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError(f'"{text}" is not a number with a unit; {fix}')
    number, unit = match.groups()
    if not unit:
        raise ValueError(f'"{text}" has no unit; {fix}')
    value = float(Decimal(number) * _factor(unit, kind))
    if not abs(value) <= LARGEST:
        raise ValueError(f'"{text}" is too large; {fix}')
    return value


def write(value: float, kind: Kind) -> str:
    """The shortest text that `parse` reads back as exactly this value, in the usual unit of its kind."""
    factor = _factor(kind.written, kind)
    exact = Decimal(value) / factor
    for digits in range(1, 29):
        number = Context(prec=digits).plus(exact)
        if float(number * factor) == value:
            plain = f"{number:f}" if -5 < number.adjusted() < 9 else str(number)
            return f"{plain} {kind.written}"
    raise ValueError(f"{value} {kind.inside} cannot be written as {kind.name}")


def _factor(unit: str, kind: Kind) -> Decimal:
    """How many inside units one `unit` is."""
    fix = f'write e.g. "{kind.example}"'
    if _UNIT.fullmatch(unit) is None:
        raise ValueError(f'"{unit}" is not a unit; {fix}')
    try:
        parsed = _registry.parse_units(f"1{unit}" if unit.startswith("/") else unit)
    # What pint raises for text that is not a unit depends on where its tokenizer, parser or arithmetic trips.
    except (pint.PintError, TokenError, ArithmeticError, AssertionError, SyntaxError, TypeError, ValueError) as error:
        raise ValueError(f'"{unit}" is not a unit known here; {fix}') from error
    inside = _registry.parse_units(kind.inside)
    if parsed.dimensionality != inside.dimensionality:
        raise ValueError(f'"{unit}" is not a unit of {kind.name}; {fix}')
    return _registry.Quantity(Decimal(1), parsed).to(inside).magnitude
