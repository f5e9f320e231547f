"""A user's function of the features."""

import io
import keyword
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, GetJsonSchemaHandler, Strict, ValidationInfo, field_validator, model_validator
from pydantic_core import CoreSchema

from pneumorph.errors import short
from pneumorph.problem.beside import contents_of, file_of, stored, with_file
from pneumorph.problem.objectives.table import ObjectiveTable
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.problem.table import Example, InvalidKey

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
        path = file_of(data, info, "code", 'a Python file; write e.g. file = "objective.py"')
        if path is None:
            return data
        try:
            # With the ends of lines that Python gives every text.
            code = io.TextIOWrapper(io.BytesIO(contents_of(path)), encoding="utf-8-sig").read()
        except UnicodeDecodeError:
            raise InvalidKey(
                "file", f"{short(path, 120)} cannot be read (it is not UTF-8 text); save it as such"
            ) from None
        return stored(data, code=code)

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
