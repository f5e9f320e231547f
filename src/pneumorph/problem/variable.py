"""Quantities that are fixed, or free in a range and designed along with the shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from pydantic import GetJsonSchemaHandler, SerializerFunctionWrapHandler, model_serializer, model_validator
from pydantic_core import CoreSchema

from pneumorph.problem.table import InvalidKey, Quantity, Table


@dataclass(frozen=True)
class Share:
    """What a share of a whole is in a file: a number above 0, at most 1."""

    def read(self, number: Any) -> float:
        """The number; raises ValueError if it is none, or no share."""
        if isinstance(number, bool) or not isinstance(number, (int, float)):
            raise ValueError("a number above 0, at most 1, is expected here; write e.g. 0.6")
        if not 0.0 < number <= 1.0:
            raise ValueError(f"{number:g} is not above 0 and at most 1; write e.g. 0.6")
        return float(number)

    def write(self, value: float) -> float:
        """The number itself."""
        return value

    def json_schema(self) -> dict[str, Any]:
        """The JSON schema of such a number."""
        return {"type": "number", "exclusiveMinimum": 0, "maximum": 1}


class Variable(Table):
    """A quantity with its value at the start and its bounds; in a file a single value is one that is fixed."""

    quantity: ClassVar[Quantity | Share]

    start: float
    min: float
    max: float

    @property
    def free(self) -> bool:
        """Whether it is designed along with the shape."""
        return self.min < self.max

    @model_validator(mode="before")
    @classmethod
    def _fixed(cls, data: Any) -> Any:
        if isinstance(data, dict):
            return data
        cls.quantity.read(data)
        return {"start": data, "min": data, "max": data}

    @model_validator(mode="after")
    def _start_within(self) -> Variable:
        if self.min > self.max:
            raise InvalidKey("min", "is above max; swap them")
        if not self.min <= self.start <= self.max:
            raise InvalidKey("start", "is not between min and max; change it or widen the range")
        return self

    @model_serializer(mode="wrap")
    def _as_in_the_file(self, write: SerializerFunctionWrapHandler) -> Any:
        return write(self) if self.free else self.quantity.write(self.start)

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [cls.quantity.json_schema(), handler(schema)]}
