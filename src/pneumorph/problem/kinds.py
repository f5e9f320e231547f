"""Fields that hold one of several tables, told apart by its key `kind`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BeforeValidator, Discriminator

from pneumorph.errors import short
from pneumorph.problem.table import TAG, InvalidKey


def by_kind(default: str | None = None) -> Discriminator:
    """What tells the table: `TAG` and its kind, by default one of them."""
    return Discriminator(lambda data: f"{TAG}{_kind(data, default)}")


def known(kinds: Sequence[str], what: str, default: str | None = None, instead: str = "") -> BeforeValidator:
    """Refuse a kind that is none of these, or missing where there is no default.

    Parameters
    ----------
    kinds : sequence of str
    what : str
        What they are kinds of, for the message.
    default : str, optional
        The kind of a table without the key.
    instead : str
        End of the message, after the kinds.
    """

    def checked(data: Any) -> Any:
        kind = _kind(data, default)
        if not isinstance(kind, str) or kind not in kinds:
            shown = f'"{short(kind)}"' if isinstance(kind, str) else f"a {type(kind).__name__}"
            wrong = "is missing" if kind is None else f"{shown} is not a known kind of {what}"
            raise InvalidKey("kind", f"{wrong}; use one of {', '.join(kinds)}{instead}")
        return data

    return BeforeValidator(checked)


def _kind(data: Any, default: str | None) -> Any:
    return data.get("kind", default) if isinstance(data, dict) else getattr(data, "kind", default)
