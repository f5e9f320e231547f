"""How much of its stiffness at rest a body has left against motions to a side, found on the part that is solved.

The model of a part has symmetric motions only, while a body may buckle to a side. A motion that is odd about a mirror
plane enters the second variation of the whole body's potential as often as the body has copies of the part, and no
two kinds of motion are coupled. So the tangent of the part, with other supports on its mirror planes, tells of one kind
after another whether the body is stable against it. Each costs a factorisation of the part.

The stiffness that is left is the least ratio r = wᵀK w / wᵀK₀ w over all motions w, of the tangent at the state and at
rest: 1 at rest, 0 where the body buckles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy import sparse

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.hessian import tangent as assembled
from pneumorph.mechanics.assembly.kinematics import State
from pneumorph.mechanics.assembly.model import Model, with_fixed
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.solve.balance import unloaded
from pneumorph.mechanics.solve.equilibrium import rest
from pneumorph.mesh.tets import TetMesh
from pneumorph.problem.symmetry import MIRRORS, NORMALS

STEPS, CLOSE = 20, 0.01
"""Most steps of Lanczos' method, and its accuracy. Ratios that matter, below a half, take three to seven steps."""


@dataclass(frozen=True, eq=False)
class Softest:
    """The motion of one kind against which least of the stiffness is left.

    Attributes
    ----------
    at : Configuration
        The state's, with the supports of motions of this kind.
    motion : State
        w, with a largest displacement of 1 mm.
    ratio : float
        r, negative where the body buckles; an upper bound where it is far from that.
    stable : bool
        Whether the body is stable against all motions of this kind.
    """

    at: Configuration
    motion: State
    ratio: float
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
    pressing = np.zeros((len(model.rubbers), model.nodes), bool)
    still = np.full(6, not model.plate)
    for plane in mesh.mirrors:
        nodes, normal = mesh.mirror_nodes(plane), np.arange(3) == NORMALS[plane]
        signs = np.array(MIRRORS[plane])
        # Rotations are axial: a mirror reverses the components that it keeps of translations.
        kept = np.concatenate([signs, -signs]) > 0
        if plane in odd:
            supports[nodes] |= ~normal
            pressing[:, nodes] = True
            still |= kept
        else:
            supports[nodes] |= normal
            still |= ~kept
    return np.concatenate([supports[model.independent].ravel(), pressing.ravel()[model.sparsity.corners], still])


def without_pressure(motion: State) -> State:
    """A motion of mixed elements without π."""
    return motion._replace(hydrostatic=0.0 * motion.hydrostatic)


def softest(
    at: Configuration, state: State, kinds: Sequence[Model], tangent: Tangent, accuracy: float = CLOSE
) -> list[Softest]:
    """Look for the softest motion of every kind at a state of the part; the tangent is factorised there.

    The search ends where a step changes a ratio by less than its relative `accuracy`.
    """
    if not kinds:
        return []
    stiffness = _at_rest(at)
    return [_softest(replace(at, model=kind), state, stiffness, tangent, accuracy) for kind in kinds]


def _at_rest(at: Configuration) -> sparse.csr_array:
    """K₀ (n, n), without supports and without π."""
    free = replace(at, model=with_fixed(at.model, np.zeros(at.model.size, bool)))
    common, still = at.model.sparsity, unloaded(free).loads
    data = assembled(free.model, at.X, rest(at.model), still, np.zeros(6, bool))
    upper = sparse.csr_array((data, common.indices, common.indptr), shape=(at.model.size,) * 2)
    return sparse.csr_array(upper + sparse.triu(upper, 1).T)


def _softest(
    at: Configuration, state: State, stiffness: sparse.csr_array, tangent: Tangent, accuracy: float
) -> Softest:
    """By Lanczos' method for K⁻¹K₀, of which the eigenvalues are 1/r."""
    model = at.model
    tangent.factorise(at, state)
    stable = tangent.negative_pivots == 0
    free = ~at.constrained
    bare = free.copy()
    bare[model.hydrostatic_unknowns] = False
    vector = free * tangent.precondition(free * np.random.default_rng(0).standard_normal(model.size))
    basis, images, projected, known = [], [], np.zeros((STEPS, STEPS)), np.inf
    for step in range(STEPS):
        # Twice, for what is new may be a small part.
        for _ in range(2):
            for one, image in zip(basis, images, strict=True):
                vector = vector - float(vector @ image) * one
            vector /= np.linalg.norm(vector)
        image = bare * (stiffness @ (bare * vector))
        size = np.sqrt(float(vector @ image))
        basis.append(vector / size)
        images.append(image / size)
        vector = free * tangent.precondition(images[-1])
        projected[: step + 1, step] = [float(vector @ other) for other in images]
        values, vectors = np.linalg.eigh(projected[: step + 1, : step + 1], UPLO="U")
        # The largest is that of the softest motion; negative ones are those of motions that buckle.
        found = values[-1] if stable else values[0]
        if abs(found - known) <= accuracy * abs(found):
            break
        known = found
    motion = model.state(np.array(basis).T @ vectors[:, -1 if stable else 0])
    largest = float(np.abs(kernels.displacement_along(model.tip, at.X, state, motion)).max())
    motion = model.state(model.vector(motion) / largest)
    ratio = 1.0 / float(found)
    return Softest(at, motion, ratio if stable else min(ratio, 0.0), stable)
