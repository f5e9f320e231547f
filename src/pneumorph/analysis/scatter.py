"""What moves when a workshop's rubber, pressures, walls and cores are not as designed: exact first derivatives.

Every cause of scatter is a motion V of the mesh's nodes per unit (walls, cores, the size of the whole), or a factor of
a load or of the moduli of a rubber. With the adjoint w of a component m of the tip's motion,

    dm/dδ = (∂m/∂X − ∂(wᵀR)/∂X)·V,   dm/dln p = −p ∂(wᵀR)/∂p,   dm/dln s = −wᵀR_s,

where R_s are the forces of the rubber whose moduli are multiplied by s. Nothing is solved again but w.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np

from pneumorph.analysis.near import Solved
from pneumorph.analysis.surface_motions import core_shift, core_tilt, growth, offset
from pneumorph.doing import doing
from pneumorph.mechanics import Configuration
from pneumorph.mechanics.elements.reinforcement import Fibres, Membrane
from pneumorph.mesh import Morph
from pneumorph.mesh.tets import chambers_of
from pneumorph.results import Cause, Scatter
from pneumorph.sensitivity import MotionSlopes, by_known, motion_slopes


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of what a workshop cannot repeat exactly; each cause varies by itself.

    Attributes
    ----------
    rubber : float
        Of the moduli of every rubber, relative. Batches of a silicone, and laboratories that test it, differ by 10 to
        30 %.
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
    """

    rubber: float = 0.1
    pressure: float = 0.001
    wall: float = 0.1
    shift: float = 0.2
    tilt: float = 0.0035
    scale: float = 0.003
    load: float = 0.05


UNITS = {"mm": 1.0, "°": float(np.radians(1.0)), "kPa": 1e-3, "%": 0.01}
"""One of each unit in those of the code."""


class ShapeCause(NamedTuple):
    """A cause that moves nodes: by (n_surface, 3), with which the others go, or all (N, 3), per unit of the code."""

    name: str
    unit: str
    tolerance: float
    motion: np.ndarray


def scatter_of(whole: Solved, tolerances: Tolerances) -> dict[str, Scatter]:
    """How every cause of scatter moves the tip in every task, by one adjoint for each of its six motions.

    Parameters
    ----------
    whole : the whole body with its states: what varies is not symmetric.
    tolerances : what varies, and by how much.
    """
    disc, analysis = whole.disc, whole.analysis
    shapes = list(shape_causes(disc.morph, analysis.X, tolerances))
    scatters = {}
    for name, at in analysis.configurations.items():
        with doing(f"task {name}: derivatives of the tip's motion"):
            slopes = motion_slopes(at, disc.tangents[name], analysis.equilibria[name].state)
            on_surface = np.array([disc.morph.on_surface(by_X) for by_X in slopes.X])
        causes = [*_of_rubbers(slopes, tolerances), *_of_loads(at, slopes, tolerances)]
        for each in shapes:
            by_nodes = slopes.X if len(each.motion) == len(analysis.X) else on_surface
            causes.append(_cause(*each[:3], np.tensordot(by_nodes, each.motion, axes=2)))
        scatters[name] = Scatter(tuple(map(float, slopes.motion)), tuple(causes))
    return scatters


def shape_causes(morph: Morph, X: np.ndarray, tolerances: Tolerances) -> Iterator[ShapeCause]:
    """The causes that move nodes, in the order in which they are reported.

    Parameters
    ----------
    morph, X : the mesh of the whole body and where its nodes are (N, 3), mm.
    tolerances : of every cause.
    """
    mesh, count = morph.mesh.at(X), morph.n_surface
    chambers = {face: names[0] for face in mesh.faces if (names := chambers_of(face))}
    for face, where in {
        "exterior": "the exterior",
        **{face: f"chamber {name}" for face, name in chambers.items()},
    }.items():
        yield ShapeCause(f"rubber at {where}", "mm", tolerances.wall, offset(mesh, face)[:count])
    for face, name in chambers.items():
        for axis, motion in zip("xyz", core_shift(mesh, face)[:, :count], strict=True):
            yield ShapeCause(f"core {name} along {axis}", "mm", tolerances.shift, motion)
        for axis, motion in zip("xy", core_tilt(mesh, face)[:, :count], strict=True):
            yield ShapeCause(f"core {name} about {axis}", "°", tolerances.tilt, motion)
    yield ShapeCause("size of the body", "%", tolerances.scale, growth(mesh))


def _of_rubbers(slopes: MotionSlopes, tolerances: Tolerances) -> Iterator[Cause]:
    for region, by in slopes.moduli.items():
        yield _cause(f"modulus of {region}" if region else "modulus of the rubber", "%", tolerances.rubber, by)


def _of_loads(at: Configuration, slopes: MotionSlopes, tolerances: Tolerances) -> Iterator[Cause]:
    """The causes that are loads; a load that is zero, or that is found with the state, is none."""
    model, by_load = at.model, slopes.loads
    pressures = np.array([by_known(at, loads.pressure) for loads in by_load])
    for number, chamber in enumerate(model.chambers):
        if pressures[:, number].any():
            yield _cause(f"pressure of {chamber}", "kPa", tolerances.pressure, pressures[:, number])
    for part, name in {"acceleration": "weight", "spring": "springs", "wrench": "force and torque"}.items():
        load = np.asarray(getattr(at.loads, part))
        if load.any():
            by = np.array([getattr(loads, part) @ load for loads in by_load])
            yield _cause(name, "%", tolerances.load, by)
    for number, (name, sheet) in enumerate(model.reinforcements.items()):
        by = np.array([loads.reinforcement[number, 0] for loads in by_load])
        stiffness = float(cast(Membrane | Fibres, sheet).stiffness) + float(at.loads.reinforcement[number, 0])
        yield _cause(f"stiffness of {name}", "%", tolerances.load, stiffness * by)


def _cause(name: str, unit: str, tolerance: float, by: np.ndarray) -> Cause:
    """A cause in its unit, from its standard deviation and derivatives (6,) in those of the code."""
    return Cause(name, unit, tolerance / UNITS[unit], tuple(map(float, UNITS[unit] * by)))
