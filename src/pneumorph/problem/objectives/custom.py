"""A user's function of the features."""

import io
import keyword
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, GetJsonSchemaHandler, Strict, ValidationInfo, field_validator, model_validator
from pydantic_core import CoreSchema

from pneumorph.errors import short
from pneumorph.problem.objectives.table import ObjectiveTable
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.problem.reading import read_bytes
from pneumorph.problem.table import Example, InvalidKey, with_file

MOST_CODE = 100_000
"""Characters of a user's function: whoever is asked whether it may run has to read it."""


class Custom(ObjectiveTable):
    """Objective: a function of the features to be minimised, written in Python with jax.numpy.

    In a problem file, `file` names a Python file in the same folder. On reading, its text is stored as `code`, so that
    a run does not depend on the file.
    """

    curve: ClassVar[str] = "objective"

    kind: Literal["custom"]
    """The kind of objective."""
    code: Annotated[
        str,
        Strict(),
        Field(max_length=MOST_CODE),
        Example('a file next to the problem file, e.g. file = "objective.py"'),
    ]
    """The text of the Python file; `file` is given in its place."""
    function: Annotated[str, Strict(), Field(max_length=100)] = "objective"
    """Name of the function."""
    sections: Annotated[int, Strict(), Field(ge=0, le=100)] = 0
    """Number of sections in the features; 0 for none."""

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or "file" not in data:
            return data
        if "code" in data:
            raise InvalidKey("file", "is given together with code; leave one of them out")
        if not isinstance(data["file"], str):
            raise InvalidKey("file", 'should be the name of a Python file; write e.g. file = "objective.py"')
        path = Path((info.context or {}).get("folder", ".")) / data["file"]
        try:
            # With the ends of lines that Python gives every text.
            code = io.TextIOWrapper(io.BytesIO(read_bytes(path)), encoding="utf-8-sig").read()
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or "it is not UTF-8 text"
            shown = short(path, 120)
            raise InvalidKey("file", f"{shown} cannot be read ({why}); put it next to the problem file") from None
        return {key: value for key, value in data.items() if key != "file"} | {"code": code}

    @field_validator("function")
    @classmethod
    def _is_a_name(cls, name: str) -> str:
        if not name.isidentifier() or keyword.iskeyword(name):
            raise ValueError(f'"{short(name)}" is not the name of a Python function; use letters, digits and _')
        return name

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        description = 'Name of a Python file beside the problem file, e.g. file = "objective.py".'
        return with_file(schema, handler, "code", description)

    @property
    def aimed(self) -> bool:
        """False: what a user's function measures is not known."""
        return False

    @property
    def section_count(self) -> tuple[str, int]:
        """See `ObjectiveTable.section_count`."""
        return "sections", self.sections

    def achieved(self, result: Result) -> Amount:
        """The value of the function."""
        return Amount(result.objective, "", "objective")
