"""Rows of chambers on a floor (PneuNets), in one block or each with walls of its own."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.bodies.parts import Part, write_parts
from pneumorph.bodies.rows import Row
from pneumorph.errors import ComputationError
from pneumorph.problem.models import Limits
from pneumorph.problem.solid import SolidSpec
from pneumorph.proposals.layouts.layout import MARGIN, Drawn, Draws, Layout, NoRoom, mm
from pneumorph.proposals.layouts.single import BESIDE, bends_one_way
from pneumorph.proposals.target import Target

TUBES = ("curvature", "skew", "stretch")
"""Limits that bodies from files do not have."""


def _unsuited(target: Target) -> str:
    if reason := bends_one_way(target):
        return reason
    if target.made == "one piece":
        return "it is cast in two layers that are bonded, and made asks for one piece"
    if any(getattr(target.limits, key) != getattr(Limits(), key) for key in TUBES):
        return f"limits.{TUBES[0]}, {TUBES[1]} and {TUBES[2]} are for tubes, which rows on a floor are not"
    if not np.isclose(np.abs(target.directions[0]).max(), 1.0):
        return "a row on a floor is placed to bend along x or y; turn the directions of the tasks"
    return ""


def _row(target: Target, draws: Draws, apart: bool) -> Row:
    """The sizes of a row, with gaps between its chambers or not."""
    [towards] = target.directions
    share, angle = draws.between(0.75, 0.97), draws.between(0.6, 0.95)
    wall, floor = draws.between(1.0, 1.25) * MARGIN * target.limits.wall, draws.between(1.0, 1.8)
    channel, pitch, gap = draws.between(1.4, 2.2), draws.between(0.35, 0.6), draws.between(1.3, 2.0)
    sides = target.space.sides
    if sides is None:
        sides = target.space.round * np.array([np.cos(angle), np.sin(angle)])
    elif abs(towards[0]) < 0.5:
        sides = sides[::-1]
    height, width = (2.0 * share * sides).tolist()
    gap = max(gap, 1.5 * target.limits.fold.distance) if apart else 0.0
    between = gap + 2.0 * wall if apart else wall
    ends = 4.0 * wall + (2.0 * wall if apart else 0.0)
    count = int((target.space.length - ends + between) / (pitch * height + between))
    if count < 2:
        raise NoRoom(f"walls of {target.limits.wall:g} mm leave no row of chambers in {target.space.length:g} mm")
    row = Row(target.space.length, width, height, count, wall, floor * wall, channel, gap, wall)
    row.check()
    return row


def _data(parts: list[Part]) -> dict[str, Any]:
    """The table of a body made of parts, with the contents of its file."""
    with tempfile.TemporaryDirectory() as folder:
        # The same parts have the same bytes in this format, so that a search finds its runs again.
        path = Path(folder) / "row.brep"
        try:
            write_parts(parts, path)
        except ComputationError as error:
            raise NoRoom(str(error)) from None
        return SolidSpec.model_validate({"file": str(path)}).model_dump(mode="json", exclude_unset=True)


def _layout(name: str, words: str, apart: bool) -> Layout:
    def draw(target: Target, draws: Draws) -> Drawn:
        [towards] = target.directions
        row = _row(target, draws, apart)
        turn = (float(np.degrees(np.arctan2(towards[1], towards[0]))) + 180.0) % 360.0
        axis, low = ("x", "y")[int(abs(towards[1]) > 0.5)], row.height / 2.0
        near = min(row.gap or row.channel, row.channel, row.wall)
        tables = {
            "body": _data(row.parts(-low, 0.0, turn)),
            "design": {
                "spacing": mm(max(row.height / 3.0, 4.0)),
                "keep": [{"faces": f"{axis} = {low * float(towards.sum()):.6g} mm"}],
            },
            "limits": {"fold": {"distance": mm(0.5 * near), "neighbourhood": mm(near)}},
        }
        size = f"{row.height:.3g} by {row.width:.3g} mm, {row.chambers} chambers, walls {row.wall:.2g} mm"
        return Drawn(tables, {"A": -towards}, BESIDE, row.height / 2.0, size)

    return Layout(name, words, _unsuited, draw)


ROWS = (
    _layout("pneunet", "a row of chambers in a block on a floor (PneuNet)", False),
    _layout("bellows", "a row of bellows on a floor (fast PneuNet)", True),
)
