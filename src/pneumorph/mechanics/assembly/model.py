"""The mechanical model of a mesh: the terms of Π, their common sparsity, and the supports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.assembly.potential import Potential
from pneumorph.mechanics.assembly.sparsity import BlockPlaces, Sparsity
from pneumorph.mechanics.assembly.tip import Tip
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.elements.energy import Term
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.reinforcement import Reinforcement
from pneumorph.mechanics.elements.terms import Connectivity
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.symmetry.part import Part, images_of, odd_of


@dataclass(frozen=True)
class Model:
    """The parts of the mechanics that do not change as nodes move: terms, supports, sparsity.

    Attributes
    ----------
    rubbers : dict of Rubber by region
        A single one has the key "" where the mesh names no regions.
    regions : dict of (M_r,) int by region
        The numbers of its elements.
    reinforcements : dict of Reinforcement
        Sheets and fibres by their names.
    chambers : tuple of str
        Names, in the order of all vectors of chamber pressures and volumes.
    plate : bool
        Whether the tip face is bonded to a rigid plate.
    mixed : bool
        Whether elements have hydrostatic unknowns π of their own.
    weight : bool
        Whether accelerations act on it.
    nodes : int
        Number of nodes.
    tets, cavities, caps, face : Connectivity
        All tetrahedra; the chambers' triangles, and caps on their ports, whose data are their shares (C,) in the
        chambers' volumes; and the triangles of the tip.
    seals : tuple of Term
        Of chambers whose rims lie on planes, among `terms`.
    part : Part
        The part of the whole body that is meshed; elsewhere, states are images of this one's.
    supports : (nodes, 3) bool
        Displacement components fixed at zero.
    terms : tuple of Term
        The summands of Π.
    potential : Potential
        The terms, grouped for evaluation.
    like : tuple of Connectivity
        Of each group, one with the same nodes that the sparsity was built for.
    independent : (m,) int
        Nodes with displacements of their own: neither on the tip, nor images in the second cut of a sector.
    source : (nodes,) int
        The node whose image each is, or itself.
    fixed : (n,) bool
        Unknowns fixed at zero by the supports, in the numbering of `sparsity`.
    """

    rubbers: Mapping[str, Rubber]
    regions: Mapping[str, np.ndarray]
    reinforcements: Mapping[str, Reinforcement]
    chambers: tuple[str, ...]
    plate: bool
    mixed: bool
    weight: bool
    nodes: int
    tets: Connectivity
    cavities: Connectivity
    caps: Connectivity
    seals: tuple[Term, ...]
    face: Connectivity
    part: Part
    supports: np.ndarray
    terms: tuple[Term, ...]
    potential: Potential
    sparsity: Sparsity
    like: tuple[Connectivity, ...]
    fixed: np.ndarray
    independent: np.ndarray
    source: np.ndarray

    @property
    def places(self) -> tuple[BlockPlaces, ...]:
        """Where the blocks of each group go in the tangent."""
        return tuple(self.sparsity.places(each) for each in self.like)

    @property
    def supported_values(self) -> np.ndarray:
        """Indices into the tangent's values: rows and columns of fixed unknowns."""
        return self.sparsity.values_of(self.fixed)

    @property
    def diagonal(self) -> np.ndarray:
        """Indices into the tangent's values: its diagonal."""
        return self.sparsity.indptr[:-1]

    @property
    def rubber(self) -> Rubber:
        """The rubber of a body made of a single one.

        Raises
        ------
        ValueError
            If there are several.
        """
        (only,) = self.rubbers.values()
        return only

    def beyond_validity(self, stretches: Mapping[str, float]) -> bool:
        """Whether a stretch is beyond the valid range of the rubber of its region."""
        return any(self.rubbers[name].beyond(stretch) for name, stretch in stretches.items())

    @property
    def tip(self) -> Tip:
        return self.potential.tip

    @property
    def contact(self) -> Contact | None:
        return self.potential.contact

    @property
    def plain(self) -> bool:
        """Whether its elements are plain, without π, and there are neither sheets nor fibres nor contact."""
        return self.contact is None and not self.mixed and not self.reinforcements

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.sparsity.size

    @property
    def copies(self) -> int:
        """How often the whole body contains the mesh: 2 where it is a half, n where it is one of n sectors, …."""
        return len(images_of(self.part))

    @property
    def odd(self) -> np.ndarray:
        """Plate components (6,) bool that are zero by symmetry."""
        return odd_of(self.part)

    @property
    def elements(self) -> int:
        return self.tets.count

    @property
    def hydrostatics(self) -> int:
        """Number of hydrostatic unknowns π; 0 without mixed elements."""
        return len(self.sparsity.corners)

    @property
    def element(self) -> str:
        """The kind of its elements: "mixed" or "quadratic"."""
        return "mixed" if self.mixed else "quadratic"

    @property
    def hydrostatic_unknowns(self) -> slice:
        """The slice of π in the vector of unknowns."""
        first = 3 * len(self.independent)
        return slice(first, first + self.hydrostatics)

    @property
    def object_unknowns(self) -> slice:
        """The slice of free obstacles in the vector of unknowns, between π and the plate."""
        return slice(self.hydrostatic_unknowns.stop, self.size - 6)

    def state(self, vector: np.ndarray) -> State:
        """The unknowns (n,) as a State."""
        u = np.zeros((self.nodes, 3))
        u[self.independent] = vector[: 3 * len(self.independent)].reshape(-1, 3)
        hydrostatic = np.zeros(len(self.sparsity.rank))
        hydrostatic[self.sparsity.corners] = vector[self.hydrostatic_unknowns]
        if self.mixed:
            hydrostatic = hydrostatic.reshape(-1, self.nodes)[:, self.source].ravel()
        return State(u, np.array(vector[-6:]), hydrostatic, np.array(vector[self.object_unknowns]).reshape(-1, 6))

    def vector(self, state: State) -> np.ndarray:
        """A State (or a residual) as a vector (n,)."""
        hydrostatic = state.hydrostatic[self.sparsity.corners]
        return np.concatenate([state.u[self.independent].ravel(), hydrostatic, state.objects.ravel(), state.plate])
