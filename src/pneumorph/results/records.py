"""Records of designs and runs, one type for each kind of result; `sweeps.py` has those of sweeps, `objects.py` JSON.

Values are in mm, N, MPa and rad. In files the key names the unit; a field without a unit in its key states it here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumorph.problem.components import MOTIONS

Vector = tuple[float, float, float]
Pressures = Mapping[str, float]


@dataclass(frozen=True)
class TaskResult:
    """The result of a design in one task.

    Attributes
    ----------
    pressures : {chamber: MPa}
    objective : float
        Value of the task's objective, without its weight; smaller is better.
    errors : {name: float}
        Distance from the target, for tasks with a target: "position_mm", "orientation_rad", "force_N", "area_mm2".
    translation, rotation : (3,) mm, rad
        Translation and rotation vector of the tip.
    section_positions, section_rotations : (S, 3) mm, rad
        Centres and rotation vectors of the sections in the objective.
    volumes : {chamber: mm³}
        Volumes of the inflated chambers.
    max_stretch : float
        Largest principal stretch.
    beyond_validity : bool
        Whether the largest stretch is beyond the range for which the rubber's parameters are valid.
    stable : bool
        Whether the state is stable; see `RunResult` for halves and quarters of bodies.
    region_stretches : {region: float}
        The largest principal stretch of every region, in a body of several rubbers; else empty.
    contact : {obstacle: (3,) N}
        Force of the body on every obstacle.
    contact_normal : {obstacle: N}
        Sum of the normal forces on it; those of opposite sides add up.
    contact_area : {obstacle: mm²}
        Area of the body's deformed surface that touches it.
    pose_translations, pose_rotations : {obstacle: (3,) mm, rad}
        Displacements and rotation vectors of free obstacles from their places.
    self_intersecting : bool
        Whether the deformed body intersects itself: without self-contact a design may that did so from the start.
    gas : {chamber: mm³}
        The gas in chambers that are sealed with some, as its volume at 101.325 kPa, absolute.
    """

    pressures: Pressures = field(metadata={"key": "pressure_MPa"})
    objective: float
    errors: Mapping[str, float]
    translation: Vector = field(metadata={"key": "translation_mm"})
    rotation: Vector = field(metadata={"key": "rotation_rad"})
    section_positions: tuple[Vector, ...] = field(metadata={"key": "section_position_mm"})
    section_rotations: tuple[Vector, ...] = field(metadata={"key": "section_rotation_rad"})
    volumes: Mapping[str, float] = field(metadata={"key": "volume_mm3"})
    max_stretch: float
    beyond_validity: bool
    stable: bool
    region_stretches: Mapping[str, float] = field(default_factory=dict)
    contact: Mapping[str, Vector] = field(metadata={"key": "contact_N"}, default_factory=dict)
    contact_normal: Mapping[str, float] = field(metadata={"key": "contact_normal_N"}, default_factory=dict)
    contact_area: Mapping[str, float] = field(metadata={"key": "contact_area_mm2"}, default_factory=dict)
    pose_translations: Mapping[str, Vector] = field(metadata={"key": "pose_mm"}, default_factory=dict)
    pose_rotations: Mapping[str, Vector] = field(metadata={"key": "pose_rad"}, default_factory=dict)
    self_intersecting: bool = False
    gas: Mapping[str, float] = field(metadata={"key": "gas_mm3"}, default_factory=dict)


@dataclass(frozen=True)
class FineResult:
    """What the result of a task would be on infinitely fine meshes, as estimated on a refined one.

    Attributes
    ----------
    objective, errors, translation, rotation, volumes, contact, contact_normal, contact_area
        As in `TaskResult`.
    searched : bool
        Whether the state on the refined mesh had to be searched for, since it is not near enough for a correction of
        first order.
    """

    objective: float
    errors: Mapping[str, float]
    translation: Vector = field(metadata={"key": "translation_mm"})
    rotation: Vector = field(metadata={"key": "rotation_rad"})
    volumes: Mapping[str, float] = field(metadata={"key": "volume_mm3"})
    contact: Mapping[str, Vector] = field(metadata={"key": "contact_N"}, default_factory=dict)
    contact_normal: Mapping[str, float] = field(metadata={"key": "contact_normal_N"}, default_factory=dict)
    contact_area: Mapping[str, float] = field(metadata={"key": "contact_area_mm2"}, default_factory=dict)
    searched: bool = False


@dataclass(frozen=True)
class HistoryEntry:
    """An accepted design: one line of ``history.jsonl``.

    Attributes
    ----------
    iteration : int
        Number of the design; 0 is the start.
    objective : float
        J, the weighted sum of the tasks' objectives.
    tasks : {task: TaskResult}
    limits : {key: value}
        Worst certified value of every limit over the surfaces; None if the problem has no such limit.
    held : bool
        Whether every limit is kept.
    elements, dofs : int
        Size of the mesh and number of unknowns.
    factorisations : int
        Number of factorisations, those for rejected steps included.
    seconds : {phase: s}
        "geometry", "equilibrium", "gradient", "subproblem" and "total".
    equivalents : float or None
        Time of the whole iteration, in multiples of one assembly and factorisation of the tangent on the same mesh.
    remeshed : bool
        Whether the design has a new mesh.
    step, ratio, evaluations : float mm, float, int; None for the start
        Largest motion of a control point, actual over predicted gain, evaluations of the limits in the sub-problem.
    optimality : float or None
        The part of the objective's gradient that the limits do not balance; 0 at an optimum.
    reinforcements : {name: {"stiffness": N/mm, "coverage": 1, "winding": rad}}
        What is designed of sheets and fibres; of others nothing.
    castings : {name: TaskResult}
        Where designs are robust, of the perturbed castings with which they were compared, by task and number.
    finer : {task: FineResult}
        Estimates of results without the error of the mesh, of the designs of which they are made: the last design
        of a run that has ended, and those that are looked at for `mesh.error`.
    """

    iteration: int
    objective: float
    tasks: Mapping[str, TaskResult] = field(metadata={"of": TaskResult})
    limits: Mapping[str, float | None]
    held: bool
    elements: int
    dofs: int
    factorisations: int
    seconds: Mapping[str, float]
    equivalents: float | None
    remeshed: bool
    step: float | None = field(metadata={"key": "step_mm"}, default=None)
    ratio: float | None = None
    evaluations: int | None = None
    # Missing in runs of early versions.
    optimality: float | None = None
    reinforcements: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    castings: Mapping[str, TaskResult] = field(metadata={"of": TaskResult}, default_factory=dict)
    finer: Mapping[str, FineResult] = field(metadata={"key": "on_fine_mesh", "of": FineResult}, default_factory=dict)


@dataclass(frozen=True)
class Motion:
    """What a design achieves in a task, in the unit "mm", "°", "N" or "mm²", or "" for the value of an objective."""

    value: float
    unit: str


@dataclass(frozen=True)
class MotionRates:
    """How fast the tip's motion changes: its translation along and rotation vector about x, y, z, in mm and rad.

    Attributes
    ----------
    by_pressure : {chamber: (6,)}
        Per MPa, of the chambers whose pressure is given.
    by_modulus : (6,) or None
        Per relative change of all moduli of all rubbers: 0.01 times it is what rubber that is 1 % stiffer does. None
        in some runs of earlier versions.
    """

    by_pressure: Mapping[str, tuple[float, ...]]
    by_modulus: tuple[float, ...] | None = None


IDLE = 0.01
"""Part of the largest pressure, and of the motion of every task, below which a chamber does nothing, and by which
pressures may differ that count as equal."""


@dataclass(frozen=True)
class ChamberUse:
    """What a chamber does in the tasks of a design that has several.

    Attributes
    ----------
    pressure : float
        Its largest pressure over the largest of all chambers.
    motion : float or None
        The largest part of a task's motion of the tip that its pressure makes, to first order: pressure times rate over
        the motion, turns times the length of the body. None where its rate is not known, or a task is about something
        other than motions of the tip.
    same_as : str
        The first other chamber with the same pressures in all tasks; empty if there is none.
    """

    pressure: float
    motion: float | None = None
    same_as: str = ""

    @property
    def idle(self) -> bool:
        """Whether no task uses it."""
        return self.pressure <= IDLE or (self.motion is not None and self.motion < IDLE)


@dataclass(frozen=True)
class Cause:
    """Something that a workshop cannot repeat exactly, and what it does.

    Attributes
    ----------
    name : str
    unit : "mm", "°", "kPa" or "%"
    tolerance : float
        Its standard deviation, in the unit.
    by : (k,)
        What the quantities of a `Scatter` change by per unit.
    constants : {name: float}
        Relative changes per unit of the constants of a rubber, of causes that are errors of their fit.
    """

    name: str
    unit: str
    tolerance: float
    by: tuple[float, ...]
    constants: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Scatter:
    """How far what a body does scatters in a task, to first order, if all causes vary independently.

    Attributes
    ----------
    values : (k,) mm and rad, N and N·mm, mm³
        Of the body as designed, on the mesh of the whole body.
    causes : sequence of Cause
    constants : {name: (k,)}
        What the values change by per % of each constant of the rubbers.
    quantities : (k,) str
        What the values are, see `problem/quantities.py`: the six motions of the tip first.
    """

    values: tuple[float, ...]
    causes: tuple[Cause, ...]
    constants: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    quantities: tuple[str, ...] = MOTIONS

    @property
    def motion(self) -> tuple[float, ...]:
        """Translation (mm) and rotation vector (rad) of the tip (6,)."""
        return self.values[: len(MOTIONS)]

    @property
    def variances(self) -> np.ndarray:
        """The part (n, k) of every cause in the variance of every quantity."""
        parts = [np.square(cause.tolerance * np.array(cause.by)) for cause in self.causes]
        return np.array(parts).reshape(-1, len(self.values))

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations (k,) of the quantities."""
        return np.sqrt(self.variances.sum(axis=0))

    def direction(self, number: int) -> np.ndarray:
        """The changes (n,) of the causes over their tolerances that change one quantity most, as a unit vector."""
        return np.array([cause.tolerance * cause.by[number] for cause in self.causes]) / self.deviations[number]


@dataclass(frozen=True)
class RunResult:
    """Contents of ``result.json``: how a run ended, and the results of its last design, which is its best.

    Attributes
    ----------
    title : title of the problem.
    completed : whether the design loop ended by itself, and did not fail.
    reason : why it ended, as a sentence.
    iterations, best : number of the last design, and of the best.
    objective, optimality, limits, held, reinforcements : as in `HistoryEntry`, of the last design.
    motions : {task: Motion}
    tasks : {task: TaskResult}
        If the run is completed, `stable` is against all motions of the whole body, even where a part was analysed.
    seconds : {phase: s}, over all designs.
    peak_memory : MB of this process, without Netgen's; None if the system does not report it.
    versions : {package: version}
    targets : {task: "reached", "nearly reached" or "not reached"}
        Of the tasks that have a target, see `results.targets`.
    rates : {task: MotionRates}, at the last states.
    margins : {task: float}
        Of tasks near ballooning: the pressures at which that happens, over the working ones.
    followed : {task: float}
        Of tasks of which that is not known: the pressures up to which states could be followed, over the working ones.
    finer : {task: FineResult}
        Estimates of results without the error of the mesh; of tasks of which it is known.
    chambers : {chamber: ChamberUse}
        If completed, of designs with several chambers whose pressures are given.
    """

    title: str
    completed: bool
    reason: str
    iterations: int
    best: int
    objective: float
    optimality: float | None
    motions: Mapping[str, Motion] = field(metadata={"of": Motion})
    tasks: Mapping[str, TaskResult] = field(metadata={"of": TaskResult})
    limits: Mapping[str, float | None]
    held: bool
    seconds: Mapping[str, float]
    peak_memory: float | None = field(metadata={"key": "peak_memory_MB"})
    versions: Mapping[str, str | None]
    reinforcements: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    targets: Mapping[str, str] = field(default_factory=dict)
    rates: Mapping[str, MotionRates] = field(metadata={"of": MotionRates}, default_factory=dict)
    margins: Mapping[str, float] = field(default_factory=dict)
    followed: Mapping[str, float] = field(default_factory=dict)
    finer: Mapping[str, FineResult] = field(metadata={"key": "on_fine_mesh", "of": FineResult}, default_factory=dict)
    chambers: Mapping[str, ChamberUse] = field(metadata={"of": ChamberUse}, default_factory=dict)
