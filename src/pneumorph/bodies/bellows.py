"""A closed bellows."""

from __future__ import annotations

import math
from typing import Any

from pneumorph.bodies.parts import Part
from pneumorph.bodies.start import LARGEST, LEAST, Start, between, count_of, sizes_of, text_with


def bellows(
    radius: Any = "15 mm",
    neck: Any = "11 mm",
    pitch: Any = "10 mm",
    folds: int = 4,
    wall: Any = "2 mm",
    floor: Any = "4 mm",
) -> Start:
    """A closed bellows along z: inflated it extends, under vacuum it contracts.

    It is cast in two halves, which are bonded, or about a core of wax.

    Parameters
    ----------
    radius : length with unit
        Of the outside, at the crests of the folds.
    neck : length with unit
        Of the outside, between folds.
    pitch : length with unit
        Height of a fold.
    folds : int
        Their number.
    wall : length with unit
        Thickness of the folds.
    floor : length with unit
        Thickness of both ends.

    Returns
    -------
    Start
        Whose `write` writes problem and STEP file.

    Raises
    ------
    ProblemError
        If a size is no length, or leaves no room for others; its message begins with the name of the size.

    Examples
    --------
    >>> path = pm.bodies.bellows(folds=3).write("bellows")
    >>> round(pm.load(path).body.length, 9)
    38.0
    """
    sizes = sizes_of(radius=radius, neck=neck, pitch=pitch, wall=wall, floor=floor)
    crest, throat, high, thick, end = sizes.values()
    number = count_of("folds", folds)
    between("radius", crest, throat, LARGEST, "not below neck")
    # The chamber's wall is the outside moved inwards, so it is as much farther from it along the radius as that slopes.
    slope = 2.0 * (crest - throat) / high
    inwards = thick * math.hypot(1.0, slope)
    most = (throat - 1.0) / math.hypot(1.0, slope)
    between("wall", thick, LEAST, most, "so that the chamber has a radius of 1 mm in the necks")
    between("floor", end, LEAST, LARGEST)
    between("pitch", high, 2.0 * thick, LARGEST, "not below two walls")
    levels = [end + 0.5 * high * step for step in range(2 * number + 1)]
    radii = [crest if step % 2 else throat for step in range(2 * number + 1)]
    top = levels[-1] + end
    outside = [(0.0, 0.0), (throat, 0.0), *zip(radii, levels, strict=True), (throat, top), (0.0, top)]
    within = [(radius - inwards, level) for radius, level in zip(radii, levels, strict=True)]
    void = [(0.0, levels[0]), *within, (0.0, levels[-1])]
    parts = tuple(
        Part(added, "turned", tuple(value for corner in corners for value in corner))
        for added, corners in ((True, outside), (False, void))
    )
    text = text_with(
        "bellows",
        {"far": 1.05 * crest, "least": 0.75 * min(thick, end), "size": max(1.5 * thick, 1.5)}
        | {"fold": 0.5 * min(thick, 0.5 * high), "near": min(2.0 * thick, high), "spacing": max(0.5 * high, 2.0)},
        {"height": top},
    )
    return Start(text, parts)
