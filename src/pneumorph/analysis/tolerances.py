"""What varies from casting to casting: the causes with their tolerances, and castings in which they are changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import radians, sqrt
from typing import NamedTuple

import numpy as np

from pneumorph.analysis.surface_motions import core_shift, core_tilt, growth, offset
from pneumorph.mechanics import Configuration
from pneumorph.mesh import Morph
from pneumorph.mesh.tets import chambers_of
from pneumorph.problem import Problem
from pneumorph.problem.materials import materials
from pneumorph.problem.sources import deviation_of
from pneumorph.problem.sources import history_of as history_in


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of what a workshop cannot repeat exactly; each cause varies by itself.

    Attributes
    ----------
    rubber : float
        Of the moduli of every rubber, relative, where `rubbers` has none.
    pressure : float
        Of every chamber's pressure, MPa.
    wall : float
        Of the rubber's thickness at every surface, mm: the whole surface is moved along its normals.
    shift : float
        Of the place of every chamber along each axis, mm: of the core that leaves it.
    tilt : float
        Of every chamber about x and y, rad, where its core is held: at its end towards the base.
    scale : float
        Of the size of the whole body, relative: of a print, or of silicone that shrinks.
    load : float
        Of weight, springs and loads of the plate, and of the stiffness of sheets and fibres, relative.
    rubbers : {region: float}
        Of the moduli of single regions' rubbers, relative.
    histories : {region: float}
        Of the same by loading, unloading and time, relative, where they are known.
    """

    rubber: float = 0.1
    pressure: float = 0.001
    wall: float = 0.1
    shift: float = 0.2
    tilt: float = radians(0.2)
    scale: float = 0.003
    load: float = 0.05
    rubbers: Mapping[str, float] = field(default_factory=dict)
    histories: Mapping[str, float] = field(default_factory=dict)


def of_sources(tolerances: Tolerances, problem: Problem, rubbers: bool = True) -> Tolerances:
    """Tolerances with what is known of the rubbers of a problem: their creep, cycles, and scatter of moduli.

    Parameters
    ----------
    tolerances : of all else.
    problem : whose rubbers are meant.
    rubbers : whether the moduli too; else they have the deviation `tolerances.rubber`.
    """
    known = materials(problem)
    regions = {name if len(known) > 1 else "": material for name, material in known.items()}
    histories = {name: history.deviation for name, each in regions.items() if (history := history_in(each)) is not None}
    moduli = {name: part for name, each in regions.items() if (part := deviation_of(each)) is not None}
    return replace(tolerances, histories=histories, rubbers=moduli if rubbers else {})


UNITS = {"mm": 1.0, "°": float(np.radians(1.0)), "kPa": 1e-3, "%": 0.01, "σ": 1.0}
"""One of each unit in those of the code."""

RUBBER = "the rubber"
"""What the rubber is called where there is only one."""

LOADS = {"acceleration": "weight", "spring": "springs", "wrench": "force and torque"}
"""What the loads of a body are called that vary by a factor."""


def modulus_of(rubber: str) -> str:
    """What the cause is called that is the moduli of a rubber."""
    return f"modulus of {rubber}"


def history_of(rubber: str) -> str:
    """What the cause is called that is loading, unloading and time of a rubber."""
    return f"creep, cycles of {rubber}"


def fit_of(rubber: str, number: int) -> str:
    """What the cause is called that is an error of the fit of a rubber's constants, from number 0 on."""
    return f"fit of {rubber}" + (f", {number + 1}" if number else "")


MODULUS, HISTORY = modulus_of(RUBBER), history_of(RUBBER)


def stiffness_of(reinforcement: str) -> str:
    """What the cause is called that is the stiffness of a sheet or of fibres."""
    return f"stiffness of {reinforcement}"


def pressure_of(chamber: str) -> str:
    """What the cause is called that is the pressure of a chamber."""
    return f"pressure of {chamber}"


class ShapeCause(NamedTuple):
    """A cause that moves nodes: by (n_surface, 3), with which the others go, or all (N, 3), per unit of the code."""

    name: str
    unit: str
    tolerance: float
    motion: np.ndarray

    def everywhere(self, morph: Morph) -> np.ndarray:
        """The motion (N, 3) of all nodes."""
        return self.motion if len(self.motion) == len(morph.reference) else morph.extend(self.motion)


def shape_causes(morph: Morph, X: np.ndarray, tolerances: Tolerances) -> Iterator[ShapeCause]:
    """The causes that move nodes, in the order in which they are reported.

    Of a part of a body, those that keep its symmetry: to first order no other cause changes a symmetric motion. A
    surface may stand for n images there, which vary by themselves: together they do what one does whose deviation is
    smaller by √n.

    Parameters
    ----------
    morph, X : the mesh of the body, or of a part of it, and where its nodes are (N, 3), mm.
    tolerances : of every cause.
    """
    mesh, count = morph.mesh.at(X), morph.n_surface
    chambers = {face: names for face in mesh.faces if (names := chambers_of(face))}
    surfaces = {"exterior": ("the exterior", 1)}
    surfaces |= {face: (f"chamber {names[0]}", len(names)) for face, names in chambers.items()}
    for face, (where, images) in surfaces.items():
        tolerance = tolerances.wall / sqrt(images)
        yield ShapeCause(f"rubber at {where}", "mm", tolerance, offset(mesh, face)[:count])
    for face, names in chambers.items():
        for kind, unit, tolerance, axes, motions in (
            ("along", "mm", tolerances.shift, "xyz", core_shift(mesh, face)),
            ("about", "°", tolerances.tilt, "xy", core_tilt(mesh, face)),
        ):
            for axis, motion in zip(axes, motions[:, :count], strict=True):
                if morph.keeps(motion):
                    name = f"core {names[0]} {kind} {axis}"
                    yield ShapeCause(name, unit, tolerance / sqrt(len(names)), motion)
    yield ShapeCause("size of the body", "%", tolerances.scale, growth(mesh))


def moved_by(morph: Morph, X: np.ndarray, changes: Mapping[str, float]) -> np.ndarray:
    """Motion (N, 3) of nodes by the changes of all causes that move them.

    Parameters
    ----------
    morph, X : see `shape_causes`.
    changes : of causes by their names, in the units of the code.
    """
    causes = shape_causes(morph, X, Tolerances())
    moving = (changes[each.name] * each.everywhere(morph) for each in causes if changes.get(each.name))
    return sum(moving, np.zeros_like(X))


def scales(at: Configuration) -> bool:
    """Whether `as_cast` has castings of any modulus: not with contact, sealed or filled chambers, or two rubbers."""
    model = at.model
    return not (model.contact is not None or at.enclosed or len(model.rubbers) > 1)


def stiffer(changes: Mapping[str, float]) -> float:
    """The factor of all moduli of a casting in which causes have changed."""
    return 1.0 + changes.get(MODULUS, 0.0) + changes.get(HISTORY, 0.0)


def as_cast(at: Configuration, motion: np.ndarray | None, changes: Mapping[str, float]) -> Configuration:
    """A casting in which nodes have moved and causes have changed.

    Rubber that is stiffer by a factor moves as the rubber itself does under all loads over that factor, with sheets and
    fibres whose stiffness is divided by it too; it exerts that factor times the forces. Several rubbers are stiffer by
    the same factor, and contact is too, which hardly matters; with sealed gas or filled liquid it is not so.

    Parameters
    ----------
    at : of the body as it is designed.
    motion : (N, 3) mm, of all causes that move nodes; None if none has changed.
    changes : of all other causes by their names, in the units of the code; missing ones are 0.
    """
    loads, softer = at.loads, 1.0 / stiffer(changes)
    more = np.array([changes.get(pressure_of(chamber), 0.0) for chamber in at.model.chambers])
    scaled = {
        part: softer * (1.0 + changes.get(name, 0.0)) * np.asarray(getattr(loads, part)) for part, name in LOADS.items()
    }
    reinforcement = np.array(loads.reinforcement, dtype=float)
    for row, (name, each) in zip(reinforcement, at.model.reinforcements.items(), strict=True):
        own = float(each.stiffness)
        row[0] = softer * (1.0 + changes.get(stiffness_of(name), 0.0)) * (own + row[0]) - own
    pressure = softer * (np.asarray(loads.pressure) + more)
    changed = loads._replace(pressure=pressure, reinforcement=reinforcement, **scaled)
    return replace(at, X=at.X if motion is None else at.X + motion, loads=changed)
