"""What moves when a workshop's rubber, pressures, walls and cores are not as designed: exact first derivatives.

Every cause of scatter is a motion V of the mesh's nodes per unit (walls, cores, the size of the whole), or a factor of
a load or of the moduli of a rubber. With the adjoint w of a motion of the tip, a force where it is held, or a volume m,

    dm/dδ = (∂m/∂X − ∂(wᵀR)/∂X)·V,   dm/dln p = −p ∂(wᵀR)/∂p,   dm/dln s = −wᵀR_s,

where R_s are the forces of the rubber whose moduli are multiplied by s. Nothing is solved again but w.

The fit of a rubber leaves errors of its constants that make up for one another. They are other than the scatter of its
moduli: a batch is stiffer or softer by a factor than that which was tested, and the test tells even of that one only so
much. So both add up. Of all ways to write a covariance as independent errors, that is taken in which the first moves
the tip most, then the second among those orthogonal to it, and so on to those that change forces and volumes alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.analysis.accuracy import LEVER
from pneumorph.analysis.constants import Constants, constants_in, forces_by_constants, with_changed
from pneumorph.analysis.near import Solved
from pneumorph.analysis.tolerances import (
    LOADS,
    MODULUS,
    RUBBER,
    UNITS,
    ShapeCause,
    Tolerances,
    as_cast,
    fit_of,
    history_of,
    modulus_of,
    moved_by,
    pressure_of,
    scales,
    shape_causes,
    stiffer,
    stiffness_of,
)
from pneumorph.doing import doing
from pneumorph.mechanics import Configuration, Equilibrium, State, Tangent, predict, solve, sweep
from pneumorph.mesh import Morph
from pneumorph.problem.components import MOTIONS, PUSH, PUSHES, is_turn
from pneumorph.results import Cause, Scatter
from pneumorph.sensitivity import MotionSlopes, by_known, quantities_at, quantities_of, quantity_slopes

MOST_FACTORISATIONS = 60
"""Most for the state of one casting."""

NOTHING = 1e-9
"""Part of the largest effect of an error of a fit below which another one is a rounding error."""

LESS = 1e-3
"""Weight of effects on forces and volumes beside those on motions, of which the first errors are to have most."""


def scatter_of(whole: Solved, tolerances: Tolerances) -> dict[str, Scatter]:
    """What every cause of scatter does in every task to motions, forces and volumes, by one adjoint for each.

    Parameters
    ----------
    whole : the whole body with its states: what varies is not symmetric.
    tolerances : what varies, and by how much.
    """
    disc, analysis = whole.disc, whole.analysis
    shapes = list(shape_causes(disc.morph, analysis.X, tolerances))
    scatters, constants = {}, constants_in(whole.problem)
    for name, at in analysis.configurations.items():
        with doing(f"task {name}: derivatives by what varies"):
            state, tangent = analysis.equilibria[name].state, disc.tangents[name]
            scatters[name] = scatter_at(at, tangent, state, disc.morph, shapes, tolerances, constants)
    return scatters


def scatter_at(
    at: Configuration,
    tangent: Tangent,
    state: State,
    morph: Morph,
    shapes: Sequence[ShapeCause],
    tolerances: Tolerances,
    constants: Mapping[str, Constants],
    quantities: Sequence[str] | None = None,
) -> Scatter:
    """What every cause of scatter does at an equilibrium.

    Parameters
    ----------
    at, tangent, state : the equilibrium, near whose state the tangent was factorised.
    morph : the mesh of the body.
    shapes : the causes that move its nodes.
    tolerances : of the others.
    constants : of the rubbers, by region.
    quantities : to what, by default to all `quantities_of` it.
    """
    names = quantities_of(at) if quantities is None else tuple(quantities)
    slopes = quantity_slopes(at, tangent, state, names)
    on_surface = np.array([morph.on_surface(by_X) for by_X in slopes.X])
    by_constants = {region: -slopes.adjoints @ by.T for region, by in forces_by_constants(at, state, constants).items()}
    causes = [
        *_of_rubbers(slopes, tolerances),
        *_of_fits(by_constants, constants, names),
        *_of_loads(at, slopes, tolerances),
    ]
    for each in shapes:
        by_nodes = slopes.X if len(each.motion) == len(at.X) else on_surface
        causes.append(_cause(*each[:3], np.tensordot(by_nodes, each.motion, axes=2)))
    per_percent = {
        name: tuple(map(float, UNITS["%"] * by))
        for region, of_region in by_constants.items()
        for name, by in zip(constants[region].names, of_region.T, strict=True)
    }
    return Scatter(tuple(map(float, slopes.motion)), tuple(causes), per_percent, names)


@dataclass(frozen=True)
class OneDeviation:
    """A quantity where causes together change it most likely by one deviation, up and down; None: no state."""

    up: float | None
    down: float | None


def one_deviation(whole: Solved, task: str, scatter: Scatter, number: int) -> OneDeviation | None:
    """Solve the castings that are most likely to be off by one standard deviation of a quantity, to see its curvature.

    Of all changes δ that move it by that much to first order, that with the smallest sum of (δ/σ)² has δ = σ² ∂m/∂δ
    over the deviation. None where forces do not scale with the rubber's: with contact, gas or liquid, or several
    rubbers.

    Parameters
    ----------
    whole : the whole body with its states.
    task : name of the task.
    scatter : its scatter.
    number : of the quantity.
    """
    if not scales(whole.analysis.configurations[task]) or not scatter.deviations[number]:
        return None
    return castings_along(whole, task, scatter, number, scatter.direction(number))


def castings_along(whole: Solved, task: str, scatter: Scatter, number: int, direction: np.ndarray) -> OneDeviation:
    """A quantity of the castings off by a direction of the causes, and by its opposite.

    Parameters
    ----------
    whole, task, scatter, number : see `one_deviation`.
    direction : (n,) changes of the causes over their tolerances.
    """
    causes = zip(scatter.causes, direction, strict=True)
    changes = {cause.name: UNITS[cause.unit] * cause.tolerance * float(part) for cause, part in causes}
    constants: dict[str, float] = {}
    for cause, part in zip(scatter.causes, direction, strict=True):
        for name, by in cause.constants.items():
            constants[name] = constants.get(name, 0.0) + cause.tolerance * float(part) * by
    moved = moved_by(whole.disc.morph, whole.analysis.configurations[task].X, changes)
    name = scatter.quantities[number]
    return OneDeviation(
        *(_solved(whole, task, way * moved, _times(way, changes), _times(way, constants), name) for way in (1.0, -1.0))
    )


def _times(way: float, changes: Mapping[str, float]) -> dict[str, float]:
    return {name: way * change for name, change in changes.items()}


def with_moduli(
    whole: Solved, task: str, factors: Sequence[float], quantities: Sequence[str] = MOTIONS
) -> list[np.ndarray | None] | None:
    """Quantities (k,) with all moduli times each of rising factors; None without a stable state.

    A body of a rubber s times as stiff moves as this one under loads divided by s. None in place of the list where
    forces do not scale with the rubber's, as for `one_deviation`.

    Parameters
    ----------
    whole : the whole body with its states.
    task : name of the task.
    factors : rising.
    quantities : by default the six motions of the tip.
    """
    at, disc = whole.analysis.configurations[task], whole.disc
    if not scales(at):
        return None
    changes = [{MODULUS: factor - 1.0} for factor in reversed(factors)]
    path, found = [as_cast(at, None, each) for each in changes], []
    for there, change, answer in zip(path, changes, sweep(path, disc.tangents[task]), strict=True):
        if isinstance(answer, Equilibrium) and answer.stable:
            found.append(_values(there, answer.state, quantities, change))
        else:
            found.append(None)
    return found[::-1]


def _solved(
    whole: Solved,
    task: str,
    moved: np.ndarray,
    changes: Mapping[str, float],
    constants: Mapping[str, float],
    name: str,
) -> float | None:
    """A quantity where nodes have moved (N, 3), and causes and constants have changed; None without a state."""
    at, state = whole.analysis.configurations[task], whole.analysis.equilibria[task].state
    tangent, there = whole.disc.tangents[task], as_cast(at, moved, changes)
    if constants:
        there = replace(there, model=with_changed(there.model, whole.problem, constants))
    tangent.move_to(at, state)
    start = predict(at, tangent, state, moved, there.loads)
    answer = solve(there, tangent, start, since=(at, state), most=MOST_FACTORISATIONS)
    if not isinstance(answer, Equilibrium) or not answer.stable:
        return None
    return float(_values(there, answer.state, [name], changes)[0])


def _values(there: Configuration, state: State, quantities: Sequence[str], changes: Mapping[str, float]) -> np.ndarray:
    """Quantities (k,) of a casting, which exerts more than the body that is solved by the factor of its moduli."""
    factor = np.array([stiffer(changes) if name in PUSHES else 1.0 for name in quantities])
    return factor * quantities_at(there, state, quantities)


def _of_rubbers(slopes: MotionSlopes, tolerances: Tolerances) -> Iterator[Cause]:
    for region, by in slopes.moduli.items():
        name = region or RUBBER
        yield _cause(modulus_of(name), "%", tolerances.rubbers.get(region, tolerances.rubber), by)
        if history := tolerances.histories.get(region):
            yield _cause(history_of(name), "%", history, by)


def _of_fits(
    by_constants: Mapping[str, np.ndarray], constants: Mapping[str, Constants], names: Sequence[str]
) -> Iterator[Cause]:
    """The independent errors of every fitted rubber, by what its constants do to quantities (k, c)."""
    for region, by in by_constants.items():
        own = constants[region]
        if not len(own.errors):
            continue
        effects = by @ own.errors.T
        _, sizes, ways = np.linalg.svd(_weights(effects, names)[:, None] * effects, full_matrices=False)
        for number, way in enumerate(ways[sizes > NOTHING * sizes[0]] @ own.errors):
            changes = {name: float(part) for name, part in zip(own.names, way, strict=True) if part}
            cause = _cause(fit_of(region or RUBBER, number), "σ", 1.0, by @ way)
            yield replace(cause, constants=changes)


def _weights(effects: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Weights (k,) of effects (k, r) on quantities: each kind of them by its largest, motions before all others."""
    turns = np.array([LEVER if is_turn(name.removeprefix(PUSH)) else 1.0 for name in names])
    weights = np.where([name in PUSHES for name in names], 1.0 / turns, turns)
    motions, pushes = (np.array([name in kind for name in names]) for kind in (MOTIONS, PUSHES))
    for kind, share in ((motions, 1.0), (pushes, LESS), (~motions & ~pushes, LESS)):
        largest = np.max(np.linalg.norm(weights[kind, None] * effects[kind], axis=1), initial=0.0)
        weights[kind] *= share / (largest or 1.0)
    return weights


def _of_loads(at: Configuration, slopes: MotionSlopes, tolerances: Tolerances) -> Iterator[Cause]:
    """The causes that are loads; a load that is zero, or that is found with the state, is none."""
    model, by_load = at.model, slopes.loads
    pressures = np.array([by_known(at, loads.pressure) for loads in by_load])
    for number, chamber in enumerate(model.chambers):
        if pressures[:, number].any() and np.asarray(at.loads.pressure)[number]:
            yield _cause(pressure_of(chamber), "kPa", tolerances.pressure, pressures[:, number])
    for part, name in LOADS.items():
        load = np.asarray(getattr(at.loads, part))
        if load.any():
            by = np.array([getattr(loads, part) @ load for loads in by_load])
            yield _cause(name, "%", tolerances.load, by)
    for number, (name, sheet) in enumerate(model.reinforcements.items()):
        by = np.array([loads.reinforcement[number, 0] for loads in by_load])
        stiffness = float(sheet.stiffness) + float(at.loads.reinforcement[number, 0])
        yield _cause(stiffness_of(name), "%", tolerances.load, stiffness * by)


def _cause(name: str, unit: str, tolerance: float, by: np.ndarray) -> Cause:
    """A cause in its unit, from its standard deviation and derivatives (k,) in those of the code."""
    return Cause(name, unit, tolerance / UNITS[unit], tuple(map(float, UNITS[unit] * by)))
