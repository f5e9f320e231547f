"""Displacements, stretches and stresses of a design: pictures and exports use them and solve nothing."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pneumorph.analysis.analyse import DESIGN_TOLERANCE, Analysis, Discretisation
from pneumorph.analysis.stored import floats, indices
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    NoEquilibrium,
    Rubber,
    State,
    Tangent,
    configure,
    guided_of,
    loads_of,
    solve,
)
from pneumorph.mechanics.elements.kinematics import deformation_gradients, largest_stretch, volume_ratio
from pneumorph.mechanics.material.rubber import nominal_stress
from pneumorph.mesh import Covered, TetMesh, unfold
from pneumorph.mesh.tets import TET_EDGES, TET_RULE, TURNED, chambers_of, is_cut, tet_gradient
from pneumorph.problem import Problem
from pneumorph.symmetry.operations import MIRRORS
from pneumorph.symmetry.part import MOST_TURNS, onwards, turns_of

MOST_FACTORISATIONS = 40
"""Most for the partly inflated states of a task: they are only shown, so a missing one does no harm."""

PARTS = tuple(part / 6 for part in range(1, 6))
"""Fractions of the pressures of a task at which the last design is stored, to show how it inflates."""

SAME = 1e-6
"""Nodes in the cuts of a sector are images of each other if they are no farther apart than this, mm."""


@dataclass(frozen=True, eq=False)
class Inflation:
    """The surfaces of a design at fractions of a task's pressures, in single precision because they are only shown.

    Attributes
    ----------
    parts : (K,) rising fractions of the pressures, above 0 and below 1.
    u : (K, S, 3) mm
        Displacements of the `Fields.skin` nodes.
    stretch : (K, S)
        Largest principal stretch there.
    """

    parts: np.ndarray
    u: np.ndarray
    stretch: np.ndarray


@dataclass(frozen=True, eq=False)
class Fields:
    """The mesh of a design, with the displacements and stretches of every task.

    Attributes
    ----------
    mesh : TetMesh
        The body at rest; a part where only that was analysed, see `whole`.
    u : {task: (N, 3) mm}
        Displacements of the nodes.
    stretch : {task: (N,)}
        Largest principal stretch at the nodes.
    sag : (N, 3) mm or None
        Displacements under weight and plate loads alone, without pressure; None where there are none of these loads or
        this equilibrium was not computed.
    inflation : {task: Inflation}
        Of the last design of a run; runs of earlier versions have none.
    """

    mesh: TetMesh
    u: Mapping[str, np.ndarray]
    stretch: Mapping[str, np.ndarray]
    sag: np.ndarray | None = None
    inflation: Mapping[str, Inflation] = field(default_factory=dict)

    @property
    def skin(self) -> np.ndarray:
        """Sorted numbers (S,) of the nodes on the surfaces, to which cuts do not belong."""
        return _skin(self.mesh)

    def whole(self) -> Fields:
        """The same fields on the whole body."""
        return self.unfolded(())

    def unfolded(self, keep: Collection[str]) -> Fields:
        """The same fields on the mesh unfolded about the cuts of its part, but for those to `keep`."""
        image = unfold(self.mesh, keep)
        skin = _skin(image.mesh)
        source, turn = np.searchsorted(self.skin, image.source[skin]), image.turn[skin].astype(np.float32)
        return Fields(
            image.mesh,
            {name: image.vectors(u) for name, u in self.u.items()},
            {name: stretch[image.source] for name, stretch in self.stretch.items()},
            None if self.sag is None else image.vectors(self.sag),
            {
                name: Inflation(each.parts, np.einsum("sij,ksj->ksi", turn, each.u[:, source]), each.stretch[:, source])
                for name, each in self.inflation.items()
            },
        )

    def pack(self) -> dict[str, np.ndarray]:
        """Arrays from which `unpack_fields` restores these fields."""
        arrays = {"points": self.mesh.points, "tets": self.mesh.tets}
        arrays |= {f"face {name}": triangles for name, triangles in self.mesh.faces.items()}
        arrays |= {f"region {name}": elements for name, elements in self.mesh.regions.items()}
        arrays |= pack_covers(self.mesh)
        arrays |= {f"u {name}": u for name, u in self.u.items()}
        arrays |= {f"stretch {name}": stretch for name, stretch in self.stretch.items()}
        for name, each in self.inflation.items():
            arrays |= {f"inflation parts {name}": each.parts, f"inflation u {name}": each.u}
            arrays |= {f"inflation stretch {name}": each.stretch}
        return arrays if self.sag is None else arrays | {"sag": self.sag}


def unpack_fields(arrays: Mapping[str, np.ndarray]) -> Fields:
    """Restore fields from the arrays of `Fields.pack`; KeyError or ValueError if some are missing or wrong."""

    def named(kind: str) -> list[str]:
        return [key.removeprefix(f"{kind} ") for key in arrays if key.startswith(f"{kind} ")]

    mesh = unpack_mesh(arrays, "points", "tets")
    nodes, skin = len(mesh.points), len(_skin(mesh))
    u = {name: floats(arrays, f"u {name}", nodes, 3) for name in named("u")}
    stretch = {name: floats(arrays, f"stretch {name}", nodes) for name in named("stretch")}
    if set(u) != set(stretch):
        raise ValueError("displacements and stretches are not of the same tasks")
    sag = floats(arrays, "sag", nodes, 3) if "sag" in arrays else None
    inflation = {}
    for name in named("inflation parts"):
        parts = floats(arrays, f"inflation parts {name}", None)
        moved = floats(arrays, f"inflation u {name}", len(parts), skin, 3)
        inflation[name] = Inflation(parts, moved, floats(arrays, f"inflation stretch {name}", len(parts), skin))
        if name not in u:
            raise ValueError("its ways of inflation are of other tasks")
    return Fields(mesh, u, stretch, sag, inflation)


def unpack_mesh(arrays: Mapping[str, np.ndarray], points: str, tets: str) -> TetMesh:
    """A mesh from stored arrays by their names, and its faces; KeyError or ValueError if it is none."""
    places = floats(arrays, points, None, 3, most=1e12)
    corners = indices(arrays, tets, None, 10, below=len(places))
    names = [key.removeprefix("face ") for key in arrays if key.startswith("face ")]
    faces = {name: indices(arrays, f"face {name}", None, 6, below=len(places)) for name in names}
    if not len(corners) or all(map(is_cut, names)):
        raise ValueError("the mesh has no elements or no faces")
    if any(name.startswith("mirror ") and name.removeprefix("mirror ") not in MIRRORS for name in names):
        raise ValueError("the mesh is part of a body about no known plane")
    _check_sector(places, faces)
    if np.bincount(corners.ravel(), minlength=len(places)).min() == 0:
        raise ValueError("the mesh has nodes that no element uses")
    gradients = tet_gradient(TET_RULE)
    jacobian = np.einsum("eai,gaj->egij", places[corners], gradients)
    if not np.linalg.det(jacobian).min() > 0.0:
        raise ValueError("the mesh has elements without volume")
    regions = [key.removeprefix("region ") for key in arrays if key.startswith("region ")]
    parts = {name: indices(arrays, f"region {name}", None, below=len(corners)) for name in regions}
    if parts and not np.array_equal(np.sort(np.concatenate([*parts.values()])), np.arange(len(corners))):
        raise ValueError("the regions of the mesh do not share its elements among them")
    covers = unpack_covers(arrays)
    if any(own.nodes.size and own.nodes.max() >= len(places) for own in covers.values()):
        raise ValueError("its covers have nodes that the mesh has not")
    return TetMesh(places, corners, faces, parts, covers)


def _check_sector(places: np.ndarray, faces: Mapping[str, np.ndarray]) -> None:
    """ValueError if there are cuts of sectors that are not images of each other."""
    cuts = sorted(name for name in faces if name.startswith("sector "))
    if not cuts:
        return
    first = cuts[0]
    turns = turns_of((first,)) if first.removeprefix("sector ").isdecimal() else 0
    pair = [name for name in faces if is_cut(name)]
    if sorted(pair) != [first, f"{first} image"] or not 2 <= turns <= MOST_TURNS:
        raise ValueError("the mesh is no known sector of a body")
    if len(faces[first]) != len(faces[cuts[1]]) or any(len(chambers_of(name)) not in (0, 1, turns) for name in faces):
        raise ValueError("the mesh is no known sector of a body")
    away = places[faces[cuts[1]]] - places[faces[first][:, TURNED]] @ onwards(turns).T
    if np.abs(away).max() > SAME:
        raise ValueError("the cuts of a sector are not the same after a turn")


def pack_covers(mesh: TetMesh) -> dict[str, np.ndarray]:
    """Arrays from which `unpack_covers` restores the covers of a mesh."""
    arrays = {f"cover {name}": own.nodes for name, own in mesh.covers.items()}
    return arrays | {f"points {name}": own.points for name, own in mesh.covers.items()}


def unpack_covers(arrays: Mapping[str, np.ndarray]) -> dict[str, Covered]:
    """The covers of a mesh from stored arrays; KeyError or ValueError if they are none."""
    found = {}
    for name in (key.removeprefix("cover ") for key in arrays if key.startswith("cover ")):
        nodes = indices(arrays, f"cover {name}", None, 6, below=2**31)
        points = floats(arrays, f"points {name}", len(nodes), 3, 5, most=1e6)
        if not len(nodes) or not (points[..., 2] >= 0.0).all() or not np.abs(points[..., 3:]).max(axis=-1).all():
            raise ValueError(f'what lies under "{name}" has no points, or no weights or directions there')
        found[name] = Covered(nodes, points)
    return found


def collect_fields(
    disc: Discretisation,
    analysis: Analysis,
    sag: np.ndarray | None = None,
    inflation: Mapping[str, Inflation] | None = None,
) -> Fields:
    """Collect the fields of an analysed design."""
    mesh = disc.morph.mesh.at(analysis.X)
    u = {name: found.u for name, found in analysis.equilibria.items()}
    return Fields(mesh, u, {name: nodal_stretch(mesh, moved) for name, moved in u.items()}, sag, inflation or {})


def compute_sag(problem: Problem, disc: Discretisation, analysis: Analysis) -> np.ndarray | None:
    """Displacements (N, 3) in mm without pressures; None without weight and plate loads, or without an equilibrium."""
    effector = problem.end_effector
    if problem.gravity is None and not any((*effector.force, *effector.moment)):
        return None
    laid = next(iter(analysis.configurations.values())).loads.laid
    loads = loads_of(problem, disc.model, {}, laid=laid)
    at = configure(disc.model, analysis.X, loads, guided_of(problem))
    # With another solver: those of the tasks keep the factorisations from which the next design starts.
    found = solve(at, Tangent(disc.model), tolerance=DESIGN_TOLERANCE, most=MOST_FACTORISATIONS)
    return found.u if isinstance(found, Equilibrium) else None


def compute_inflation(disc: Discretisation, analysis: Analysis) -> dict[str, Inflation]:
    """Find the surfaces of a design at the fractions `PARTS` of every task's pressures, if it has any.

    The pressures are lowered from the equilibrium under all of them, so that the path leads to the state that is
    reported, also where the body has several. Where the path is lost, or takes too long, the states found so far are
    kept.
    """
    mesh = disc.morph.mesh.at(analysis.X)
    skin = _skin(mesh)
    # A solver of its own, as for the sag.
    tangent, found = Tangent(disc.model), {}
    for task, pressures in analysis.pressures.items():
        if not any(pressures.values()):
            continue
        way = _lowered(analysis.configurations[task], analysis.equilibria[task].state, tangent)
        states = [(part, answer.u[skin], nodal_stretch(mesh, answer.u)[skin]) for part, answer in way]
        if states:
            parts, u, stretch = (np.array(each) for each in zip(*reversed(states), strict=True))
            found[task] = Inflation(parts, u.astype(np.float32), stretch.astype(np.float32))
    return found


def _lowered(at: Configuration, state: State, tangent: Tangent) -> Iterator[tuple[float, Equilibrium]]:
    """Equilibria at the fractions `PARTS` of the pressures, from the largest down, as far as they are found."""
    full, left = at.loads, MOST_FACTORISATIONS
    for part in reversed(PARTS):
        to = replace(at, loads=full._replace(pressure=part * full.pressure))
        answer = solve(to, tangent, None, DESIGN_TOLERANCE, (at, state), left)
        if isinstance(answer, NoEquilibrium):
            return
        at, state, left = to, answer.state, left - answer.factorisations
        yield part, answer


def _skin(mesh: TetMesh) -> np.ndarray:
    surfaces = [faces.ravel() for name, faces in mesh.faces.items() if not is_cut(name)]
    return np.unique(np.concatenate(surfaces))


def nodal_stretch(mesh: TetMesh, u: np.ndarray) -> np.ndarray:
    """Largest principal stretch at the nodes (N,), from displacements u (N, 3) in mm."""
    return _at_nodes(mesh, largest_stretch(deformation_gradients(mesh.tets, mesh.points, u)).T)


def nodal_stress(mesh: TetMesh, u: np.ndarray, rubbers: Mapping[str, Rubber]) -> np.ndarray:
    """Von Mises stress at the nodes (N,) in MPa, of the Cauchy stress; hydrostatic stress does not contribute.

    `rubbers` are those of the mesh's regions; of a mesh without regions there is one. Where rubbers meet, it is a mean.
    """
    F = deformation_gradients(mesh.tets, mesh.points, u)
    regions = mesh.regions or {name: np.arange(len(mesh.tets)) for name in rubbers}
    stress = np.empty(F.shape[2:])
    for name, own in regions.items():
        stress[:, own] = _von_mises(F[..., own], rubbers[name])
    return _at_nodes(mesh, stress.T)


def _von_mises(F: np.ndarray, rubber: Rubber) -> np.ndarray:
    """Von Mises stress (...) in MPa at deformation gradients F (3, 3, ...)."""
    nominal = nominal_stress(rubber.isochoric, F, np.array(rubber.parameters))
    stress = np.einsum("ik...,jk...->ij...", nominal, F) / volume_ratio(F)
    mean = (stress[0, 0] + stress[1, 1] + stress[2, 2]) / 3.0
    deviator = stress - mean * np.eye(3).reshape(3, 3, *[1] * (F.ndim - 2))
    return np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))


def _at_nodes(mesh: TetMesh, values: np.ndarray) -> np.ndarray:
    """A field (N,) from values (M, 4) at the quadrature points, averaged over the elements at every corner node.

    Mid-side nodes get the mean of the ends of their edge: too few elements share them for an average of their own.
    """
    # Linear extrapolation from the four points of the rule to the corners.
    barycentric = np.column_stack([1.0 - TET_RULE.sum(axis=1), TET_RULE])
    # On the other side of a cut of a sector are the elements at the images of its nodes.
    images, sources = mesh.tied
    source = np.arange(len(mesh.points))
    source[images] = sources
    at_corners, corners = values @ np.linalg.inv(barycentric).T, source[mesh.tets[:, :4]].ravel()
    count = np.bincount(corners, minlength=len(mesh.points))
    field = (np.bincount(corners, at_corners.ravel(), minlength=len(mesh.points)) / np.maximum(count, 1))[source]
    field[mesh.tets[:, 4:]] = field[mesh.tets[:, TET_EDGES]].mean(axis=2)
    return field
