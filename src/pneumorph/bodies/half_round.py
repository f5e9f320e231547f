"""Half a disc along z with a sheet on its flat side (the fibre-reinforced bending actuator)."""

from __future__ import annotations

from typing import Any

from pneumorph.bodies.start import LARGEST, LEAST, Start, between, sizes_of, text_with
from pneumorph.problem.section import HalfRound


def half_round(length: Any = "60 mm", radius: Any = "12 mm", wall: Any = "3 mm", corner: Any = "2.5 mm") -> Start:
    """A tube of half-round section with cloth on its flat side (Polygerinos et al. 2015): it bends towards the cloth.

    It is a tube and has no CAD file: its section is a table of the problem. It is cast about a half-round core.

    Parameters
    ----------
    length : length with unit
        Along z.
    radius : length with unit
        Of the round side.
    wall : length with unit
        Thickness.
    corner : length with unit
        Radius of the two edges along z.

    Returns
    -------
    Start
        Whose `write` writes the problem file.

    Raises
    ------
    ProblemError
        If a size is no length, or leaves no room for others; its message begins with the name of the size.

    Examples
    --------
    >>> path = pm.bodies.half_round(length="50 mm").write("half")
    >>> pm.load(path).body.length
    50.0
    """
    sizes = sizes_of(length=length, radius=radius, wall=wall, corner=corner)
    long, outer, thick, rounding = sizes.values()
    between("radius", outer, 5.0, LARGEST)
    between("wall", thick, LEAST, outer / 3.0, "a third of the radius")
    inner = outer - 2.0 * thick
    between("corner", rounding, 1.0, 0.45 * outer, "with the radius")
    between("length", long, 8.0 * thick, LARGEST, "not below eight walls")
    inside = min(rounding, 0.4 * inner)
    # Sections are placed by their centroids; flat walls and round ones are to be as thick.
    x = thick - _flat_side(outer, rounding) + _flat_side(inner, inside)
    chamber = {"inner": inner, "inside": inside, "x": x, "start": 2.0 * thick, "stop": long - 2.0 * thick}
    limits = {"reach": 1.15 * outer, "least": 0.75 * thick, "size": max(1.2 * thick, 2.0), "density": 5.0 / outer}
    return Start(text_with("half_round", sizes | chamber | limits))


def _flat_side(radius: float, corner: float) -> float:
    """Distance of the flat side of half a disc from its centroid, mm."""
    section = HalfRound.model_construct(None, kind="half-round", round_radius=radius, corner=corner, turn=0.0)
    return -float(section.polygon()[:, 0].min())
