"""What moves when a workshop's rubber, pressures, walls and cores are not as designed: exact first derivatives.

Every cause of scatter is a motion V of the mesh's nodes per unit (walls, cores, the size of the whole), or a factor of
a load or of the moduli of a rubber. With the adjoint w of a component m of the tip's motion,

    dm/dδ = (∂m/∂X − ∂(wᵀR)/∂X)·V,   dm/dln p = −p ∂(wᵀR)/∂p,   dm/dln s = −wᵀR_s,

where R_s are the forces of the rubber whose moduli are multiplied by s. Nothing is solved again but w.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, cast

import numpy as np

from pneumorph.analysis.near import Solved
from pneumorph.analysis.surface_motions import core_shift, core_tilt, growth, offset
from pneumorph.doing import doing
from pneumorph.mechanics import Configuration, Equilibrium, predict, solve, sweep
from pneumorph.mechanics.elements.reinforcement import Fibres, Membrane
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mesh import Morph
from pneumorph.mesh.tets import chambers_of
from pneumorph.objective import measure_features
from pneumorph.results import Cause, Scatter
from pneumorph.sensitivity import MotionSlopes, by_known, motion_slopes


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
    tilt: float = 0.0035
    scale: float = 0.003
    load: float = 0.05
    rubbers: Mapping[str, float] = field(default_factory=dict)
    histories: Mapping[str, float] = field(default_factory=dict)


UNITS = {"mm": 1.0, "°": float(np.radians(1.0)), "kPa": 1e-3, "%": 0.01}
"""One of each unit in those of the code."""


LOADS = {"acceleration": "weight", "spring": "springs", "wrench": "force and torque"}
"""What the loads of a body are called that vary by a factor."""

MOST_FACTORISATIONS = 60
"""Most for the state of one casting."""


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


@dataclass(frozen=True)
class OneDeviation:
    """A motion (mm, rad) where causes together change it most likely by one deviation, up and down; None: no state."""

    up: float | None
    down: float | None


def one_deviation(
    whole: Solved, task: str, scatter: Scatter, motion: int, tolerances: Tolerances
) -> OneDeviation | None:
    """Solve the castings that are most likely to be off by one standard deviation of a motion, to see its curvature.

    Of all changes δ that move it by that much to first order, that with the smallest sum of (δ/σ)² has δ = σ² ∂m/∂δ
    over the deviation. None where forces do not scale with the rubber's: with contact, sheets, fibres, gas or liquid,
    or several rubbers.

    Parameters
    ----------
    whole : the whole body with its states.
    task : name of the task.
    scatter : its scatter.
    motion : number of the motion among the six.
    tolerances : those of the scatter.
    """
    at, disc = whole.analysis.configurations[task], whole.disc
    deviation = float(scatter.deviations[motion])
    if not _scales(at) or not deviation:
        return None
    changes = {
        cause.name: UNITS[cause.unit] * cause.tolerance**2 * cause.by[motion] / deviation for cause in scatter.causes
    }
    X = sum(
        (
            changes[each.name] * (each.motion if len(each.motion) == len(at.X) else disc.morph.extend(each.motion))
            for each in shape_causes(disc.morph, at.X, tolerances)
        ),
        np.zeros_like(at.X),
    )
    return OneDeviation(*(_solved(whole, task, at.X + way * X, changes, way, motion) for way in (1.0, -1.0)))


def with_moduli(whole: Solved, task: str, factors: Sequence[float]) -> list[np.ndarray | None] | None:
    """The six motions of the tip (mm, rad) with all moduli times each of rising factors; None without a stable state.

    A body of a rubber s times as stiff moves as this one under loads divided by s. None in place of the list where
    forces do not scale with the rubber's, as for `one_deviation`.

    Parameters
    ----------
    whole : the whole body with its states.
    task : name of the task.
    factors : rising.
    """
    at, disc = whole.analysis.configurations[task], whole.disc
    if not _scales(at):
        return None
    path = [replace(at, loads=_times(at.loads, 1.0 / factor)) for factor in reversed(factors)]
    motions: list[np.ndarray | None] = []
    for there, answer in zip(path, sweep(path, disc.tangents[task]), strict=True):
        if isinstance(answer, Equilibrium) and answer.stable:
            moved = measure_features(at.model, there.X, answer.state)
            motions.append(np.concatenate([moved.translation, moved.rotation]))
        else:
            motions.append(None)
    return motions[::-1]


def _scales(at: Configuration) -> bool:
    """Whether all forces but the loads are those of one rubber."""
    model = at.model
    return not (model.contact is not None or model.reinforcements or at.enclosed or len(model.rubbers) > 1)


def _times(loads: Loads, factor: float) -> Loads:
    return loads._replace(
        pressure=factor * np.asarray(loads.pressure),
        **{part: factor * np.asarray(getattr(loads, part)) for part in LOADS},
    )


def _solved(
    whole: Solved, task: str, X: np.ndarray, changes: Mapping[str, float], way: float, motion: int
) -> float | None:
    """A motion where nodes are at X and loads are changed, `way` times."""
    at, state, tangent = (
        whole.analysis.configurations[task],
        whole.analysis.equilibria[task].state,
        whole.disc.tangents[task],
    )
    stiffer = changes["modulus of the rubber"] + changes.get("creep, cycles of the rubber", 0.0)
    softer = 1.0 / (1.0 + way * stiffer)
    more = np.array([changes.get(f"pressure of {chamber}", 0.0) for chamber in at.model.chambers])
    scaled = {
        part: softer * (1.0 + way * changes.get(name, 0.0)) * np.asarray(getattr(at.loads, part))
        for part, name in LOADS.items()
    }
    loads = at.loads._replace(pressure=softer * (np.asarray(at.loads.pressure) + way * more), **scaled)
    there = replace(at, X=X, loads=loads)
    tangent.move_to(at, state)
    start = predict(at, tangent, state, X - at.X, loads)
    answer = solve(there, tangent, start, since=(at, state), most=MOST_FACTORISATIONS)
    if not isinstance(answer, Equilibrium) or not answer.stable:
        return None
    moved = measure_features(at.model, X, answer.state)
    return float(np.concatenate([moved.translation, moved.rotation])[motion])


def _of_rubbers(slopes: MotionSlopes, tolerances: Tolerances) -> Iterator[Cause]:
    for region, by in slopes.moduli.items():
        name = region or "the rubber"
        yield _cause(f"modulus of {name}", "%", tolerances.rubbers.get(region, tolerances.rubber), by)
        if history := tolerances.histories.get(region):
            yield _cause(f"creep, cycles of {name}", "%", history, by)


def _of_loads(at: Configuration, slopes: MotionSlopes, tolerances: Tolerances) -> Iterator[Cause]:
    """The causes that are loads; a load that is zero, or that is found with the state, is none."""
    model, by_load = at.model, slopes.loads
    pressures = np.array([by_known(at, loads.pressure) for loads in by_load])
    for number, chamber in enumerate(model.chambers):
        if pressures[:, number].any():
            yield _cause(f"pressure of {chamber}", "kPa", tolerances.pressure, pressures[:, number])
    for part, name in LOADS.items():
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
