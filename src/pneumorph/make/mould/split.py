"""Splitting pieces that are larger than the printer: by planes across the axis, with spherical keys on each plane."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
from numpy.typing import NDArray
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
from OCP.TopoDS import TopoDS_Shape

from pneumorph.errors import ComputationError
from pneumorph.make.mould.piece import Piece
from pneumorph.make.mould.plan import Plan
from pneumorph.make.mould.shapes import common, cut, cylinder, fuse, point

Array = NDArray[np.float64]
Keys = Callable[[float], Sequence[tuple[Array, float]]]
"""Places (x, y) of the keys on the plane at a height, and their radii in the plane."""

KEY = 0.32
"""Height of a key relative to its radius in the plane: steep enough to centre, and it leaves without force."""

_LEAST = 0.6  # mm, least radius of a key
_STEP = 0.25  # mm
_UP = np.array([0.0, 0.0, 1.0])


def split(piece: Piece, plan: Plan, taken: Sequence[tuple[float, float]], keys: Keys) -> list[Piece]:
    """The piece alone if it fits the printer, otherwise its parts from base to tip, numbered.

    Parameters
    ----------
    taken : sequence of (height, distance)
        Heights at which no plane may be, with the distance to keep from them, mm.
    keys : callable
        Where there is room for keys on a plane.

    Raises
    ------
    ComputationError
        If it is too wide, or there is no place for a plane.
    """
    low, high = bounds(piece.shape)
    printer, size = plan.spec.printer.volume, high - low
    room = _room(size[:2], printer)
    if _room(size[:2], printer, size[2]) is not None:
        return [piece]
    told = f"{piece.name} is {size[0]:.0f} x {size[1]:.0f} x {size[2]:.0f} mm, too large for make.printer.volume"
    if room is None:
        raise ComputationError(f"{told}, and it is split across the axis only; take a larger printer")
    heights = _planes(float(low[2]), float(high[2]), room, taken, keys)
    if heights is None:
        raise ComputationError(f"{told}, and wherever it could be split there is a stem, a vent or a slot")
    parts, gap = [], plan.spec.clearance
    for number, (start, stop) in enumerate(pairwise([low[2] - 1.0, *heights, high[2] + 1.0]), start=1):
        far = 2.0 * float(np.abs([low, high]).max()) + 10.0
        shape = common(piece.shape, cylinder((0, 0, start), (0, 0, 1), far, stop - start))
        # Keys stand on the lower part.
        if number <= len(heights):
            shape = fuse(shape, [cap(np.array([*place, stop]), _UP, radius, 0.0) for place, radius in keys(stop)])
        if number > 1:
            shape = cut(shape, [cap(np.array([*place, start]), _UP, radius, gap) for place, radius in keys(start)])
        parts.append(replace(piece, name=f"{piece.name}-{number}", shape=shape))
    return parts


def _room(across: Array, printer: Sequence[float], tall: float = 0.0) -> float | None:
    """Largest height of a piece that needs this much room across and is at least so tall; None if there is none."""
    fits = [c for a, b, c in permutations(printer) if across[0] <= a and across[1] <= b and tall <= c]
    return max(fits, default=None)


def _planes(
    low: float, high: float, room: float, taken: Sequence[tuple[float, float]], keys: Keys
) -> list[float] | None:
    """Heights of the fewest planes, as evenly as possible; None if there is no room for them."""
    options = [
        float(height)
        for height in np.arange(low + 2.0, high - 2.0, _STEP)
        if all(abs(height - each) > away for each, away in taken) and len(keys(float(height)))
    ]
    tallest = room - 2.0  # keys stand out
    for count in range(1, int((high - low) / 4.0)):
        chosen = []
        for number in range(1, count + 1):
            even = low + (high - low) * number / (count + 1)
            chosen.append(min(options, key=lambda height: abs(height - even), default=low))
        steps = np.diff([low, *chosen, high])
        if steps.max() <= tallest and steps.min() > 2.0:
            return chosen
    return None


def cap(place: Array, direction: Array, radius: float, gap: float) -> TopoDS_Shape:
    """A key: the cap of a sphere on a parting plane.

    It begins below the plane: faces that only touch are the hard case of a union.

    Parameters
    ----------
    place : (3,) array
        On the parting plane, mm.
    direction : (3,) array
        In which it stands out, a unit vector.
    radius : float
        Of its rim, mm.
    gap : float
        By which it is larger, mm: for the recess.
    """
    ball = radius * (1.0 + KEY**2) / (2.0 * KEY)
    sphere = BRepPrimAPI_MakeSphere(point(place + (KEY * radius - ball) * direction), ball + gap).Shape()
    return common(sphere, cylinder(place - 0.3 * direction, direction, 2.0 * ball, 2.0 * ball))


def room_for_key(radius: float, largest: float) -> float | None:
    """Radius of a key where there is a circle of a radius; None if it would be too small."""
    key = min(0.6 * radius, largest)
    return key if key >= _LEAST else None


def bounds(shape: TopoDS_Shape) -> tuple[Array, Array]:
    """Corners of the box around a shape."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    low, high = box.CornerMin(), box.CornerMax()
    return np.array([low.X(), low.Y(), low.Z()]), np.array([high.X(), high.Y(), high.Z()])
