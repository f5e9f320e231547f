"""Tables that take the path of a file beside the problem file as `file`, and store its contents in another key."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema

from pneumorph.errors import short
from pneumorph.problem.reading import MOST_BYTES, read_bytes
from pneumorph.problem.table import InvalidKey


def file_of(data: Any, info: ValidationInfo, contents: str, example: str) -> Path | None:
    """The path that a table gives as `file`, from the folder of the problem file; None if it gives none.

    Parameters
    ----------
    data, info
        As pydantic gives them to a validator before all others.
    contents : str
        The key of the contents.
    example : str
        What the file is, and a path, such as `an STL file; write e.g. file = "part.stl"`.

    Raises
    ------
    InvalidKey
        If it is given together with the contents, or is no text.
    """
    if not isinstance(data, dict) or "file" not in data:
        return None
    if contents in data:
        raise InvalidKey("file", f"is given together with {contents}; leave one of them out")
    if not isinstance(data["file"], str):
        raise InvalidKey("file", f"should be the name of {example}")
    return Path((info.context or {}).get("folder", ".")) / data["file"]


def contents_of(path: Path, most: int = MOST_BYTES) -> bytes:
    """The bytes of such a file; InvalidKey where it cannot be read."""
    try:
        return read_bytes(path, most)
    except (OSError, ValueError) as error:
        why = f"{short(path, 120)} cannot be read ({getattr(error, 'strerror', None) or error})"
        raise InvalidKey("file", f"{why}; put it next to the problem file") from None


def stored(data: dict[str, Any], /, **contents: Any) -> dict[str, Any]:
    """The table with contents in place of the path."""
    return {key: value for key, value in data.items() if key != "file"} | contents


def with_file(schema: CoreSchema, handler: GetJsonSchemaHandler, contents: str, description: str) -> dict[str, Any]:
    """The JSON schema of a table that takes the path of a file as `file` in place of its contents.

    Parameters
    ----------
    schema, handler
        As pydantic gives them to ``__get_pydantic_json_schema__``.
    contents : str
        The key of the contents.
    description : str
        Of `file`, for users.
    """
    reference = handler(schema)
    table = handler.resolve_ref_schema(reference)
    table["properties"]["file"] = {"type": "string", "title": "File", "description": description}
    table["required"].remove(contents)
    table["oneOf"] = [{"required": ["file"]}, {"required": [contents]}]
    return reference
