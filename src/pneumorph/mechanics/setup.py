"""Make the mechanical model and the loads of a problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, log, sqrt
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np
from scipy.optimize import root_scalar

from pneumorph.errors import Hopeless
from pneumorph.mechanics.assembly.build import build_model
from pneumorph.mechanics.assembly.enclosed import Enclosed
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.free import Free, gaps, resting
from pneumorph.mechanics.contact.implicit import Implicit
from pneumorph.mechanics.contact.obstacle import Obstacle
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.pose import STILL
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.contact.shapes import Box, Cylinder, Plane, RigidMesh, Shape, Sphere, Triangles
from pneumorph.mechanics.contact.triangulated import Triangulated
from pneumorph.mechanics.elements.plate import COMPONENTS, rotation
from pneumorph.mechanics.elements.reinforcement import Fibres, Membrane, Reinforcement
from pneumorph.mechanics.elements.seal import SealPressure
from pneumorph.mechanics.elements.terms import Connectivity, Loads
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.energies import Energy
from pneumorph.mechanics.material.homogeneous import principal_energy
from pneumorph.mechanics.material.memory import Memory, Softening, after_pulls
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mechanics.solve.equilibrium import build_loads
from pneumorph.mesh import TetMesh, unfold
from pneumorph.problem import (
    BoxSpec,
    CylinderSpec,
    FibresSpec,
    FreeSpec,
    MembraneSpec,
    ObstacleSpec,
    PlaneSpec,
    Problem,
    SphereSpec,
    TriangulatedSpec,
    reinforcements,
)
from pneumorph.problem import Reinforcement as ReinforcementSpec
from pneumorph.problem.acting import Acting, acting, has_weight
from pneumorph.problem.components import POSE
from pneumorph.problem.gas import Gas
from pneumorph.problem.material import ArrudaBoyce, Gent, Material, MooneyRivlin, NeoHookean, Ogden, Yeoh
from pneumorph.problem.materials import materials
from pneumorph.problem.regions import REST
from pneumorph.problem.reinforcement import buckling_of, wrinkling_of
from pneumorph.problem.scaled import scaled

MIXED_FROM = 50.0
"""κ/μ from which `mesh.element = "auto"` selects mixed elements.

A plane-strain tube of radii 4 and 8 mm at 0.1 MPa, two elements through its wall: plain elements lose 0.2 % of the
motion at κ/μ = 10, 0.4 % at 50, 0.8 % at 1000 and 2.9 % at 10⁵, where they also take ten times the factorisations;
mixed ones lose 0.04 % at every κ/μ, at a tenth more per factorisation.
"""


def rubber_of(material: Material) -> Rubber:
    """The rubber of a table [material], elastic in its state, with what it remembers.

    Gent's limit and the locking of Arruda and Boyce bound the valid stretch, whatever the table says: by the stretch
    of equibiaxial tension, which of all deformations reaches them first.
    """
    energy, own, locking = _law(material)
    valid = min(locking, material.valid_stretch or inf)
    memory = _memory(material, Memory(energy, (*own, material.bulk_modulus))) if material.remembers else None
    if "relaxed" in material.state:
        # All energies are proportional to their moduli.
        material = scaled(material, 1.0 - material.relaxing, name=material.name, source="", bulk=material.bulk_modulus)
        own = _law(material)[1]
    if "softened" in material.state:
        after = _memory(material, Memory(energy, (*own, material.bulk_modulus)))
        energy, own = after_pulls(energy), (*after.softening, after.worst, *own)
    return Rubber(energy, (*own, material.bulk_modulus), material.density, None if valid == inf else valid, memory)


def _memory(material: Material, elastic: Memory) -> Memory:
    """What a rubber remembers, before any load; in the state "softened" a pull."""
    spec, worst, softening = material.softening, 0.0, Softening()
    if spec is not None:
        softening = Softening(1.0 / spec.r, spec.m, spec.beta)
    if spec is not None and spec.stretch is not None and "softened" in material.state:
        logs = log(spec.stretch) * jnp.array([[1.0], [-0.5], [-0.5]])
        worst = float(principal_energy(elastic.isochoric, jnp.array(elastic.parameters), logs)[0])
    shares, times = ([getattr(part, key) for part in material.relaxation] for key in ("share", "time"))
    return replace(elastic, shares=tuple(shares), times=tuple(times), softening=softening, worst=worst)


def _law(material: Material) -> tuple[Energy, tuple[float, ...], float]:
    """ψ_iso of a first pull with its parameters but for κ, and the stretch at which it locks."""
    match material:
        case NeoHookean():
            energy, own, locking = energies.neo_hookean, (material.shear_modulus,), inf
        case MooneyRivlin():
            second = (material.c20, material.c11, material.c02)
            energy = energies.polynomial if any(second) else energies.mooney_rivlin
            own, locking = (material.c10, material.c01, *(second if any(second) else ())), inf
        case Yeoh():
            energy, own, locking = energies.yeoh, material.coefficients, inf
        case Gent():
            energy, own = energies.gent, (material.shear_modulus, material.limit)
            locking = equibiaxial_stretch(3.0 + energies.GENT_END * material.limit)
        case ArrudaBoyce():
            energy, own = energies.arruda_boyce, (material.shear_modulus, material.locking_stretch)
            locking = equibiaxial_stretch(3.0 * material.locking_stretch**2)
        case Ogden():
            terms = [(term.modulus, term.exponent) for term in material.terms]
            energy, own, locking = energies.ogden, tuple(number for term in terms for number in term), inf
    return energy, own, locking


def equibiaxial_stretch(first_invariant: float) -> float:
    """The stretch λ > 1 of isochoric equibiaxial tension with the given Ī₁ = 2 λ² + λ⁻⁴ > 3."""
    rest = sqrt(first_invariant)
    return root_scalar(lambda stretch: 2 * stretch**2 + stretch**-4 - first_invariant, bracket=(1.0, rest)).root


def rubbers_of(problem: Problem) -> dict[str, Rubber]:
    """The rubber of every region by its name, first that of what is in none (`problem.regions.REST`)."""
    return {name: rubber_of(material) for name, material in materials(problem).items()}


def model_of(problem: Problem, mesh: TetMesh, rubbers: Mapping[str, Rubber] | None = None) -> Model:
    """The model of a meshed body: its rubbers, clamped base, and plate or free tip; `rubbers` are other ones.

    Where one rubber of the problem asks for mixed elements, all have them.
    """
    own = rubbers_of(problem)
    mixed = problem.mesh.element == "mixed" or (
        problem.mesh.element == "auto" and any(asks_for_mixed(solid) for solid in own.values())
    )
    plate, weight = problem.end_effector.kind == "plate", has_weight(problem)
    rubber = rubbers or (own if mesh.regions else own[REST])
    contact = contact_of(problem, mesh, own[REST])
    softest = min(solid.shear_modulus for solid in own.values())
    reinforced = {spec.name: reinforcement_of(spec, softest, problem.mesh.size) for spec in reinforcements(problem)}
    return build_model(
        mesh,
        rubber,
        plate=plate,
        mixed=mixed,
        weight=weight,
        contact=contact,
        reinforcements=reinforced,
        seals=seals_of(problem),
    )


def seals_of(problem: Problem) -> dict[str, SealPressure]:
    """The planes on which the rims of chambers lie, by the names of these chambers."""
    seals = {}
    for chamber in problem.body.chamber:
        for number, spec in enumerate(problem.obstacle):
            if isinstance(spec, PlaneSpec) and spec.name == getattr(chamber, "seal", None):
                seals[chamber.name] = SealPressure(np.array(spec.point), np.array(spec.normal), np.array(number))
    return seals


def reinforcement_of(spec: ReinforcementSpec, shear_modulus: float, size: float) -> Reinforcement:
    """The sheet or the fibres of a table [[membrane]] or [[fibres]], as they are at the start.

    They are on rubber of a shear modulus in MPa with a mesh of a size in mm.
    """
    match spec:
        case MembraneSpec():
            data = spec.stiffness.start, spec.poisson, wrinkling_of(spec, shear_modulus, size), spec.coverage.start
            return Membrane(*map(np.asarray, data))
        case FibresSpec():
            hands = (1, -1)[: spec.families]
            stiffness, winding = np.asarray(spec.stiffness.start), np.asarray(spec.winding.start)
            return Fibres(stiffness, winding, np.asarray(buckling_of(spec, shear_modulus, size)), hands)


Moves = Mapping[str, Sequence[float]]
NO_MOVES: Moves = MappingProxyType({})

GUARD = 1 / 4
"""Part of the activation distance in which flat faces are kept from a body that reaches in between their nodes."""


def contact_of(problem: Problem, mesh: TetMesh, rubber: Rubber) -> Contact | None:
    """What the body of a problem may touch; its surfaces are as stiff as the rubber.

    Raises
    ------
    Hopeless
        If an obstacle touches the body at rest.
    """
    if problem.contact is None and not problem.obstacle:
        return None
    own = problem.contact is not None and problem.contact.self
    activation, stiffness = problem.contact_distance, rubber.shear_modulus
    surface, guard = surface_of(mesh), GUARD * activation
    obstacles = {spec.name: obstacle_of(spec, surface, activation, stiffness) for spec in problem.obstacle}
    around = {name: obstacle.around(guard) for name, obstacle in obstacles.items()}
    guards = {
        name: Pairs(surface, mesh.points, False, [triangles], guard, stiffness)
        for name, triangles in around.items()
        if triangles is not None
    }
    for name, obstacle in obstacles.items():
        guarded = {name: guards[name]} if name in guards else {}
        if not Contact(surface, {name: obstacle}, guarded, None).apart(mesh.points, STILL[None]):
            raise Hopeless(f'obstacle "{name}" touches the body at rest; move it away')
    itself = None
    if own:
        image = unfold(mesh) if mesh.part else None
        around = surface if image is None else surface_of(image.mesh)
        itself = Pairs(around, mesh.points, True, [], activation, stiffness, image)
    free = {
        spec.name: free_of(spec.free, obstacles[spec.name], guard) for spec in problem.obstacle if spec.free is not None
    }
    contact = Contact(surface, obstacles, guards, itself, free)
    for name, _, _, under, _ in resting(obstacles, free):
        plane = list(obstacles)[under]
        alone = {each: obstacles[each] for each in (name, plane)}
        if np.any(gaps(alone, {name: free[name]}, Contact(surface, alone, {}, None).views(np.zeros((2, 6)))) <= 0.0):
            raise Hopeless(f'obstacle "{name}" is in "{plane}" at rest; move it away')
    return contact


def free_of(asked: FreeSpec, obstacle: Obstacle, sag: float) -> Free:
    """What a free obstacle is beside its surface, which triangles go around within about `sag` in mm."""
    points, area, radius = obstacle.support(sag)
    return Free(
        mass=asked.mass,
        spring=np.array([getattr(asked.spring, name) for name in POSE]),
        held=np.isin(POSE, asked.hold),
        lever=obstacle.lever(),
        spin=obstacle.spin(),
        points=points,
        area=area,
        radius=radius,
    )


def obstacle_of(spec: ObstacleSpec, surface: Connectivity, activation: float, stiffness: float) -> Obstacle:
    """The obstacle of a table beside the surface of a body; the barrier's d̂ is in mm, its κ in MPa.

    Parameters
    ----------
    spec : ObstacleSpec
        Its table.
    surface : Connectivity
        The faces of the body.
    activation, stiffness : float
        d̂ in mm, κ in MPa.
    """
    match rigid_body_of(spec):
        case Shape() as shape:
            return Implicit(surface, shape, activation, stiffness)
        case Triangles(mesh, center):
            return Triangulated(surface, mesh, activation, stiffness, center)


def rigid_body_of(spec: ObstacleSpec) -> Shape | Triangles:
    """The body of an obstacle in its place: a shape where its distance has a formula."""
    match spec:
        case PlaneSpec():
            return Plane(np.array(spec.point), np.array(spec.normal))
        case SphereSpec():
            return Sphere(np.array(spec.center), spec.radius)
        case CylinderSpec():
            return Cylinder(np.array(spec.center), np.array(spec.axis), spec.radius, spec.length / 2)
        case BoxSpec():
            return Box(np.array(spec.center), np.array(spec.size) / 2)
        case TriangulatedSpec():
            points, triangles = spec.surface
            position, turn = np.array(spec.position), np.asarray(rotation(jnp.asarray(spec.rotation)))
            return Triangles(RigidMesh(spec.scale * points @ turn.T + position, triangles), position)


def asks_for_mixed(rubber: Rubber) -> bool:
    """Whether a rubber needs mixed elements: κ/μ from `MIXED_FROM` on."""
    return rubber.bulk_modulus >= MIXED_FROM * rubber.shear_modulus


def loads_of(
    problem: Problem,
    model: Model,
    pressures: dict[str, float],
    moves: Moves = NO_MOVES,
    reinforcement: np.ndarray | None = None,
    under: Acting | None = None,
) -> Loads:
    """The loads of a problem at chamber pressures, poses of obstacles, and changes of sheets and fibres.

    The changes (R, 2) are those of `Loads.reinforcement`; without them sheets and fibres are those of the start.

    Parameters
    ----------
    problem : Problem
    model : Model
    pressures : {chamber: MPa}
    moves : {obstacle: (3,) or (6,)}
        Poses, mm and rad; the others are in their places.
    reinforcement : (R, 2) array, optional
        See `Loads.reinforcement`.
    under : Acting, optional
        Weight and loads of the plate; by default those that tasks have without loads of their own.
    """
    under = under or acting(problem)
    return build_loads(
        model,
        pressures,
        acceleration=np.array(under.acceleration),
        spring=np.array([getattr(under.spring, component) for component in COMPONENTS]),
        wrench=np.array(under.wrench),
        moves=moves,
        reinforcement=reinforcement,
        held=np.array([under.hold.values.get(component, 0.0) for component in COMPONENTS]),
    )


def enclosed_of(problem: Problem, volumes: Mapping[str, float]) -> Enclosed | None:
    """The chambers whose pressure is unknown: those with a gas, and those with a volume that is filled in, mm³."""
    gases = {chamber.name: chamber.gas for chamber in problem.body.chamber if chamber.gas is not None}
    names = [chamber.name for chamber in problem.body.chamber if chamber.name in gases or chamber.name in volumes]
    if not names:
        return None
    laws = [gases.get(name, Gas()) for name in names]
    return Enclosed(
        chambers=tuple(names),
        added=np.array([volumes.get(name, 0.0) for name in names]),
        gas=np.array([name in gases for name in names]),
        filling=np.array([law.pressure for law in laws]),
        exponent=np.array([law.exponent for law in laws]),
        atmosphere=np.array([law.atmosphere for law in laws]),
    )


def guided_of(problem: Problem, under: Acting | None = None) -> np.ndarray:
    """The plate components (6,) bool that a guide holds, of a task or by `end_effector.hold`."""
    return np.isin(COMPONENTS, list((under or acting(problem)).hold.values))
