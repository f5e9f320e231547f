"""Estimates of the error of the mesh beside each other: by a refined mesh, and by recovered gradients.

    python benchmarks/recovery.py OUT.jsonl [--states 20] [--elements 40] [--most 800] [--seed 46]

OUT is what `accuracy.py` has written: states with their true errors, of which the smallest are taken. They are solved
on the same coarse meshes again. Of each the error is estimated as `accuracy` does it, by a few products with the
tangent of the mesh refined once, and by recovery. With u, the adjoint z of the tip's motion along itself, and stresses
P it is

    ∫ (P* − P) : (∇z* − ∇z) dV,   with mixed elements   − ∫ (J − 1 − π/κ) (q* − q) dV   too, of π and its adjoint q.

What has a star is smoother, quadratic in every element and continuous in every rubber: either the nearest such field in
the mean square (Zienkiewicz and Zhu 1987, International Journal for Numerical Methods in Engineering 24, 337–357), or
one with values at corners from polynomials that are fitted to the values at the quadrature points around them (the
same, 1992, 33, 1331–1364), and the mean of both ends in the middle of edges. The errors of sheets and fibres and of
follower loads are not in it.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pneumorph.analysis.accuracy import BEYOND, refined_model
from pneumorph.analysis.near import Solved
from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.elements.element import TET_CORNER_N, TET_DN, TET_N, TET_WEIGHT
from pneumorph.mechanics.elements.points import strain
from pneumorph.mechanics.elements.response import StrainedPoints, stress_at
from pneumorph.mechanics.elements.solid import Solid
from pneumorph.mechanics.solve.balance import supported
from pneumorph.mesh.tets import TET_EDGES, tet_gradient, tet_shape
from pneumorph.objective import measure_features
from pneumorph.sensitivity.response import measured_of

ROOT = Path(__file__).resolve().parents[1]
FITTED = 30
"""Fewest points to which a quadratic polynomial, of ten coefficients, is fitted; around fewer, the patch is widened. In
thin walls 14 lie so that polynomials become useless beyond them."""

LINE, WEIGHT = np.polynomial.legendre.leggauss(4)
SAME = 1e-4
"""Relative difference of motions up to which a state is the one whose true error is known."""


def _rule() -> tuple[np.ndarray, np.ndarray]:
    """Points (64, 3) and weights of a rule on the tetrahedron that is exact to degree 5."""
    a, b, c = (each.ravel() for each in np.meshgrid(*[(LINE + 1) / 2] * 3, indexing="ij"))
    weights = np.prod(np.meshgrid(*[WEIGHT / 2] * 3, indexing="ij"), axis=0).ravel()
    return np.column_stack([a, (1 - a) * b, (1 - a) * (1 - b) * c]), weights * (1 - a) ** 2 * (1 - b)


POINTS, WEIGHTS = _rule()
LINEAR = np.column_stack([1 - POINTS.sum(axis=1), POINTS]) @ np.linalg.inv(TET_CORNER_N)
"""(64, 4): from values at the four quadrature points to those of the linear function through them."""


def lever_of(at: Configuration) -> np.ndarray:
    """By what rotations count beside translations (6,), as `accuracy.py` has it."""
    return np.repeat([1.0, 0.1 * float(np.ptp(at.X[:, 2]))], 3)


def motion_of(at: Configuration, state: State) -> np.ndarray:
    """The tip's motion (6,), rotations at their lever."""
    moved = measure_features(at.model, at.X, state, shift=at.loads.shift)
    return lever_of(at) * np.concatenate([moved.translation, moved.rotation])


def projected(tets: np.ndarray, X: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (k, 10, M) at the nodes of every element, of the nearest continuous field; see `fitted`."""
    nodes, own = np.unique(tets, return_inverse=True)
    own, shape, volume = own.reshape(tets.shape), tet_shape(POINTS), volumes(tets, X)
    blocks = np.einsum("pa,pb,pm->mab", shape, shape, volume)
    places = np.repeat(own, 10, axis=1).ravel(), np.tile(own, 10).ravel()
    mass = sparse.csc_array((blocks.ravel(), places), (len(nodes), len(nodes)))
    sums = np.einsum("pa,pq,kqm,pm->kma", shape, LINEAR, values, volume, optimize=True)
    gathered = np.array([np.bincount(own.ravel(), row.ravel(), len(nodes)) for row in sums])
    return splu(mass).solve(gathered.T)[own].transpose(2, 1, 0)


def volumes(tets: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Of the points (64, M), mm³."""
    return np.linalg.det(np.einsum("pak,mai->pmik", tet_gradient(POINTS), X[tets])) * WEIGHTS[:, None]


def fitted(tets: np.ndarray, X: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (k, 10, M) at the nodes of every element, from those (k, 4, M) at its quadrature points.

    Parameters
    ----------
    tets : (M, 10) int
        Of one rubber.
    X : (N, 3) mm.
    """
    places = np.einsum("qa,mai->mqi", TET_N, X[tets])
    around: dict[int, set[int]] = {}
    for element, corners in enumerate(tets[:, :4].tolist()):
        for corner in corners:
            around.setdefault(corner, set()).add(element)
    found: dict[int, tuple[np.ndarray, float, np.ndarray]] = {}
    for corner, elements in around.items():
        while 4 * len(elements) < FITTED:
            wider = set().union(*(around[node] for node in np.unique(tets[list(elements), :4]).tolist()))
            if wider == elements:
                break
            elements = wider
        own = sorted(elements)
        off = (places[own] - X[corner]).reshape(-1, 3)
        size = float(np.abs(off).max())
        targets = values[:, :, own].transpose(2, 1, 0).reshape(len(off), -1)
        found[corner] = X[corner], size, np.linalg.lstsq(_terms(off / size), targets, rcond=1e-6)[0]

    def at(corner: int, place: np.ndarray) -> np.ndarray:
        centre, size, coefficients = found[corner]
        return (_terms(((place - centre) / size)[None]) @ coefficients)[0]

    nodes: dict[int, np.ndarray] = {corner: at(corner, X[corner]) for corner in found}
    for middle, ends in zip(tets[:, 4:].ravel(), tets[:, TET_EDGES].reshape(-1, 2), strict=True):
        if middle not in nodes:
            nodes[middle] = np.mean([at(end, X[middle]) for end in ends], axis=0)
    table = np.array([nodes[node] for node in tets.ravel()])
    return table.reshape(len(tets), 10, -1).transpose(2, 1, 0)


def _terms(x: np.ndarray) -> np.ndarray:
    """The terms (n, 10) of a quadratic polynomial at x (n, 3)."""
    return np.column_stack([np.ones(len(x)), x, x**2, x[:, 0] * x[:, 1], x[:, 1] * x[:, 2], x[:, 2] * x[:, 0]])


WAYS = {"projected": projected, "fitted": fitted}


def by_recovery(at: Configuration, tangent: Tangent, state: State, recovered: Callable[..., np.ndarray]) -> float:
    """The estimated error of the tip's motion along itself, with one of `WAYS`."""
    model, motion = at.model, motion_of(at, state)
    weights = lever_of(at) * motion / np.linalg.norm(motion)
    seeds = measured_of(shift=at.loads.shift).jacobian(model, at.X, state)[2][:6]
    seed = weights @ np.array([model.vector(each) for each in seeds])
    adjoint = model.state(tangent.solve_at(at, state, supported(at, seed)))
    nodes = Displacement(model.tip, at.X, state)
    dz, total = nodes.along(adjoint), 0.0
    for elements, energies in model.potential.groups:
        for solid in energies:
            if not isinstance(solid, Solid):
                continue
            tets, count = elements.nodes[: elements.count], elements.count
            F, A, dF = (np.empty((3, 3, 4, count)) for _ in range(3))
            strain(at.X[tets], nodes.u[tets], TET_DN, TET_WEIGHT, F, A, measure := np.empty((4, count)))
            strain(at.X[tets], dz[tets], TET_DN, TET_WEIGHT, dF, A, np.empty((4, count)))
            pi, q = (each.hydrostatic[elements.hydrostatics[:count]] for each in (state, adjoint))
            pi, q = (TET_CORNER_N @ each.T if each.shape[1] else np.zeros((4, count)) for each in (pi, q))
            _, stress, slope = stress_at(solid.at(elements.data[:count]), StrainedPoints(F, A, pi, measure))
            rough = [stress.reshape(9, 4, count), dF.reshape(9, 4, count), q[None]]
            smooth = np.split(recovered(tets, at.X, np.concatenate(rough)), [9, 18])
            P, Z, Q = (
                np.einsum("pa,kam->kpm", tet_shape(POINTS), fine) - np.einsum("pq,kqm->kpm", LINEAR, coarse)
                for fine, coarse in zip(smooth, rough, strict=True)
            )
            total += float(np.sum(volumes(tets, at.X) * (np.sum(P * Z, axis=0) - (LINEAR @ slope) * Q[0])))
    return total


def compared(found: Solved, task: str) -> dict[str, float]:
    """The motion of a state, and its error by every way, with the factorisations that each takes as long as."""
    analysis, disc = found.analysis, found.disc
    at, state, tangent = analysis.configurations[task], analysis.equilibria[task].state, disc.tangents[task]
    began = time.process_time()
    tangent.factorise(at, state)
    unit = time.process_time() - began
    motion = motion_of(at, state)
    along = motion / np.linalg.norm(motion)
    refined = refined_model(found.problem, disc.morph.mesh.at(analysis.X))
    near = None if refined is None else refined.near(at, tangent, state)
    assert near is not None
    values = {"motion": float(along @ motion), "refined": BEYOND * float(along @ (motion_of(*near[:2]) - motion))}
    for way, recovered in WAYS.items():
        began = time.process_time()
        values[way] = by_recovery(at, tangent, state, recovered)
        values[f"{way} equivalents"] = (time.process_time() - began) / unit
    return values


def table(lines: list[dict]) -> str:
    """Effectivities in Markdown."""
    ways = ("refined", *WAYS)
    rows = ["| state | elements | true error | refined mesh | projected | fitted |", "|---|---|---|---|---|---|"]
    for line in lines:
        kind = f"{line['state']}{', mixed' * line['mixed']}{', pressed' * line['contact']}"
        cells = [f"{line[way] / line['true']:.2f}" for way in ways]
        rows.append(
            f"| {kind} | {line['elements']} | {100 * line['true'] / line['motion']:+.2g} % | {' | '.join(cells)} |"
        )
    rows += ["", "| elements | states | estimate | within 0.5 to 2 | median | all |", "|---|---|---|---|---|---|"]
    for kind, chosen in (("plain", (False,)), ("mixed", (True,)), ("all", (False, True))):
        for way in ways:
            found = np.array([line[way] / line["true"] for line in lines if line["mixed"] in chosen])
            within = np.count_nonzero((found >= 0.5) & (found <= 2.0))
            row = f"| {kind} | {len(found)} | {way} | {within} | {np.median(found):.2f} |"
            rows.append(f"{row} {found.min():.2f} to {found.max():.2f} |")
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--states", type=int, default=20)
    parser.add_argument("--elements", type=int, default=40)
    parser.add_argument("--most", type=int, default=800)
    parser.add_argument("--seed", type=int, default=46)
    asked = parser.parse_args()
    sys.path.insert(0, str(ROOT / "benchmarks"))
    import accuracy

    known = [json.loads(line) for line in asked.out.read_text().splitlines()]
    known = sorted((line for line in known if "effectivity" in line), key=lambda line: line["elements"])
    draw = {"random": accuracy._random, "body": accuracy._body, "small": accuracy._small}
    lines = []
    for line in known[: asked.states]:
        kind, name = line["state"].split(maxsplit=1)
        path = ROOT / "examples" / f"{name}.toml"
        of_file = {"end": accuracy._end, "start": accuracy._start}
        case = of_file[kind](path) if kind in of_file else draw[kind](asked.seed, int(name))
        found = accuracy.solved_coarsely(line["state"], case, asked.elements, asked.most)
        there = compared(found, line["task"])
        if abs(there["motion"] / line["motion"] - 1.0) > SAME:
            print(f"{line['state']}: is another state now, {there['motion']:.6g} in place of {line['motion']:.6g}")
            continue
        lines.append(line | there)
        print(json.dumps(lines[-1]), flush=True)
    print(table(lines))


if __name__ == "__main__":
    main()
