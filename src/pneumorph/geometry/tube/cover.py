"""Parts of surfaces on which something thin lies, by their parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem.reinforcement import EXTERIOR

if TYPE_CHECKING:
    from pneumorph.problem import BodySpec
    from pneumorph.problem.reinforcement import Reinforcement


@dataclass(frozen=True)
class Cover:
    """A part of a surface, a rectangle in its parameters.

    Attributes
    ----------
    name : str
        What lies on it.
    surface : str
        "exterior" or the chamber's name.
    r : (float, float)
        From where to where along the surface.
    q : (float, float) or None
        From where, in [0, 1), to where around it, which may pass q = 1; None for all of it.
    """

    name: str
    surface: str
    r: tuple[float, float] = (0.0, 1.0)
    q: tuple[float, float] | None = None


def build_covers(spec: BodySpec, reinforcements: Iterable[Reinforcement]) -> tuple[Cover, ...]:
    """The covers of the reinforcements of a problem; one on several surfaces has as many."""
    # Parameters are those along a straight axis.
    start, covers = starting_body(spec.straight), []
    surfaces = {surface.name: surface for surface in start.surfaces}
    sections = {EXTERIOR: spec.section} | {chamber.name: chamber.section for chamber in spec.chamber}
    for each in reinforcements:
        for name in each.surfaces:
            surface, r, q = surfaces[name], (0.0, 1.0), None
            if each.span is not None:
                at = np.linspace(0.0, 1.0, 64 * surface.basis_r.spans + 1)
                z = surface.basis_r.matrix(at) @ surface.net[:, 0, 2]
                low, high = (float(np.interp(end, z, at)) for end in each.span)
                r = (low, high)
            if each.angles is not None:
                first, last = (angle / (2.0 * math.pi) for angle in each.angles)
                section = sections[name]
                if section is not None:
                    first, last = map(section.outline.share_at, each.angles)
                    last += last <= first
                # q runs the other way around a chamber.
                first, last = (-last, -first) if surface.cavity else (first, last)
                q = (first - math.floor(first), last - math.floor(first))
            covers.append(Cover(each.name, name, r, q))
    return tuple(covers)
