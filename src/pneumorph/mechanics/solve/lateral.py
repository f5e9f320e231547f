"""How stiff a body is against lateral motions, found on the part that is solved.

The model of a part has symmetric motions only, while a body may buckle laterally. The second variation of the whole
body's potential for a motion that is odd about a mirror plane is that of the part times the number of its copies, and
the kinds of motion are not coupled. So the tangent of the part, with other supports on its mirror planes, shows for one
kind after another whether the body is stable against it. Each kind costs a factorisation of the part.

The distance to buckling is measured by λ, the least wᵀK w / wᵀM w over all motions w, with the masses M of a body of
density 1: the square of the lowest natural frequency, which falls in proportion to a load and is 0 where the body
buckles. (Stiffnesses at rest would not do in place of the masses: where a body has turned, they take rotations for
strains.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.build import with_fixed
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.hessian import unsupported
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.assembly.tip import tip_centre
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.balance import scaled
from pneumorph.mechanics.solve.prediction import predict_change
from pneumorph.mesh.tets import TetMesh
from pneumorph.symmetry.operations import NORMALS
from pneumorph.symmetry.part import odd_of

BESIDE = 1e-3
"""Change of the load factor by which the change of λ is found: rounding errors are 1e-10 of λ or less."""

STEPS, CLOSE = 20, 0.01
"""Most steps of Lanczos' method, and its relative accuracy, which it mostly has after three or four."""


@dataclass(frozen=True, eq=False)
class Softest:
    """The motion of one kind against which a body is least stiff.

    Attributes
    ----------
    at : Configuration
        The state's, with the supports of motions of this kind.
    motion : State
        w, with a largest displacement of 1 mm.
    stiffness : float
        λ, N/mm⁴; not above 0 where the body buckles.
    size : float
        wᵀM w, mm⁵.
    stable : bool
        Whether the body is stable against all motions of this kind.
    """

    at: Configuration
    motion: State
    stiffness: float
    size: float
    stable: bool


def lateral_models(model: Model, mesh: TetMesh) -> tuple[Model, ...]:
    """The model of a part between mirror planes for motions that are odd about some of them; none for other bodies."""
    planes = mesh.mirrors
    chosen = [odd for count in range(1, len(planes) + 1) for odd in combinations(planes, count)]
    return tuple(with_fixed(model, _fixed(model, mesh, odd)) for odd in chosen)


def _fixed(model: Model, mesh: TetMesh, odd: tuple[str, ...]) -> np.ndarray:
    """The unknowns (n,) bool that vanish in motions which are odd about these planes, and even about the others."""
    supports = np.zeros((model.nodes, 3), bool)
    supports[np.unique(mesh.faces["base"])] = True
    hydrostatic = np.zeros((len(model.rubbers), model.nodes), bool)
    plate = np.full(6, not model.plate)
    for plane in mesh.mirrors:
        nodes, normal, changes_sign = mesh.mirror_nodes(plane), np.arange(3) == NORMALS[plane], odd_of((plane,))
        if plane in odd:
            supports[nodes] |= ~normal
            hydrostatic[:, nodes] = True
            plate |= ~changes_sign
        else:
            supports[nodes] |= normal
            plate |= changes_sign
    return np.concatenate([supports[model.independent].ravel(), hydrostatic.ravel()[model.sparsity.corners], plate])


def masses_of(at: Configuration) -> np.ndarray:
    """M (n,), mm³: of every node a tenth of the volume of its elements; those of the tip move with the plate."""
    model = at.model
    tets = model.tets.nodes[: model.elements]
    corners = at.X[tets[:, :4]]
    share = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 60.0
    nodes = np.bincount(tets.ravel(), np.repeat(share, tets.shape[1]), model.nodes)
    tip = model.tip.nodes
    around = np.cross(np.eye(3), (at.X[tip] - tip_centre(model.tip, at.X, at.X))[:, None])
    plate = np.r_[np.full(3, nodes[tip].sum()), np.einsum("t,tki,tki->k", nodes[tip], around, around)]
    others = np.zeros(model.size - 3 * len(model.independent) - 6)
    return np.concatenate([np.repeat(nodes[model.independent], 3), others, plate])


def softest(
    at: Configuration,
    state: State,
    tangent: Tangent,
    masses: np.ndarray,
    accuracy: float = CLOSE,
    values: np.ndarray | None = None,
) -> Softest:
    """Look for the softest motion of a model at a state, by Lanczos' method for K⁻¹M, of which eigenvalues are 1/λ.

    The tangent is factorised there. The search ends where a step changes λ by less than its relative `accuracy`.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    state : State
        The unknowns.
    tangent : Tangent
        Factorised there if it is not.
    masses : (n,) array
        See `masses_of`, mm³.
    accuracy : float
        Relative, of λ.
    values : array, optional
        Of the tangent without supports, see `Tangent.move_to`.
    """
    model, free = at.model, ~at.constrained
    tangent.move_to(at, state, values)
    stable, masses = tangent.negative_pivots == 0, free * masses
    vector = free * tangent.precondition(masses * np.random.default_rng(0).standard_normal(model.size))
    basis, projected, value, chosen = np.zeros((0, model.size)), np.zeros((0, 0)), np.inf, -1 if stable else 0
    while True:
        for _ in range(2):
            # Twice, for what is new may be a small part.
            vector = vector - (basis @ (masses * vector)) @ basis
            vector /= np.sqrt(float(vector @ (masses * vector)))
        basis = np.vstack([basis, vector])
        vector = free * tangent.precondition(masses * vector)
        column = basis @ (masses * vector)
        projected = np.block([[projected, column[:-1, None]], [column[None]]])
        values, vectors = np.linalg.eigh(projected)
        # The largest is that of the softest motion; negative ones are those of motions that buckle.
        value, known = float(values[chosen]), value
        if abs(value - known) <= accuracy * abs(value) or len(basis) == STEPS:
            break
    motion = vectors[:, chosen] @ basis
    largest = np.abs(Displacement(model.tip, at.X, state).along(model.state(motion))).max()
    stiffness = 1.0 / value if stable else min(1.0 / value, 0.0)
    return Softest(at, model.state(motion / largest), stiffness, float(largest) ** -2, stable)


def softest_of_kinds(at: Configuration, state: State, kinds: Sequence[tuple[Model, Tangent]]) -> list[Softest]:
    """The softest motion of every kind at a state of the part, of whose tangent the elements are assembled once.

    Parameters
    ----------
    at : Configuration
        The model of the part, with its nodes and loads.
    state : State
        The unknowns.
    kinds : sequence of (Model, Tangent)
        See `lateral_models`; the linear solver may be the same.
    """
    masses, values = masses_of(at), unsupported(at.model, at.X, state, at.loads)
    return [softest(replace(at, model=kind), state, tangent, masses, values=values) for kind, tangent in kinds]


def stable_against_kinds(at: Configuration, state: State, kinds: Sequence[tuple[Model, Tangent]]) -> list[bool]:
    """Whether a state of the part is stable against the motions of every kind; as `softest_of_kinds`.

    Parameters
    ----------
    at, state, kinds
        As for `softest_of_kinds`.
    """
    values, stable = unsupported(at.model, at.X, state, at.loads), []
    for kind, tangent in kinds:
        tangent.move_to(replace(at, model=kind), state, values)
        stable.append(tangent.negative_pivots == 0)
    return stable


def buckling_load(at: Configuration, state: State, tangent: Tangent, motions: Sequence[Softest]) -> float:
    """The factor of the loads at which a first one of these motions would lose its stiffness λ, to first order.

    Infinite where more load makes all of them stiffer, 1 where one has no stiffness left. λ changes with the load
    factor along the path of states; as it is stationary in the motion, by wᵀ(dK)w / wᵀM w.

    Parameters
    ----------
    at : Configuration
        The model of the part, with its nodes and loads; without enclosed chambers.
    state : State
        Its equilibrium.
    tangent : Tangent
        Of its symmetric motions, with the last factorisation.
    motions : sequence of Softest
        The softest of each kind there.
    """
    model, begin = at.model, at.model.vector(state)
    along = model.vector(predict_change(at, tangent, state, replace(at, loads=scaled(at.loads, 2.0)))) - begin

    def stiffness(step: float) -> np.ndarray:
        loads, there = scaled(at.loads, 1.0 + step), model.state(begin + step * along)
        product = products.tangent_map(model.potential, at.X, there, loads)
        return np.array([model.vector(w) @ model.vector(product(w)) for w in (each.motion for each in motions)])

    rates = (stiffness(BESIDE) - stiffness(-BESIDE)) / (2.0 * BESIDE)
    slopes = [rate / each.size for rate, each in zip(rates, motions, strict=True)]
    lost = [1.0 - each.stiffness / slope for slope, each in zip(slopes, motions, strict=True) if slope < 0.0]
    return 1.0 if any(not each.stable for each in motions) else min(lost, default=np.inf)
