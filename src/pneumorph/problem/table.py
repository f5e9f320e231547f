"""Base of all tables of a problem file: quantities with units, and refusal of unknown and missing keys."""

import ast
import difflib
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import islice, pairwise
from types import MappingProxyType
from typing import Any, ClassVar, Literal, cast

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
    create_model,
    model_validator,
)
from pydantic_core import CoreSchema, InitErrorDetails, core_schema

from pneumorph import units
from pneumorph.errors import short

ROUNDING = 1e-9
"""Lengths in mm and angles in rad that are meant to be equal may differ by this much, by rounding."""

MOST_UNKNOWN = 100
"""Unknown keys of a table that are named; files may have thousands."""

NEAR = 0.65
"""Likeness of an unknown key from which on a known one is suggested in its place."""

TAG = "="
"""Prefix of the tags of alternative tables: they appear in the paths of pydantic's errors but are not keys."""


class InvalidKey(ValueError):
    """A table is invalid because of one of its keys, for the reason given."""

    def __init__(self, key: str, reason: str):
        super().__init__(reason)
        self.key = key


class UnknownKey(InvalidKey):
    """A table has a key that it should not have, for the reason given."""


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float field: text with a unit in the file, a float in the unit of the code after reading."""

    kind: units.Kind
    sign: Literal["any", "positive", "not negative"] = "any"

    def read(self, text: str) -> float:
        """The float as read by `units.parse`; raises ValueError also if its sign is not allowed."""
        value = units.parse(text, self.kind)
        if self.sign == "positive" and value <= 0:
            raise ValueError(f'"{short(text)}" is not above zero; write e.g. "{self.kind.example}"')
        if self.sign == "positive" and value < units.SMALLEST:
            raise ValueError(f'"{short(text)}" is too small; write e.g. "{self.kind.example}"')
        if self.sign == "not negative" and value < 0:
            raise ValueError(f'"{short(text)}" is below zero; write e.g. "{self.kind.example}"')
        return value

    def write(self, value: float) -> str:
        """A value as text with its unit."""
        return units.write(value, self.kind)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(
            self.read, handler(source), serialization=core_schema.plain_serializer_function_ser_schema(self.write)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return self.json_schema()

    def json_schema(self) -> dict[str, Any]:
        """The JSON schema of such a text."""
        number = units.NUMBER if self.sign == "any" else units.NUMBER.replace("[+-]?", r"\+?", 1)
        unit = "%" if self.kind is units.SHARE else "[A-Za-zµμ°/1].*"
        return {
            "type": "string",
            "description": f"{self.kind.name} with its unit",
            "pattern": rf"^\s*{number}\s*{unit}$",
            "examples": [self.kind.example],
        }


@dataclass(frozen=True)
class Example:
    """Annotation of a field that must be given and is not a quantity: what the message says to add if it is missing."""

    text: str


@cache
def described(table: type[BaseModel]) -> dict[str, str]:
    """The text after each key of a table, which says what it means.

    It is read from the source when it is asked for, as for the schema. Pydantic would read all of them in every process
    that loads the models, which was a sixth of the time that takes.
    """
    texts: dict[str, str] = {}
    for each in reversed(table.__mro__):
        if issubclass(each, Table):
            source = ast.parse(textwrap.dedent(inspect.getsource(each)))
            for pair in pairwise(cast(ast.ClassDef, source.body[0]).body):
                match pair:
                    case ast.AnnAssign(target=ast.Name(id=key)), ast.Expr(value=ast.Constant(value=str(text))):
                        texts[key] = inspect.cleandoc(text)
    return {key: text for key, text in texts.items() if key in table.model_fields}


def _as_in_the_file(schema: dict[str, Any], table: type[BaseModel]) -> None:
    """Write the texts after keys and the defaults in the JSON schema, these as in a problem file."""
    for key, text in described(table).items():
        schema["properties"][key]["description"] = text
    optional = [key for key, described in schema.get("properties", {}).items() if "default" in described]
    if optional:
        defaults = table.model_construct().model_dump(mode="json", include=set(optional), warnings=False)
        for key in optional:
            schema["properties"][key]["default"] = defaults[key]


class Table(BaseModel):
    """A table of the problem file; the text after each key is its description in the schema."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        hide_input_in_errors=True,
        json_schema_extra=_as_in_the_file,
    )

    instead: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """What to use in place of keys that a table does not have, though one may look for them there."""

    @model_validator(mode="before")
    @classmethod
    def _known_and_complete(cls, data: Any, info: ValidationInfo) -> Any:
        """Refuse unknown and missing keys here, where the valid names are known and can be suggested."""
        wrong = list(cls._unknown_and_missing(data)) if isinstance(data, dict) else []
        if wrong:
            raise ValidationError.from_exception_data(cls.__name__, [*wrong, *cls._faults_of_others(data, info)])
        return data

    @classmethod
    def _unknown_and_missing(cls, data: dict[Any, Any]) -> Iterator[InitErrorDetails]:
        def fault(key: str, reason: str, kind: type[InvalidKey] = InvalidKey) -> InitErrorDetails:
            error = kind(key, reason)
            return InitErrorDetails(type="value_error", loc=(), input=None, ctx={"error": error})

        for key in islice((key for key in data if key not in cls.model_fields), MOST_UNKNOWN):
            if key in cls.instead:
                yield fault(key, cls.instead[key])
                continue
            begun = [known for known in cls.model_fields if len(str(key)) > 1 and known.startswith(str(key))]
            near = difflib.get_close_matches(short(key), cls.model_fields, n=1, cutoff=NEAR) or begun
            yield fault(
                key,
                "unknown key; "
                + (f'did you mean "{near[0]}"?' if near else f"the keys here are {', '.join(cls.model_fields)}"),
                UnknownKey,
            )
        for key, field in cls.model_fields.items():
            if field.is_required() and key not in data:
                # An example of the key itself says more than one of its kind of quantity.
                told = next(
                    (part for kind in (Example, Quantity) for part in field.metadata if isinstance(part, kind)),
                    Example(f"the key {key}"),
                )
                example = told.text if isinstance(told, Example) else f'e.g. {key} = "{told.kind.example}"'
                yield fault(key, f"is missing; add {example}")

    @classmethod
    def _faults_of_others(cls, data: dict[Any, Any], info: ValidationInfo) -> list[InitErrorDetails]:
        """What is wrong with the values of the known keys, each for itself."""
        given = {key: value for key, value in data.items() if key in cls.model_fields}
        fields: dict[str, Any] = {key: (cls.model_fields[key].annotation, cls.model_fields[key]) for key in given}
        try:
            create_model(cls.__name__, __config__=ConfigDict(hide_input_in_errors=True), **fields).model_validate(
                given, context=info.context
            )
        except ValidationError as error:
            return [
                InitErrorDetails(type=each["type"], loc=each["loc"], input=each["input"], ctx=each.get("ctx", {}))
                for each in error.errors()
            ]
        return []
