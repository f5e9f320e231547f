"""Several chambers: around the axis, or one after another along it."""

from __future__ import annotations

import numpy as np

from pneumorph.proposals.layouts.layout import (
    MARGIN,
    MIRRORS,
    ON_AXIS,
    Drawn,
    Draws,
    Layout,
    NoRoom,
    chamber,
    fitting,
    letters,
    mm,
    tube,
)
from pneumorph.proposals.layouts.layout import span as whole_span
from pneumorph.proposals.layouts.single import MIRRORED, one_way
from pneumorph.proposals.target import Target


def _around(count: int) -> Layout:
    def unsuited(target: Target) -> str:
        if target.said and target.motions == {"twist"}:
            return MIRRORED
        if len(target.task) == 1 and target.said and target.motions <= {"extension"}:
            return "a single chamber extends a body as far, and is easier to make"
        if count == 2 and len({tuple(np.round(np.abs(each), 6)) for each in target.directions}) > 1:
            return "two chambers bend a body in one plane, and tasks ask for several"
        return ""

    def draw(target: Target, draws: Draws) -> Drawn:
        body, radius = tube(target, draws, least=0.7)
        inner, away, around = _spread(target, draws, radius, count)
        places = dict(zip(letters(count), around, strict=True))
        along = whole_span(target)
        body["chamber"] = [chamber(name, inner, away * place, along) for name, place in places.items()]
        several = len(target.task) > 1 and len(target.directions) != 1
        symmetries = (*(({"rotation": count},) if several else ()), *(MIRRORS if count % 2 == 0 else MIRRORS[1:]))
        words = f"radius {radius:.3g} mm, {count} chambers of {inner:.3g} mm"
        return Drawn({"body": body}, places, symmetries, radius, words + (", rings" if "ripple" in body else ""))

    numbers = {2: "two", 3: "three", 4: "four"}
    return Layout(f"around{count}", f"{numbers[count]} chambers around the axis", unsuited, draw)


def _spread(target: Target, draws: Draws, radius: float, count: int) -> tuple[float, float, np.ndarray]:
    """Chambers around the axis: their radius, how far they are from it, and where, as unit vectors (count, 2).

    Raises
    ------
    NoRoom
        If the walls leave them less than a quarter of a wall.
    """
    wall, half = MARGIN * target.limits.wall, np.sin(np.pi / count)
    # The largest circles around the axis that have a wall between each other and to the outside.
    largest = ((radius - wall) * half - 0.5 * wall) / (1.0 + half)
    if largest < 0.25 * wall:
        raise NoRoom(f"{count} chambers with walls of {target.limits.wall:g} mm do not fit into {radius:.3g} mm")
    inner = draws.between(0.75, 1.0) * largest
    first = target.directions[0] if target.directions else np.array([1.0, 0.0])
    angles = np.arctan2(-first[1], -first[0]) + 2.0 * np.pi * np.arange(count) / count
    return inner, radius - wall - inner, np.column_stack([np.cos(angles), np.sin(angles)])


def _parts(target: Target, count: int, least: float) -> list[list[str]]:
    """Where so many chambers one after another begin and end.

    Raises
    ------
    NoRoom
        If each would be shorter than `least` (mm).
    """
    wall, length = 1.5 * target.limits.wall, target.space.length
    each = (length - (count + 1) * wall) / count
    if each < least:
        raise NoRoom(f"{count} chambers one after another are shorter than wide in {length:g} mm")
    starts = [wall + number * (each + wall) for number in range(count)]
    return [[mm(start), mm(start + each)] for start in starts]


def _unsuited_along(target: Target) -> str:
    if target.said and target.motions == {"twist"}:
        return MIRRORED
    if target.said and len(target.task) == 1:
        return "chambers one after another at one pressure act as a single one, which is easier to make"
    return one_way(target)


def _draw_along(target: Target, draws: Draws) -> Drawn:
    count = draws.one_of((2, 3))
    body, radius = tube(target, draws)
    inner = fitting(target, radius, draws.between(0.45, 0.75) * radius)
    parts = zip(letters(count), _parts(target, count, inner), strict=True)
    body["chamber"] = [chamber(name, inner, ON_AXIS, part) for name, part in parts]
    words = f"radius {radius:.3g} mm, {count} chambers of {inner:.3g} mm along the axis"
    return Drawn({"body": body}, dict.fromkeys(letters(count), ON_AXIS), MIRRORS, radius, words)


def _unsuited_segments(target: Target) -> str:
    if target.said:
        return "a row of chambers around the axis moves the tip as far; several in a row are for curves and poses"
    return ""


def _draw_segments(target: Target, draws: Draws) -> Drawn:
    count, rows = draws.one_of((2, 3)), 2
    body, radius = tube(target, draws, least=0.7)
    inner, away, around = _spread(target, draws, radius, count)
    names, parts = letters(count * rows), _parts(target, rows, 2.0 * inner)
    places = dict(zip(names, np.tile(around, (rows, 1)), strict=True))
    spans = [part for part in parts for _ in range(count)]
    body["chamber"] = [
        chamber(name, inner, away * place, part) for (name, place), part in zip(places.items(), spans, strict=True)
    ]
    words = f"radius {radius:.3g} mm, {rows} rows of {count} chambers of {inner:.3g} mm"
    symmetries = MIRRORS if count % 2 == 0 else MIRRORS[1:]
    return Drawn({"body": body}, places, symmetries, radius, words + (", rings" if "ripple" in body else ""))


AROUND = tuple(_around(count) for count in (2, 3, 4))
ALONG = Layout("along", "chambers one after another along the axis", _unsuited_along, _draw_along)
SEGMENTS = Layout("segments", "two rows of chambers around the axis", _unsuited_segments, _draw_segments)
