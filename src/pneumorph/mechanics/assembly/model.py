"""The discrete mechanical model of one mesh: topology for the potential, pattern for the tangent, supports."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from scipy import sparse
from scipy.linalg import block_diag

from pneumorph.mechanics.assembly.element import mixed
from pneumorph.mechanics.assembly.potential import State, Topology, padded
from pneumorph.mechanics.assembly.sparsity import Pattern, pattern
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mesh.tets import TetMesh, chambers_of
from pneumorph.problem.symmetry import MIRRORS, NORMALS


@dataclass(frozen=True)
class Model:
    """All of the mechanics that stays fixed while nodes move: rubber, connectivity, supports, sparsity.

    Attributes
    ----------
    rubber : Rubber
    chambers : tuple of str
        Names, in the order of every pressure and volume vector.
    plate : bool
        Whether the tip face is bonded to a rigid plate.
    nodes : int
        Number of nodes; arrays handed to the kernels are padded beyond it.
    mirror : str or None
        The plane in which the other half of the body continues; its state is the image of this one's.
    fixed : (n,) bool
        Unknowns held at zero by the supports, in the numbering of `pattern`.
    """

    rubber: Rubber
    chambers: tuple[str, ...]
    plate: bool
    nodes: int
    mirror: str | None
    top: Topology
    near_tip: Topology
    pattern: Pattern
    fixed: np.ndarray
    chamber_places: np.ndarray
    off_tip: np.ndarray
    supported_values: np.ndarray
    diagonal: np.ndarray

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.pattern.size

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
        return len(self.pattern.corners)

    @property
    def mixed(self) -> bool:
        """Whether elements have a pressure of their own."""
        return self.pressures > 0

    @property
    def element(self) -> str:
        """The kind of its elements as a word."""
        return "mixed" if self.mixed else "quadratic"

    @property
    def pressure_unknowns(self) -> slice:
        """Where they are among the unknowns."""
        return slice(self.size - 6 - self.pressures, self.size - 6)

    @property
    def rubber_arguments(self):
        """What every kernel takes first."""
        density = mixed(self.rubber.isochoric) if self.mixed else self.rubber.energy
        return density, jnp.asarray(self.rubber.parameters, dtype=float)

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
        pressure = np.zeros(rows if self.mixed else 0)
        pressure[self.pattern.corners] = vector[end:-6]
        return State(jnp.asarray(u), jnp.asarray(vector[-6:]), jnp.asarray(pressure))

    def vector(self, state: State) -> np.ndarray:
        """A State (or a residual) as a vector (n,)."""
        displaced = np.asarray(state.u)[self.off_tip].ravel()
        return np.concatenate([displaced, np.asarray(state.pressure)[self.pattern.corners], np.asarray(state.plate)])


def model(
    mesh: TetMesh, rubber: Rubber, plate: bool = True, supports: np.ndarray | None = None, mixed: bool = False
) -> Model:
    """Build the model of a mesh.

    Parameters
    ----------
    mesh : TetMesh
        Faces "base" (clamped), "tip" (bonded to the plate) and "chamber <name>" (pressurised), where there are such. On
        "mirror <plane>" nodes stay in the plane, by symmetry.
    plate : bool
        False leaves the tip face free.
    supports : (N, 3) bool, optional
        Displacement components held at zero; by default all three on the face "base".
    mixed : bool
        Elements with a linear, continuous pressure of their own, for rubbers that hardly change their volume.
    """
    count = len(mesh.points)
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
    sparsity = pattern(mesh.tets, count, on_tip, mixed)
    triangles = [(chambers_of(face), nodes) for face, nodes in mesh.faces.items() if chambers_of(face)]
    tip = mesh.faces.get("tip", np.zeros((0, 6), int))
    even = np.ones(3)
    if mesh.mirror is not None:
        even[NORMALS[mesh.mirror]] = 0.0
    grade = padded(len(mesh.tets))
    top = _topology(mesh.tets, triangles, tip, on_tip, even, grade, grade)
    touching = [(names, nodes[on_tip[nodes].any(axis=1)]) for names, nodes in triangles]
    near_tip = _topology(mesh.tets[on_tip[mesh.tets].any(axis=1)], touching, tip, on_tip, even, grade, grade // 4)

    still = _odd(mesh.mirror) if plate else np.ones(6, bool)
    fixed = np.concatenate([supports[~on_tip].ravel(), np.zeros(len(sparsity.corners), bool), still])
    rows = np.repeat(np.arange(sparsity.size), np.diff(sparsity.indptr))
    supported = np.flatnonzero(fixed[rows] | fixed[sparsity.indices])
    return Model(
        rubber=rubber,
        chambers=chambers,
        plate=plate,
        nodes=count,
        mirror=mesh.mirror,
        top=top,
        near_tip=near_tip,
        pattern=sparsity,
        fixed=fixed,
        chamber_places=_chamber_places(sparsity, np.asarray(top.chamber)),
        off_tip=np.flatnonzero(~on_tip),
        supported_values=supported,
        diagonal=sparsity.indptr[:-1],
    )


def _odd(mirror: str | None) -> np.ndarray:
    # A rotation is an axial vector: what a mirror leaves of a vector it turns round of a rotation.
    polar = np.array(MIRRORS[mirror] if mirror else (1.0, 1.0, 1.0))
    return np.concatenate([polar, np.prod(polar) * polar]) < 0


def _topology(tets, triangles, tip, on_tip, even, grade: int, most: int) -> Topology:
    """Connectivity padded to sizes that follow from the mesh's `grade`, the padded number of all its elements.

    A new size of any array compiles everything anew, so all grow together: shares of the grade that hold of nearly all
    bodies, and twice of them where one does not. `most` is the share of these elements.
    """
    chamber = np.concatenate([*(nodes for _, nodes in triangles), np.zeros((0, 6), int)])
    # A column for every chamber; a face that stands for an image too is shared between the two.
    shares = [np.full((len(names), len(nodes)), -1.0 / len(names)) for names, nodes in triangles]
    weight = block_diag(*shares).T if shares else np.zeros((0, 0))
    nodes = np.zeros((padded(len(on_tip), 2 * grade, 1.25), 1))
    nodes[: len(on_tip), 0] = on_tip
    tets, tet_weight = _pad(tets, np.ones(len(tets)), most)
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


def _chamber_places(sparsity: Pattern, triangles: np.ndarray) -> np.ndarray:
    """For every entry of the (S, 18, 18) chamber Hessians its place in the tangent's values, −1 for none; flat."""
    if not len(triangles):
        return np.zeros(0, int)
    number = sparsity.number[triangles]
    dofs = np.where(number[:, :, None] >= 0, 3 * number[:, :, None] + np.arange(3), -1).reshape(len(triangles), 18)
    rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
    wanted = (rows >= 0) & (columns >= rows)
    ranks = sparse.csr_array(
        (np.arange(1, len(sparsity.indices) + 1), sparsity.indices, sparsity.indptr), shape=(sparsity.size,) * 2
    )
    places = np.full(rows.shape, -1)
    places[wanted] = np.asarray(ranks[rows[wanted], columns[wanted]]).ravel() - 1
    return places.ravel()
