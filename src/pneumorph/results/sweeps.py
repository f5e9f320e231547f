"""Records of the steps of a sweep; `records.py` says how they are read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumorph.results.records import Pressures, Vector

NOWHERE: Vector = (math.nan, math.nan, math.nan)
"""In place of a vector of a step without an equilibrium."""


@dataclass(frozen=True)
class TipStiffness:
    """How stiff the tip is at a state, and what the state takes from the supply.

    Attributes
    ----------
    compliance : (6, 6)
        By how much small forces (N) and moments (N·mm) on the tip move it (mm) and turn it (rad), in the order x, y, z,
        about x, about y, about z; 0 for motions that are held.
    energy : float
        Energy of the state over that of the body at rest, N·mm: in rubber, sheets and springs, less the work of weight
        and loads. Air has done as much by then.
    air : {chamber: mm³}
        Air that has flowed into it from rest on, as its volume at 101.325 kPa, absolute.
    along : (3,) or None
        A direction in which the tip is kept from moving.
    blocked : float or None
        The force in that direction with which it then presses, N; other motions are free.
    """

    compliance: tuple[tuple[float, ...], ...]
    energy: float = field(metadata={"key": "energy_mJ"})
    air: Mapping[str, float] = field(metadata={"key": "air_mm3"})
    along: Vector | None = None
    blocked: float | None = field(metadata={"key": "blocked_N"}, default=None)

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffnesses (3,) in N/mm against forces along principal axes, softest first, and these axes (3, 3) in rows.

        A motion that is held has the stiffness infinity.
        """
        soft, axes = np.linalg.eigh(np.array(self.compliance)[:3, :3])
        with np.errstate(divide="ignore"):
            return 1.0 / np.where(soft > 1e-12 * soft.max(), soft, 0.0)[::-1], axes.T[::-1]


@dataclass(frozen=True)
class SweepStep:
    """One step of a sweep: an equilibrium, or the reason why none was found (other fields are then empty or NaN).

    Attributes
    ----------
    task : str
        The task that gives the pressures of chambers for which the user gave none.
    pressures : {chamber: MPa}
    converged : bool
        Whether an equilibrium was found.
    translation, rotation : (3,) mm, rad
        Translation and rotation vector of the tip.
    reaction : {component: N or N·mm}
        Force or torque that the actuator exerts on the blocks and springs at its plate.
    volumes : {chamber: mm³}
        Volumes of the inflated chambers.
    max_stretch, beyond_validity, stable, region_stretches
        As in `TaskResult`; `stable` is against all motions of the whole body.
    reason : str
        Why no equilibrium was found, as a sentence; else empty.
    errors : {name: float}
        Distance from the task's target, as in `TaskResult`; empty for tasks without one.
    contact, contact_normal, contact_area, pose_translations, pose_rotations
        As in `TaskResult`.
    moves : {obstacle: (3,) mm}
        Displacements of the obstacles that are displaced.
    turns : {obstacle: (3,) rad}
        Rotation vectors of the obstacles that are turned.
    pull : {obstacle: N}
        Of obstacles that close chambers: with what they must be pulled from the body, along their normals, to be where
        they are. It is the force of the vacuum on them less that of the rim.
    self_contact : float
        Sum of the forces with which the body's surface presses on itself.
    self_intersecting : bool
        Whether the deformed body intersects itself, which a problem without self-contact allows.
    buckled : {chamber: MPa}
        Pressures between those of the step before and its own at which the body has buckled or snapped through; else
        empty.
    holds : {component: mm or rad}
        Where motions of the plate are held, if not where they are at rest.
    limit : {chamber: MPa}
        The last pressures to which states could be followed, in the first step without an equilibrium, where they are
        known; else empty.
    gas : {chamber: mm³}
        As in `TaskResult`.
    filled : {chamber: mm³}
        Of chambers that are filled to a volume: the liquid in them beyond what they hold at rest.
    fine_translation, fine_rotation : (3,) mm, rad, or None
        Estimates of the motion of the tip without the error of the mesh, see `FineResult`; in the last step of a sweep,
        as far as they are known.
    fine_reaction, fine_volumes : {component: N or N·mm}, {chamber: mm³}
        The same of reactions and volumes; else empty.
    rubber_translation, rubber_rotation : (3,) mm, rad, or None
        By how much the motion of the tip scatters with the moduli of the rubbers, as one standard deviation of each
        component, to first order; None where nothing is known of the moduli, or the rubber remembers.
    rubber_reaction, rubber_volumes : {component: N or N·mm}, {chamber: mm³}
        The same of reactions and volumes; else empty.
    stiffness : TipStiffness or None
        If it was asked for.
    time : float or None
        s since the first step, where the sweep has a rate.
    """

    task: str
    pressures: Pressures = field(metadata={"key": "pressure_MPa"})
    translation: Vector = field(metadata={"key": "translation_mm"}, default=NOWHERE)
    rotation: Vector = field(metadata={"key": "rotation_rad"}, default=NOWHERE)
    reaction: Mapping[str, float] = field(default_factory=dict)
    volumes: Mapping[str, float] = field(metadata={"key": "volume_mm3"}, default_factory=dict)
    max_stretch: float = math.nan
    beyond_validity: bool = False
    stable: bool = False
    converged: bool = True
    reason: str = ""
    errors: Mapping[str, float] = field(default_factory=dict)
    region_stretches: Mapping[str, float] = field(default_factory=dict)
    contact: Mapping[str, Vector] = field(metadata={"key": "contact_N"}, default_factory=dict)
    contact_normal: Mapping[str, float] = field(metadata={"key": "contact_normal_N"}, default_factory=dict)
    contact_area: Mapping[str, float] = field(metadata={"key": "contact_area_mm2"}, default_factory=dict)
    pose_translations: Mapping[str, Vector] = field(metadata={"key": "pose_mm"}, default_factory=dict)
    pose_rotations: Mapping[str, Vector] = field(metadata={"key": "pose_rad"}, default_factory=dict)
    pull: Mapping[str, float] = field(metadata={"key": "pull_N"}, default_factory=dict)
    self_contact: float = field(metadata={"key": "self_contact_N"}, default=0.0)
    moves: Mapping[str, Vector] = field(metadata={"key": "move_mm"}, default_factory=dict)
    turns: Mapping[str, Vector] = field(metadata={"key": "turn_rad"}, default_factory=dict)
    self_intersecting: bool = False
    buckled: Mapping[str, float] = field(metadata={"key": "buckled_MPa"}, default_factory=dict)
    holds: Mapping[str, float] = field(default_factory=dict)
    limit: Mapping[str, float] = field(metadata={"key": "limit_MPa"}, default_factory=dict)
    gas: Mapping[str, float] = field(metadata={"key": "gas_mm3"}, default_factory=dict)
    filled: Mapping[str, float] = field(metadata={"key": "filled_mm3"}, default_factory=dict)
    fine_translation: Vector | None = field(metadata={"key": "fine_translation_mm"}, default=None)
    fine_rotation: Vector | None = field(metadata={"key": "fine_rotation_rad"}, default=None)
    fine_reaction: Mapping[str, float] = field(default_factory=dict)
    fine_volumes: Mapping[str, float] = field(metadata={"key": "fine_volume_mm3"}, default_factory=dict)
    rubber_translation: Vector | None = field(metadata={"key": "rubber_translation_mm"}, default=None)
    rubber_rotation: Vector | None = field(metadata={"key": "rubber_rotation_rad"}, default=None)
    rubber_reaction: Mapping[str, float] = field(default_factory=dict)
    rubber_volumes: Mapping[str, float] = field(metadata={"key": "rubber_volume_mm3"}, default_factory=dict)
    stiffness: TipStiffness | None = field(metadata={"one": TipStiffness}, default=None)
    time: float | None = field(metadata={"key": "time_s"}, default=None)


@dataclass(frozen=True)
class Cycle:
    """The energy of a cycle of a sweep there and back.

    Attributes
    ----------
    task : str
        As of its steps.
    number : int
        From 1.
    work : float
        That pressures, and what holds the plate, do on the way there, mJ.
    lost : float
        What is left of it after the way back, mJ: in the first cycles, some of it may be stored.
    """

    task: str
    number: int
    work: float = field(metadata={"key": "work_mJ"})
    lost: float = field(metadata={"key": "lost_mJ"})
