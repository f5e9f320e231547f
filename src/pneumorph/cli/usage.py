"""Mistakes in the arguments of a command, in one line each."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

import typer

UsageError: Any = typer.BadParameter.__base__
"""Of all such mistakes. Versions of typer have it in different modules."""

NEAR = 0.5
"""How alike an option must be to one that there is for this to be meant, as `difflib` measures it."""


def shows_help(error: Any) -> bool:
    """Whether it is none, but the help of a group of commands."""
    return type(error).__name__ == "NoArgsIsHelpError"


def in_words(error: Any) -> str:
    """What is wrong, and what may have been meant."""
    # Without the name by which the program is called.
    command = "" if error.ctx is None else error.ctx.command_path.partition(" ")[2]
    return f"{command}{': ' if command else ''}{_wrong(error)}; see pneumorph{' ' if command else ''}{command} --help"


def _wrong(error: Any) -> str:
    if type(error).__name__ == "NoSuchOption":
        known = [name for each in error.ctx.command.params for name in each.opts if name.startswith("--")]
        near = get_close_matches(error.option_name, known, 1, NEAR)
        return f"there is no option {error.option_name}{f'; the nearest is {near[0]}' if near else ''}"
    # Without the capitals, full stops, quotes and braces of sentences that follow a usage of several lines.
    words = error.format_message().removeprefix("Invalid value for ").translate(dict.fromkeys(map(ord, "'{}")))
    return (words[:1].lower() + words[1:]).rstrip(".?").replace(". Did", ", did")
