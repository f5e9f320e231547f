"""The help of commands with sub-commands."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup


class WholeSentences(TyperGroup):
    """A group whose help lists its commands with all of their first sentence, wrapped to the screen."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        named = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [(name, (command.help or "").split("\n\n")[0]) for name, command in named if command is not None]
        with formatter.section("Commands"):
            formatter.write_dl(rows)
