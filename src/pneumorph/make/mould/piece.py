"""One part of a mould, or of what holds the finished body."""

# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from OCP.TopoDS import TopoDS_Shape

Role = Literal["mould", "core", "product", "mount", "master", "negative", "part"]


@dataclass(frozen=True, eq=False)
class Piece:
    """One part: a solid with a name.

    Attributes
    ----------
    name : str
    role : "mould", "core", "product", "mount", "master", "negative" or "part"
        Parts of the mould, cores that are cast in, the rubber part itself, and what holds it in use. For silicone
        moulds also masters, the negatives cast around them, and the parts of rubber that are glued together.
    shape : TopoDS_Shape
        At its place in the mould; parts of the mount are placed about the finished body.
    """

    name: str
    role: Role
    shape: TopoDS_Shape
