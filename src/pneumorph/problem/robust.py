"""The table [robust] of a problem file: what varies from casting to casting, against which designs are robust."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from math import radians
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema, core_schema

from pneumorph import units
from pneumorph.errors import short
from pneumorph.problem.directions import Number
from pneumorph.problem.table import Quantity, Table

LARGEST = 0.5
"""Relative deviation above which first derivatives say nothing of where castings differ most."""

MOST_DEVIATIONS = 3.0


@dataclass(frozen=True)
class Percentage:
    """Annotation of a float field: a text such as "10 %" in the file, a fraction after reading."""

    most: float

    def read(self, text: Any) -> float:
        """The fraction; raises ValueError if it is not one, or not from 0 to the largest."""
        given = str(units.text_of(text)).strip()
        try:
            value = Decimal(given.removesuffix("%").strip()) / 100
        except InvalidOperation:
            value = Decimal("NaN")
        if not given.endswith("%") or len(given) > units.MOST or not value.is_finite():
            raise ValueError(f'"{short(text)}" is not a percentage; write e.g. "10 %"')
        if not 0 <= value <= Decimal(self.most):
            raise ValueError(f'"{short(text)}" is not from 0 % to {100 * self.most:g} %; write e.g. "10 %"')
        return float(value)

    def write(self, value: float) -> str:
        """A fraction as text that is read as the same float."""
        return f"{(100 * Decimal(repr(value))).normalize():f} %"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(
            self.read, handler(source), serialization=core_schema.plain_serializer_function_ser_schema(self.write)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {
            "type": "string",
            "description": "a percentage",
            "pattern": rf"^\s*{units.NUMBER}\s*%\s*$".replace("[+-]?", r"\+?", 1),
            "examples": ["10 %"],
        }


class RobustSpec(Table):
    """Standard deviations of what a workshop cannot repeat, each of a cause that varies by itself.

    Castings that are perturbed by `deviations` standard deviations in the direction that matters most are solved. A
    task with a target then has the objective of the mean error squared and the spread squared; one without is about the
    worse casting.
    """

    rubber: Annotated[float, Percentage(LARGEST)] = 0.1
    """Of the moduli of the rubber, relative."""
    pressure: Annotated[float, Quantity(units.PRESSURE, "not negative")] = 0.001
    """Of the pressure of every chamber that has one."""
    wall: Annotated[float, Quantity(units.LENGTH, "not negative")] = 0.1
    """Of the thickness of rubber at every surface."""
    shift: Annotated[float, Quantity(units.LENGTH, "not negative")] = 0.2
    """Of the place of every core along each axis."""
    tilt: Annotated[float, Quantity(units.ANGLE, "not negative")] = radians(0.2)
    """Of the angle of every core about x and y."""
    deviations: Annotated[Number, Field(gt=0, le=MOST_DEVIATIONS)] = 1.0
    """By how many standard deviations castings are perturbed: the weight of the spread."""

    @model_validator(mode="after")
    def _varies(self) -> RobustSpec:
        if not any((self.rubber, self.pressure, self.wall, self.shift, self.tilt)):
            raise ValueError('has no cause that varies; give one, e.g. rubber = "10 %", or leave the table out')
        return self
