"""Conversion of quantities between text and numbers: "60 kPa" in a file is 0.06 in the code.

In the code everything is a float in mm, N, MPa, t, s, rad (N = t·mm/s², MPa = N/mm²). Text is converted only here, and
a float is written as text that reads back as the same float to the last bit; the arithmetic is therefore decimal.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Context, Decimal
from functools import cache, lru_cache
from tokenize import TokenError
from typing import TYPE_CHECKING, Any, cast

from pneumorph.errors import ProblemError, short

if TYPE_CHECKING:
    import pint

LARGEST, SMALLEST = 1e30, 1e-30
"""Bounds of quantities, the lower one for those that must be positive: beyond them powers would overflow."""

MOST = 200
"""Characters of a quantity: what is longer is none, and reading it could take for ever."""

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_COMMA = re.compile(r",([0-9]+)")
_QUANTITY = re.compile(rf"\s*({NUMBER})\s*(.*?)\s*")
_UNIT = re.compile(r"(?:1?\s*/\s*)?[A-Za-zµμ°](?:[A-Za-zµμ°²³·*/() ]|\^-?\d(?!\d))*")

_NO_UNIT = (
    TokenError, ArithmeticError, AssertionError, MemoryError, RecursionError, SyntaxError, TypeError, ValueError,
)  # fmt: skip
"""What pint raises for text that is no unit, beside its own errors: its tokenizer, parser or arithmetic fails."""


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: its name, the unit used in the code, the unit it is written in, and an example.

    `most` is the largest, in the unit used in the code, beyond all that robots have: what is above it is a slip.
    `factor` is the value of one written unit in that of the code.
    """

    name: str
    inside: str
    written: str
    example: str
    most: float = LARGEST
    factor: Decimal = Decimal(1)


_DEGREE = Decimal("0.01745329251994329576923690768")

LENGTH = Kind("a length", "mm", "mm", "80 mm", 1e6)
VOLUME = Kind("a volume", "mm^3", "ml", "12 ml", 1e12, factor=Decimal(1000))
AREA = Kind("an area", "mm^2", "mm^2", "8 mm^2")
PER_LENGTH = Kind("a number per length", "1/mm", "/mm", "0.6 /mm")
CURVATURE = Kind("a number per area", "1/mm^2", "/mm^2", "0.3 /mm^2")
PRESSURE = Kind("a pressure", "MPa", "kPa", "60 kPa", 1e4, factor=Decimal("0.001"))
MODULUS = Kind("a modulus", "MPa", "MPa", "0.49 MPa")
DENSITY = Kind("a density", "t/mm^3", "g/cm^3", "1.10 g/cm^3", factor=Decimal("1e-9"))
ACCELERATION = Kind("an acceleration", "mm/s^2", "m/s^2", "9.81 m/s^2", factor=Decimal(1000))

STANDARD_GRAVITY = 9810.0
"""mm/s²: the default of problem files, and that in which silicone and cores sag."""

ANGLE = Kind("an angle", "rad", "deg", "30 deg", 63.0, factor=_DEGREE)
ANGLE_PER_PRESSURE = Kind("a rotation per pressure", "rad/MPa", "deg/kPa", "2 deg/kPa", factor=1000 * _DEGREE)
LENGTH_PER_PRESSURE = Kind("a motion per pressure", "mm/MPa", "mm/kPa", "0.5 mm/kPa", factor=Decimal(1000))
SHARE = Kind("a percentage", "dimensionless", "%", "1 %", 0.5, factor=Decimal("0.01"))
TIME = Kind("a time", "s", "s", "10 s")
PRESSURE_RATE = Kind("a pressure per time", "MPa/s", "kPa/s", "2 kPa/s", factor=Decimal("0.001"))
VOLUME_RATE = Kind("a volume per time", "mm^3/s", "ml/s", "0.5 ml/s", factor=Decimal(1000))
SPEED = Kind("a speed", "mm/s", "mm/s", "1 mm/s")
TURN_RATE = Kind("an angle per time", "rad/s", "deg/s", "10 deg/s", factor=_DEGREE)
MASS = Kind("a mass", "t", "g", "20 g", factor=Decimal("1e-6"))
FORCE = Kind("a force", "N", "N", "2 N", 1e8)
MOMENT = Kind("a moment", "N*mm", "N*mm", "50 N*mm", 1e11)
STIFFNESS = Kind("a stiffness", "N/mm", "N/mm", "4 N/mm")
ROTATIONAL_STIFFNESS = Kind("a rotational stiffness", "N*mm/rad", "N*mm/rad", "100 N*mm/rad")


def text_of(quantity: Any) -> Any:
    """A pint quantity of any registry as text with its unit; anything else unchanged."""
    if hasattr(quantity, "magnitude") and hasattr(quantity, "units"):
        unit = format(quantity.units, "C").replace("**", "^")
        return f"{quantity.magnitude} {unit}"
    return quantity


def parse(text: Any, kind: Kind) -> float:
    """Read a quantity and return its value in the unit used in the code.

    Parameters
    ----------
    text : str or pint quantity
        A number and a unit, e.g. ``"60 kPa"``, ``"0.6 /mm"``, ``"1.10 g/cm^3"``.
    kind : Kind
        The kind of quantity that is expected.

    Raises
    ------
    ValueError
        If the number or the unit is missing, or the unit is unknown or of another dimension. The message says how to
        fix it.
    """
    fix = f'write e.g. "{kind.example}"'
    text = text_of(text)
    if not isinstance(text, str):
        if isinstance(text, (int, float)) and not isinstance(text, bool):
            shown = short(text)
            meant = f"{shown} {kind.written}" if abs(text) < LARGEST else kind.example
            raise ValueError(f'the number {shown} has no unit; write e.g. "{meant}"')
        raise ValueError(f"{kind.name} with its unit is expected here; {fix}")
    match = _QUANTITY.fullmatch(text) if len(text) <= MOST else None
    if match is None:
        raise ValueError(f'"{short(text)}" is not a number with a unit; {fix}')
    number, unit = match.groups()
    if not unit:
        meant = f"{text.strip()} {kind.written}" if abs(float(number)) < LARGEST else kind.example
        raise ValueError(f'"{short(text.strip())}" has no unit; write e.g. "{short(meant)}"')
    if comma := _COMMA.match(unit):
        raise ValueError(
            f'"{short(text)}" has a comma; write a decimal point, "{number}.{comma[1]}{unit[comma.end() :]}"'
        )
    value = float(Decimal(number) * _factor(unit, kind))
    if not abs(value) <= kind.most:
        raise ValueError(f'"{short(text)}" is too large; {fix}')
    return value


def split(text: Any) -> tuple[float, str] | None:
    """The number and the unit of a quantity as they are written; None for anything else."""
    match = _QUANTITY.fullmatch(text) if isinstance(text, str) and len(text) <= MOST else None
    if match is None or not _UNIT.fullmatch(match[2]):
        return None
    return float(match[1]), match[2]


def parse_positive(name: str, text: Any, kind: Kind) -> float:
    """Read an option or argument with this name.

    Raises
    ------
    ProblemError
        If it is not a quantity of the kind, or not above zero.
    """
    try:
        value = parse(text, kind)
    except ValueError as error:
        raise ProblemError(f"{name}: {error}") from None
    if not value > 0.0:
        raise ProblemError(f'{name}: "{text}" is not above zero; write e.g. "{kind.example}"')
    return value


def write(value: float, kind: Kind) -> str:
    """Write a value as the shortest text that `parse` reads back exactly, in the usual unit of its kind."""
    if value == 0.0:
        return f"0 {kind.written}"
    factor = _factor(kind.written, kind)
    exact = Decimal(value) / factor
    for digits in range(1, 29):
        number = Context(prec=digits).plus(exact)
        if float(number * factor) == value:
            plain = f"{number:f}" if -5 < number.adjusted() < 9 else str(number)
            return f"{plain} {kind.written}"
    raise ValueError(f"{value} {kind.inside} cannot be written as {kind.name}")


@lru_cache(maxsize=256)
def _factor(unit: str, kind: Kind) -> Decimal:
    """Value of one `unit` in the unit used in the code."""
    if unit == kind.inside:
        return Decimal(1)
    return kind.factor if unit == kind.written else _converted(unit, kind)


@cache
def _registry() -> pint.UnitRegistry:
    # Loaded here: it takes longer than reading a problem, and few units are others than the usual ones of their kind.
    import pint

    # pint documents that Decimal is accepted here; its annotation allows only float.
    return pint.UnitRegistry(non_int_type=cast(type[float], Decimal))


def _converted(unit: str, kind: Kind) -> Decimal:
    """Value of one `unit` in the unit used in the code, whatever it is."""
    registry = _registry()
    from pint import PintError

    fix = f'write e.g. "{kind.example}"'
    unit = "percent" if unit == "%" else unit
    if _UNIT.fullmatch(unit) is None:
        raise ValueError(f'"{short(unit)}" is not a unit; {fix}')
    try:
        parsed = registry.parse_units(f"1{unit}" if unit.startswith("/") else unit)
    except (PintError, *_NO_UNIT) as error:
        raise ValueError(f'"{short(unit)}" is not a known unit; {fix}') from error
    inside = registry.parse_units(kind.inside)
    if parsed.dimensionality != inside.dimensionality:
        raise ValueError(f'"{short(unit)}" is not a unit of {kind.name}; {fix}')
    return registry.Quantity(Decimal(1), parsed).to(inside).magnitude
