"""Displacements, stretches and stresses of a design: pictures and exports use them and solve nothing."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumorph.mesh import Covered, TetMesh, unfold
from pneumorph.mesh.tets import TET_RULE, TURNED, chambers_of, is_cut, tet_gradient
from pneumorph.problem.components import MOTIONS
from pneumorph.results.arrays import floats, indices
from pneumorph.symmetry.operations import MIRRORS
from pneumorph.symmetry.part import MOST_TURNS, onwards, turns_of

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
    thickening : {task: {motion: (N,)}}
        Of the last design of a run, the change of the tip's motions that tasks are about, in mm or rad per mm³ of
        rubber that is added at nodes of surfaces; runs of earlier versions have none.
    """

    mesh: TetMesh
    u: Mapping[str, np.ndarray]
    stretch: Mapping[str, np.ndarray]
    sag: np.ndarray | None = None
    inflation: Mapping[str, Inflation] = field(default_factory=dict)
    thickening: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)

    @property
    def skin(self) -> np.ndarray:
        """Sorted numbers (S,) of the nodes on the surfaces, to which cuts do not belong."""
        return skin_of(self.mesh)

    def whole(self) -> Fields:
        """The same fields on the whole body."""
        return self.unfolded(())

    def unfolded(self, keep: Collection[str]) -> Fields:
        """The same fields on the mesh unfolded about the cuts of its part, but for those to `keep`."""
        image = unfold(self.mesh, keep)
        skin = skin_of(image.mesh)
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
            {name: {motion: by[image.source] for motion, by in each.items()} for name, each in self.thickening.items()},
        )

    def pack(self) -> dict[str, np.ndarray]:
        """Arrays from which `unpack_fields` restores these fields."""
        arrays = {"points": self.mesh.points, "tets": self.mesh.tets}
        arrays |= {f"face {name}": triangles for name, triangles in self.mesh.faces.items()}
        arrays |= {f"region {name}": elements for name, elements in self.mesh.regions.items()}
        arrays |= pack_covers(self.mesh) | pack_caps(self.mesh)
        if self.mesh.halved is not None:
            arrays["halved"] = self.mesh.halved
        arrays |= {f"u {name}": u for name, u in self.u.items()}
        arrays |= {f"stretch {name}": stretch for name, stretch in self.stretch.items()}
        for name, each in self.inflation.items():
            arrays |= {f"inflation parts {name}": each.parts, f"inflation u {name}": each.u}
            arrays |= {f"inflation stretch {name}": each.stretch}
        for name, each in self.thickening.items():
            arrays |= {f"thickening {motion} {name}": by.astype(np.float32) for motion, by in each.items()}
        return arrays if self.sag is None else arrays | {"sag": self.sag}


def unpack_fields(arrays: Mapping[str, np.ndarray]) -> Fields:
    """Restore fields from the arrays of `Fields.pack`; KeyError or ValueError if some are missing or wrong."""

    def named(kind: str) -> list[str]:
        return [key.removeprefix(f"{kind} ") for key in arrays if key.startswith(f"{kind} ")]

    mesh = unpack_mesh(arrays, "points", "tets")
    check_elements(mesh)
    nodes, skin = len(mesh.points), len(skin_of(mesh))
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
    thickening: dict[str, dict[str, np.ndarray]] = {}
    for each in named("thickening"):
        motion, _, name = each.partition(" ")
        if name not in u or motion not in MOTIONS:
            raise ValueError("what more rubber does is of other tasks or motions")
        thickening.setdefault(name, {})[motion] = floats(arrays, f"thickening {each}", nodes)
    return Fields(mesh, u, stretch, sag, inflation, thickening)


def unpack_mesh(arrays: Mapping[str, np.ndarray], points: str, tets: str) -> TetMesh:
    """A mesh from stored arrays by their names, and its faces; KeyError or ValueError if it is none.

    For whether its elements have volume see `check_elements`.
    """
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
    regions = [key.removeprefix("region ") for key in arrays if key.startswith("region ")]
    parts = {name: indices(arrays, f"region {name}", None, below=len(corners)) for name in regions}
    if parts and not np.array_equal(np.sort(np.concatenate([*parts.values()])), np.arange(len(corners))):
        raise ValueError("the regions of the mesh do not share its elements among them")
    covers = unpack_covers(arrays)
    if any(own.nodes.size and own.nodes.max() >= len(places) for own in covers.values()):
        raise ValueError("its covers have nodes that the mesh has not")
    halved = floats(arrays, "halved", len(corners)) if "halved" in arrays else None
    return TetMesh(places, corners, faces, parts, covers, unpack_caps(arrays, faces, len(places)), halved)


def check_elements(mesh: TetMesh) -> None:
    """ValueError if elements, with their curved edges, have no volume at a quadrature point."""
    jacobian = np.einsum("eai,gaj->egij", mesh.points[mesh.tets], tet_gradient(TET_RULE))
    if not np.linalg.det(jacobian).min() > 0.0:
        raise ValueError("the mesh has elements without volume")


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
    covers = {}
    for name in (key.removeprefix("cover ") for key in arrays if key.startswith("cover ")):
        nodes = indices(arrays, f"cover {name}", None, 6, below=2**31)
        points = floats(arrays, f"points {name}", len(nodes), 3, 5, most=1e6)
        if not len(nodes) or not (points[..., 2] >= 0.0).all() or not np.abs(points[..., 3:]).max(axis=-1).all():
            raise ValueError(f'what lies under "{name}" has no points, or no weights or directions there')
        covers[name] = Covered(nodes, points)
    return covers


def pack_caps(mesh: TetMesh) -> dict[str, np.ndarray]:
    """Arrays from which `unpack_caps` restores the caps of a mesh."""
    return {f"cap {name}": nodes for name, nodes in mesh.caps.items()}


def unpack_caps(arrays: Mapping[str, np.ndarray], faces: Collection[str], below: int) -> dict[str, np.ndarray]:
    """The caps of a mesh with fewer than so many nodes from stored arrays; KeyError or ValueError if they are none."""
    names = [key.removeprefix("cap ") for key in arrays if key.startswith("cap ")]
    if any(f"chamber {name}" not in faces for name in names):
        raise ValueError("its caps are of chambers that it has not")
    return {name: indices(arrays, f"cap {name}", None, 4, below=below) for name in names}


def skin_of(mesh: TetMesh) -> np.ndarray:
    """Sorted numbers (S,) of the nodes on the surfaces of a mesh, to which cuts do not belong."""
    surfaces = [faces.ravel() for name, faces in mesh.faces.items() if not is_cut(name)]
    return np.unique(np.concatenate(surfaces))
