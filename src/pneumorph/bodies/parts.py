"""Bodies put together from simple ones, and their files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from pneumorph.cad.netgen_process import call


class Part(NamedTuple):
    """What is added to a body or cut out of it.

    Attributes
    ----------
    added : bool
    kind : "box", with two opposite corners; "cylinder" along z, with the centre of its lower end, radius and height;
        "ball", with centre and radius; or "turned" about z, with the radius and z of every corner of half its section
    numbers : tuple of float
        mm.
    turn : float
        Rotation about z, degrees.
    """

    added: bool
    kind: str
    numbers: tuple[float, ...]
    turn: float = 0.0


def write_parts(parts: Sequence[Part], path: Path) -> None:
    """Write a body as a STEP file, or by its suffix as a BREP file.

    Raises
    ------
    ComputationError
        If it cannot be made or written.
    """
    # The process may have been started in another folder.
    call("compose", [tuple(part) for part in parts], str(path.absolute()), seconds=60.0)
