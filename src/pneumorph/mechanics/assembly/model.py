"""The discrete mechanical model of one mesh: its terms, the sparsity they share, and its supports."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from scipy.linalg import block_diag

from pneumorph.mechanics.assembly import element
from pneumorph.mechanics.assembly.kinematics import State, Topology, padded
from pneumorph.mechanics.assembly.potential import Group, Potential, grouped
from pneumorph.mechanics.assembly.sparsity import Places, Sparsity, places_of, sparsity, touching
from pneumorph.mechanics.assembly.terms import Plate, Pressure, Solid, Term, Weight, connect
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mesh.tets import TetMesh, chambers_of
from pneumorph.problem.symmetry import MIRRORS, NORMALS


@dataclass(frozen=True)
class Model:
    """All of the mechanics that stays fixed while nodes move: terms, supports, sparsity.

    Attributes
    ----------
    rubbers : dict of Rubber by region
        One that is called "" where the mesh names no regions.
    regions : dict of (M_r,) int by region
        The numbers of its elements.
    chambers : tuple of str
        Names, in the order of every pressure and volume vector.
    plate : bool
        Whether the tip face is bonded to a rigid plate.
    mixed : bool
        Whether elements have a pressure of their own.
    nodes : int
        Number of nodes; arrays handed to the kernels are padded beyond it.
    mirror : str or None
        The plane in which the other half of the body continues; its state is the image of this one's.
    supports : (nodes, 3) bool
        Displacement components held at zero.
    terms : tuple of Term
        What Π is the sum of.
    potential, near_tip : Potential
        The terms for the kernels; and those of their elements that depend on the plate.
    places : tuple of Places
        Of every group of the potential.
    fixed : (n,) bool
        Unknowns held at zero by the supports, in the numbering of `sparsity`.
    supported_values, diagonal : int
        Places in the tangent's values of the entries beside fixed unknowns, and of the diagonal.
    """

    rubbers: Mapping[str, Rubber]
    regions: Mapping[str, np.ndarray]
    chambers: tuple[str, ...]
    plate: bool
    mixed: bool
    nodes: int
    mirror: str | None
    supports: np.ndarray
    terms: tuple[Term, ...]
    potential: Potential
    near_tip: Potential
    sparsity: Sparsity
    places: tuple[Places, ...]
    fixed: np.ndarray
    off_tip: np.ndarray
    supported_values: np.ndarray
    diagonal: np.ndarray

    @property
    def rubber(self) -> Rubber:
        """The rubber of a body that is of one.

        Raises
        ------
        ValueError
            Where there are several.
        """
        (only,) = self.rubbers.values()
        return only

    @property
    def top(self) -> Topology:
        return self.potential.top

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.sparsity.size

    @property
    def copies(self) -> int:
        """How often the mesh is in the whole body: 2 where it is half of one."""
        return 1 if self.mirror is None else 2

    @property
    def odd(self) -> np.ndarray:
        """Components of the plate (6,) bool that would break the mirror symmetry; it holds them at zero."""
        return _odd(self.mirror)

    @property
    def elements(self) -> int:
        return int(np.count_nonzero(self.top.weight))

    @property
    def pressures(self) -> int:
        """Number of pressures π among the unknowns; 0 where elements are not mixed."""
        return len(self.sparsity.corners)

    @property
    def element(self) -> str:
        """The kind of its elements as a word."""
        return "mixed" if self.mixed else "quadratic"

    @property
    def pressure_unknowns(self) -> slice:
        """Where they are among the unknowns."""
        return slice(self.size - 6 - self.pressures, self.size - 6)

    def pad(self, nodal: np.ndarray) -> jnp.ndarray:
        """A nodal array (nodes, …) with the rows of padding added."""
        nodal = np.asarray(nodal)
        rows = self.top.on_tip.shape[0] - self.nodes
        return jnp.asarray(np.concatenate([nodal, np.zeros((rows, *nodal.shape[1:]))]))

    def state(self, vector: np.ndarray) -> State:
        """The unknowns (n,) as a State."""
        rows, end = self.top.on_tip.shape[0], 3 * len(self.off_tip)
        u = np.zeros((rows, 3))
        u[self.off_tip] = vector[:end].reshape(-1, 3)
        pressure = np.zeros(len(self.sparsity.rank))
        pressure[self.sparsity.corners] = vector[end:-6]
        return State(jnp.asarray(u), jnp.asarray(vector[-6:]), jnp.asarray(pressure))

    def vector(self, state: State) -> np.ndarray:
        """A State (or a residual) as a vector (n,)."""
        displaced = np.asarray(state.u)[self.off_tip].ravel()
        return np.concatenate([displaced, np.asarray(state.pressure)[self.sparsity.corners], np.asarray(state.plate)])


def model(
    mesh: TetMesh,
    rubber: Rubber | Mapping[str, Rubber],
    plate: bool = True,
    supports: np.ndarray | None = None,
    mixed: bool = False,
) -> Model:
    """Build the model of a mesh.

    Parameters
    ----------
    mesh : TetMesh
        Faces "base" (clamped), "tip" (bonded to the plate) and "chamber <name>" (pressurised), where there are such. On
        "mirror <plane>" nodes stay in the plane, by symmetry.
    rubber : Rubber, or dict of them by the mesh's regions
    plate : bool
        False leaves the tip face free.
    supports : (N, 3) bool, optional
        Displacement components held at zero; by default all three on the face "base".
    mixed : bool
        Elements with a linear pressure of their own, continuous in each region, for rubbers that hardly change their
        volume.

    Raises
    ------
    ValueError
        Where the regions of the rubbers are not those of the mesh, or do not share its elements among them.
    """
    count = len(mesh.points)
    rubbers, regions = _regions(mesh, rubber)
    if supports is None:
        supports = np.zeros((count, 3), bool)
        supports[np.unique(mesh.faces["base"])] = True
    if mesh.mirror is not None:
        supports = supports.copy()
        supports[mesh.mirror_nodes, NORMALS[mesh.mirror]] = True
    on_tip = np.zeros(count, bool)
    if plate:
        on_tip[np.unique(mesh.faces["tip"])] = True
    chambers = tuple(chamber for face in mesh.faces for chamber in chambers_of(face))
    top = _topology(mesh, on_tip)
    rows = top.on_tip.shape[0]
    terms = []
    for number, (name, solid) in enumerate(rubbers.items()):
        tets = mesh.tets[regions[name]]
        places = number * rows + tets[:, :4] if mixed else None
        connectivity = connect(tets, places, size=padded(len(tets)))
        density = element.mixed(solid.isochoric) if mixed else solid.energy
        terms.append(Term(connectivity, Solid(density, jnp.asarray(solid.parameters, dtype=float))))
        terms.append(Term(connectivity, Weight(jnp.asarray(solid.density))))
    if len(top.chamber):
        real = int(np.count_nonzero(np.asarray(top.chamber_weight).any(axis=1)))
        chamber, weight = np.asarray(top.chamber)[:real], np.asarray(top.chamber_weight)[:real]
        terms.append(Term(connect(chamber, data=weight, size=len(top.chamber)), Pressure()))
    if plate:
        terms.append(Term(connect(np.zeros((1, 0), int), plate=True), Plate()))
    pressures = len(rubbers) * rows if mixed else 0
    return Model(
        rubbers=rubbers,
        regions=regions,
        chambers=chambers,
        plate=plate,
        mixed=mixed,
        nodes=count,
        mirror=mesh.mirror,
        supports=supports,
        off_tip=np.flatnonzero(~on_tip),
        **_assembled(terms, top, on_tip, pressures, supports, plate, mesh.mirror),
    )


def with_terms(model: Model, terms: Iterable[Term]) -> Model:
    """The model with other terms, whose elements may see other unknowns than before: its sparsity is built anew.

    Unknowns, state and supports stay; a `Tangent` is to be made for it, which repeats the symbolic analysis.
    """
    on_tip = np.asarray(model.top.on_tip)[: model.nodes, 0] > 0
    pressures = len(model.sparsity.rank)
    return replace(model, **_assembled(terms, model.top, on_tip, pressures, model.supports, model.plate, model.mirror))


def _assembled(
    terms: Iterable[Term], top: Topology, on_tip: np.ndarray, pressures: int, supports, plate: bool, mirror: str | None
) -> dict[str, Any]:
    """What of a model follows from its terms."""
    terms = tuple(terms)
    groups = grouped(terms)
    common = sparsity([group.connectivity for group in groups], on_tip, pressures)
    still = _odd(mirror) if plate else np.ones(6, bool)
    fixed = np.concatenate([supports[~on_tip].ravel(), np.zeros(len(common.corners), bool), still])
    rows = np.repeat(np.arange(common.size), np.diff(common.indptr))
    return {
        "terms": terms,
        "potential": Potential(groups, top),
        "near_tip": Potential(_near_tip(groups, on_tip), top),
        "sparsity": common,
        "places": tuple(places_of(common, group.connectivity) for group in groups),
        "fixed": fixed,
        "supported_values": np.flatnonzero(fixed[rows] | fixed[common.indices]),
        "diagonal": common.indptr[:-1],
    }


def _regions(mesh: TetMesh, rubber: Rubber | Mapping[str, Rubber]) -> tuple[dict[str, Rubber], dict[str, np.ndarray]]:
    """Rubbers and element numbers by region."""
    if isinstance(rubber, Rubber):
        return {"": rubber}, {"": np.arange(len(mesh.tets))}
    if set(rubber) != set(mesh.regions):
        raise ValueError(f"rubbers for {', '.join(rubber)}, but the mesh has {', '.join(mesh.regions) or 'no regions'}")
    regions = {name: np.sort(mesh.regions[name]) for name in rubber}
    if not np.array_equal(np.sort(np.concatenate([*regions.values()])), np.arange(len(mesh.tets))):
        raise ValueError("every element of the mesh must be in one region, and in no other")
    return dict(rubber), regions


def _odd(mirror: str | None) -> np.ndarray:
    # A rotation is an axial vector: what a mirror leaves of a vector it turns round of a rotation.
    polar = np.array(MIRRORS[mirror] if mirror else (1.0, 1.0, 1.0))
    return np.concatenate([polar, np.prod(polar) * polar]) < 0


def _topology(mesh: TetMesh, on_tip: np.ndarray) -> Topology:
    """The mesh's connectivity padded to sizes that follow from its `grade`, the padded number of all its elements.

    A new size of any array compiles everything anew, so all grow together: shares of the grade that hold of nearly all
    bodies, and twice of them where one does not.
    """
    grade = padded(len(mesh.tets))
    even = np.ones(3)
    if mesh.mirror is not None:
        even[NORMALS[mesh.mirror]] = 0.0
    triangles = [(chambers_of(face), nodes) for face, nodes in mesh.faces.items() if chambers_of(face)]
    chamber = np.concatenate([*(nodes for _, nodes in triangles), np.zeros((0, 6), int)])
    # A column for every chamber; a face that stands for an image too is shared between the two.
    shares = [np.full((len(names), len(nodes)), -1.0 / len(names)) for names, nodes in triangles]
    weight = block_diag(*shares).T if shares else np.zeros((0, 0))
    nodes = np.zeros((padded(len(on_tip), 2 * grade, 1.25), 1))
    nodes[: len(on_tip), 0] = on_tip
    tip = mesh.faces.get("tip", np.zeros((0, 6), int))
    tets, tet_weight = _pad(mesh.tets, np.ones(len(mesh.tets)), grade)
    tip, tip_weight = _pad(tip, np.ones(len(tip)), grade // 8)
    chamber, weight = _pad(chamber, weight, grade // 2)
    return Topology(*map(jnp.asarray, (tets, tet_weight, tip, tip_weight, nodes, chamber, weight, even)))


def _pad(connectivity, weight, size):
    """Rows up to a size, or twice that as often as it takes, copies of the first with weight zero."""
    if len(connectivity) == 0:
        return connectivity, weight
    extra = padded(len(connectivity), size, 2.0) - len(connectivity)
    return (
        np.concatenate([connectivity, np.repeat(connectivity[:1], extra, axis=0)]),
        np.concatenate([weight, np.zeros((extra, *weight.shape[1:]))]),
    )


def _near_tip(groups: Iterable[Group], on_tip: np.ndarray) -> tuple[Group, ...]:
    """The groups with those of their elements alone that depend on the plate, padded to a quarter of their size."""
    near = []
    for connectivity, energies in groups:
        count = connectivity.count
        nodes, pressures, data = (
            np.asarray(rows)[:count] for rows in (connectivity.nodes, connectivity.pressures, connectivity.data)
        )
        chosen = np.flatnonzero(touching(nodes, on_tip, connectivity.plate))
        if not len(chosen):
            continue
        size = padded(len(chosen), len(connectivity.weight) // 4, 2.0) if nodes.shape[1] else len(chosen)
        part = connect(nodes[chosen], pressures[chosen], data[chosen], connectivity.plate, size)
        near.append(Group(part, energies))
    return tuple(near)
