"""Quantities with units that options give."""

from __future__ import annotations

from pneumorph import units
from pneumorph.errors import ProblemError


def positive(option: str, text: str, kind: units.Kind) -> float:
    """The value of an option in the package's units; ProblemError unless it is a positive quantity of the kind."""
    try:
        value = units.parse(text, kind)
    except ValueError as error:
        raise ProblemError(f"{option}: {error}") from None
    if not value > 0.0:
        raise ProblemError(f'{option}: "{text}" is not above zero; write e.g. "{kind.example}"')
    return value
