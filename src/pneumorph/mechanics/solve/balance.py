"""Residuals and measures of a state: applied forces, volume ratios and stretches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumorph.interrupts import stop_if_asked
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.tangent import Configuration
from pneumorph.mechanics.elements import kinematics
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.terms import Loads

RUNAWAY_STRETCH = 8.0
"""Beyond this stretch, far more than rubbers are used at, a body counts as ballooning."""

SMOOTH = 0.02
"""Relative residual of a state without rough detail."""

HALVED = 0.5
"""A residual no larger than rounding errors is as good as none where a step with the state's own tangent leaves more
than this part of it: those of large bulk moduli, stiff sheets and fibres may be larger than a tolerance under small
loads."""

SQUEEZED = 0.3
"""Volume ratio below which an element is not what rubber does, but is about to be turned inside out."""

INTERPENETRATION = "surfaces penetrate each other or an obstacle"

LARGEST_MOVE = 0.05
"""Largest motion of a node in a step with contact, relative to the diagonal of the body: what meets on a long way
takes long to find."""

BEFORE = 0.8
"""Part of the way on which nothing meets that is gone where obstacles move."""

MOST_SHORTENINGS = 20
"""How often a step is shortened until no surfaces meet on its way."""

SHORTER = 0.95
"""Part of a way found to be free that is tried next: of all of it, rounding errors may say that it is not."""


def scaled(full: Loads, fraction: float) -> Loads:
    """A fraction of the pressures, weights, plate loads, poses of obstacles and held motions; springs stay."""
    return full._replace(
        pressure=full.pressure * fraction,
        acceleration=full.acceleration * fraction,
        wrench=full.wrench * fraction,
        shift=full.shift * fraction,
        held=full.held * fraction,
    )


def unloaded(at: Configuration) -> Configuration:
    """The same body and springs without pressures, weights and plate loads, and with obstacles in their places.

    Motions of the plate that are held are held where they are at rest.
    """
    return replace(at, loads=scaled(at.loads, 0.0))


def evaluate(at: Configuration, state: State) -> tuple[float, np.ndarray]:
    """Π and R (n,), with the reactions of supports and blocks."""
    stop_if_asked()
    model = at.model
    value, residual = kernels.value_and_residual(model.potential, at.X, state, at.loads)
    return value, model.vector(residual)


def supported(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """A vector (n,) with zeros for constrained unknowns."""
    return np.where(at.constrained, 0.0, vector)


def held(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """Unknowns (n,) with those that are constrained at their values: zero, or where the plate is held."""
    vector = supported(at, vector)
    vector[-6:] = np.where(at.blocked, at.loads.held, vector[-6:])
    return vector


def residual_at(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """R (n,) at the given unknowns, zero where they are constrained."""
    return supported(at, evaluate(at, at.model.state(vector))[1])


def length(at: Configuration, change: np.ndarray) -> float:
    """Norm of a change of the unknowns, in mm and rad, with π in multiples of the shear modulus."""
    hydrostatics = change[at.model.hydrostatic_unknowns]
    stiffest = max(rubber.shear_modulus for rubber in at.model.rubbers.values())
    squares = change @ change + (stiffest**-2 - 1.0) * (hydrostatics @ hydrostatics)
    return float(np.sqrt(max(squares, 0.0)))


def applied_force(at: Configuration, state: State) -> float:
    """Norm of the applied nodal forces in N: residuals are relative to it."""
    loads, outer = at.loads, kernels.without_solid(at.model.potential)
    rest = scaled(loads, 0.0)._replace(shift=loads.shift, held=loads.held)
    full, internal = (
        at.model.vector(kernels.value_and_residual(outer, at.X, state, each)[1]) for each in (loads, rest)
    )
    difference = full - internal
    if np.any(loads.shift):
        # What is displaced loads the body by its contact alone.
        difference = np.append(
            difference, at.model.vector(kernels.contact_residual(at.model.potential, at.X, state, loads))
        )
    if np.any(loads.held):
        # So does a plate that is held elsewhere by the forces on it.
        residual = kernels.value_and_residual(at.model.potential, at.X, state, loads)[1]
        difference = np.append(difference, residual.plate[at.blocked])
    # Moments count with a lever of 1 mm; the floor keeps the unloaded body solvable.
    return max(float(np.linalg.norm(difference[np.isfinite(difference)])), 1e-3)


def energy_rounding(at: Configuration) -> float:
    """Rounding error of Π in N·mm under however small a load: energy densities are differences of numbers like μ."""
    modulus = max(rubber.shear_modulus for rubber in at.model.rubbers.values())
    return 4.0 * np.finfo(float).eps * modulus * float(np.prod(np.ptp(at.X, axis=0)))


def residual_rounding(at: Configuration, vector: np.ndarray) -> float:
    """Largest rounding error of the residual in N: a tenth of its change where unknowns change by that of coordinates.

    Neighbours change in opposite directions, which changes the residual most: on tubes of bulk moduli from 200 to 2000
    MPa 130 to 380 times what is left of it where steps do not get on any more.
    """
    step = np.finfo(float).eps * float(np.abs(at.X).max())
    shift = supported(at, step * np.where(np.arange(len(vector)) % 2, 1.0, -1.0))
    return 0.1 * float(np.linalg.norm(residual_at(at, vector + shift) - residual_at(at, vector)))


def bulk_over_shear(at: Configuration) -> float:
    """κ/μ, the largest of all rubbers: residuals of equally rough displacements grow with it."""
    return max(rubber.bulk_modulus / rubber.shear_modulus for rubber in at.model.rubbers.values())


def relative_residual(at: Configuration, state: State) -> float:
    """Norm of the residual over that of the applied forces."""
    vector = held(at, at.model.vector(state))
    return float(np.linalg.norm(residual_at(at, vector))) / applied_force(at, at.model.state(vector))


def pressure_force(at: Configuration, state: State, change: np.ndarray) -> np.ndarray:
    """−(∂R/∂p)·change (n,): the nodal forces of a change of chamber pressures (C,) in MPa, those on supports too."""
    outer, pressure = kernels.without_solid(at.model.potential), np.asarray(at.loads.pressure)
    more = at.loads._replace(pressure=pressure + change)
    without, with_pressure = (
        at.model.vector(kernels.value_and_residual(outer, at.X, state, loads)[1]) for loads in (at.loads, more)
    )
    return without - with_pressure


def smallest_ratio(at: Configuration, vector: np.ndarray) -> float:
    """The smallest volume ratio J at the quadrature points."""
    return float(ratios_at(at, vector).min())


def ratios_at(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """The volume ratios (4, E) at the quadrature points."""
    return kinematics.volume_ratio(_deformation_gradients(at, at.model.state(vector)))


def squeezed(at: Configuration, vector: np.ndarray) -> str:
    """Which element is about to be turned inside out, as the end of a sentence; empty where none is."""
    ratios = ratios_at(at, vector).min(axis=0)
    if ratios.min() > SQUEEZED:
        return ""
    x, y, z = at.X[at.model.tets.nodes[ratios.argmin(), :4]].mean(axis=0)
    return (
        f"; the mesh element near ({x:.3g}, {y:.3g}, {z:.3g}) mm is squeezed to {ratios.min():.2g} of its volume: use "
        "a finer mesh, or round the edge there"
    )


def stepped_ratios(
    at: Configuration, ratios: np.ndarray, vector: np.ndarray, direction: np.ndarray, moved: np.ndarray
) -> np.ndarray:
    """Volume ratios (4, E) as unknowns of their own, after a step along a Newton direction from some unknowns.

    At its end they would be J linearised there; a shorter step goes a share of the way.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    ratios : (4, E) array
    vector : (n,) array
        The unknowns before the step.
    direction : (n,) array
        Newton's direction.
    moved : (n,) array
        The unknowns after the step.
    """
    share = float(np.linalg.norm(moved - vector) / max(np.linalg.norm(direction), 1e-300))
    F, there = (_deformation_gradients(at, at.model.state(each)) for each in (vector, vector + direction))
    dF = there - F
    # J is a cubic along dF: its odd part is the slope and det dF.
    forwards, backwards, cubic, here = map(kinematics.volume_ratio, (there, F - dF, dF, F))
    return ratios + share * (here + 0.5 * (forwards - backwards) - cubic - ratios)


def largest_stretch(at: Configuration, state: State) -> float:
    """The largest principal stretch at the quadrature points."""
    return float(kinematics.largest_stretch(_deformation_gradients(at, state)).max())


def largest_stretches(at: Configuration, state: State) -> dict[str, float]:
    """The largest principal stretch at the quadrature points of every region."""
    stretch = kinematics.largest_stretch(_deformation_gradients(at, state))
    return {name: float(stretch[:, own].max()) for name, own in at.model.regions.items()}


def _deformation_gradients(at: Configuration, state: State) -> np.ndarray:
    stop_if_asked()
    tets = at.model.tets.nodes[: at.model.elements]
    return kinematics.deformation_gradients(tets, at.X, displacement(at.model.tip, at.X, state))


def places(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """Places x (N, 3) of all nodes in mm at the given unknowns."""
    return at.X + displacement(at.model.tip, at.X, at.model.state(vector))


def poses_at(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """Poses (K, 6) of all obstacles at the given unknowns."""
    return kernels.poses(at.model.potential, at.model.state(vector), at.loads)


def apart(at: Configuration, vector: np.ndarray) -> bool:
    """Whether no surface goes through another or through an obstacle; always where there is no contact."""
    contact = at.model.contact
    return contact is None or contact.apart(places(at, vector), poses_at(at, vector))


def free_way(at: Configuration, state: State, there: Configuration, end: State) -> float:
    """A share of the straight way from a state to another, while obstacles move too, on which nothing meets.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    state : State
        Its state.
    there : Configuration
        The model with other loads.
    end : State
        The state there.
    """
    contact = at.model.contact
    assert contact is not None
    first, last = at.model.vector(state), there.model.vector(end)
    share = contact.free_share(places(at, first), places(there, last), poses_at(at, first), poses_at(there, last))
    return share if share == 1.0 else BEFORE * share


def free_share(at: Configuration, vector: np.ndarray, step: np.ndarray) -> float:
    """A share of a step (n,) of the unknowns on whose straight way no surfaces meet; 1 where there is no contact."""
    contact = at.model.contact
    if contact is None:
        return 1.0
    start = places(at, vector)
    poses = poses_at(at, vector)
    share = near_share(at, vector, step)
    for _ in range(MOST_SHORTENINGS):
        end = vector + share * step
        free = contact.free_share(start, places(at, end), poses, poses_at(at, end))
        if free == 1.0:
            return share
        if free <= 0.0:
            # They meet at its start, however short it is.
            return 0.0
        # A plate that turns by less moves its nodes another way: the shorter way is checked too.
        share *= SHORTER * free
    return 0.0


def near_share(at: Configuration, vector: np.ndarray, step: np.ndarray) -> float:
    """The share of a step (n,) of the unknowns with which nothing moves by more than `LARGEST_MOVE`; at most 1."""
    start, poses = places(at, vector), poses_at(at, vector)
    moved = np.concatenate([places(at, vector + step) - start, (poses_at(at, vector + step) - poses)[:, :3]])
    far = np.linalg.norm(moved, axis=1).max()
    return min(1.0, float(LARGEST_MOVE * np.linalg.norm(np.ptp(at.X, axis=0)) / max(far, 1e-300)))
