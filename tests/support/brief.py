"""Commands that end where what takes long would begin, with a design that must be sound by then."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from damage import START

from pneumorph.cli import view
from pneumorph.errors import ComputationError
from pneumorph.interface import pictures
from pneumorph.interface.design import Design
from pneumorph.output import render
from pneumorph.serve import live

COMMANDS = ("simulate", "view", "make", "draw body", "draw history", "draw profile", "draw evolution")
"""What is done with a run whose files are damaged."""

BEGUN = "it has begun"


def commands_for(damage: str) -> tuple[str, ...]:
    """Those that read what a damage is done to: only the first two read more of a checkpoint or a result."""
    return COMMANDS[: 2 if damage.startswith(("state", "result")) else None]


def arguments(command: str, run: Path, pictures: Path) -> list[Any]:
    """The words of a command on a run; what it makes goes elsewhere."""
    word, *picture = command.split()
    folder = [] if word in ("simulate", "view") else ["--out", pictures / f"{command}.png"]
    return [word, run, *picture, *folder, *(["--no-browser"] if word == "view" else [])]


@contextmanager
def brief(used: dict) -> Iterator[None]:
    """`used` keeps the shares of limits that designs use, which are the same in all runs."""

    def begin(design: Design, *_: Any, **__: Any) -> None:
        np.testing.assert_allclose(design.body.control_points(), START.control_points())
        assert design.pressures == {"extend": {"A": 0.06}}
        raise ComputationError(BEGUN)

    def serve(server: Any) -> None:
        server.close()
        for each in server.runs:
            each._known = used
            if each.stamp() is not None:
                each.block()
                each.sweep(1)
        raise ComputationError(BEGUN)

    def draw(*_: Any) -> None:
        raise ComputationError(BEGUN)

    instead = [
        (Design, "prepare_simulation", begin),
        (Design, "make", begin),
        (view.Server, "serve_until_interrupted", serve),
        (live, "READINGS", 1),
        (render, "images", draw),
        (pictures, "saved", draw),
        (pictures, "saved_gif", draw),
    ]
    with ExitStack() as stack:
        for owner, name, other in instead:
            stack.enter_context(mock.patch.object(owner, name, other))
        yield
