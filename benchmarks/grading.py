"""What a graded mesh saves: errors of a motion with equal elements, and with those divided that contribute most.

    python benchmarks/grading.py [BODY:SIZE …] [--rounds 2] [--share 0.15]

The start of every problem is solved on a coarse mesh of plain elements. Its uniform refinement has 8 times as many
elements; graded meshes follow from the coarse one by bisection of the elements that contribute most to the error, by
the dual-weighted residual on the refinement of each. All have the geometry of the coarse mesh, so the error is that of
the solution alone: it is the difference from the motion on two uniform refinements, extrapolated by the order that they
show. Walls, faces and inside are divided alike, as no mesher of surfaces could do better.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import sparse

from pneumorph.analysis.analyse import DESIGN_TOLERANCE
from pneumorph.analysis.near import analyse_near
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import Configuration, NoEquilibrium, State, Tangent, displacement, model_of, part_of, solve
from pneumorph.mechanics.solve.balance import residual_at
from pneumorph.mechanics.solve.refined import on_refined
from pneumorph.mesh import TetMesh
from pneumorph.mesh.refine import LOCAL, NODES_OF_TRIANGLE, Refined, refine
from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, tet_shape
from pneumorph.problem import Problem, load
from pneumorph.problem.components import MOTIONS

ROOT = Path(__file__).resolve().parents[1]
BODIES = ("linear:5", "dome:6")


def bisected(mesh: TetMesh, marked: np.ndarray) -> Refined:
    """Divide the marked elements (m,) at their longest edges, and others as far as the mesh would not be conforming.

    An element whose longest edge is whole is divided there before any other of its edges is (Rivara 1984, International
    Journal for Numerical Methods in Engineering 20, 745–756), so that shapes stay as they were.
    """
    count, corners = len(mesh.points), mesh.tets[:, :4]
    ends = np.sort(corners[:, TET_EDGES], axis=-1)
    edges, of = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    of = of.reshape(-1, 6)
    length = np.linalg.norm(mesh.points[edges[:, 0]] - mesh.points[edges[:, 1]], axis=1)
    rank = np.argsort(np.argsort(length, kind="stable"))
    longest = of[np.arange(len(of)), rank[of].argmax(axis=1)]
    split = np.zeros(len(edges), bool)
    # All edges of a marked element: its parts are half as long.
    split[of[marked]] = True
    while (more := split[of].any(axis=1) & ~split[longest]).any():
        split[longest[more]] = True
    middle = dict(zip(map(tuple, edges[split].tolist()), rank[split], strict=True))
    mids = {tuple(sorted(pair)): node for pair, node in _mid_nodes(mesh)}
    rows, values, columns, fresh = [], [], [], {}

    def node(one: tuple, other: tuple, parent: np.ndarray) -> int:
        """The node in the middle of two corners, each (number, local coordinates), of a part of an element."""
        pair = (min(one[0], other[0]), max(one[0], other[0]))
        if pair in mids:
            return mids[pair]
        if pair not in fresh:
            fresh[pair] = count + len(fresh)
            weights = tet_shape(0.5 * (np.array(one[1]) + np.array(other[1])))
            rows.extend([fresh[pair]] * 10)
            columns.extend(parent.tolist())
            values.extend(weights.tolist())
        return fresh[pair]

    tets = []
    for element in mesh.tets:
        stack = [[(int(element[k]), tuple(LOCAL[k])) for k in range(4)]]
        while stack:
            part = stack.pop()
            pairs = [(min(part[i][0], part[j][0]), max(part[i][0], part[j][0])) for i, j in TET_EDGES]
            ranks = [middle.get(pair, -1) for pair in pairs]
            if (best := int(np.argmax(ranks))) >= 0 and ranks[best] >= 0:
                i, j = TET_EDGES[best]
                at = (mids[pairs[best]], tuple(0.5 * (np.array(part[i][1]) + np.array(part[j][1]))))
                for end in (i, j):
                    half = list(part)
                    half[end] = at
                    stack.append(half)
                continue
            tets.append([c[0] for c in part] + [node(part[i], part[j], element) for i, j in TET_EDGES])
    faces = {name: _divided(face, middle, mids, fresh) for name, face in mesh.faces.items()}
    new = sparse.csr_array((values, (np.array(rows) - count, columns)), (len(fresh), count))
    P = sparse.csr_array(sparse.vstack([sparse.eye_array(count), new]))
    there = replace(mesh, points=P @ mesh.points, tets=np.array(tets), faces=faces)
    # Elements are plain: there are no linear fields.
    return Refined(there, P, sparse.csr_array(P.shape), np.unique(mesh.tets[:, 4:]))


def _mid_nodes(mesh: TetMesh):
    """Corners of edges with the nodes in their middle."""
    return zip(
        map(tuple, mesh.tets[:, TET_EDGES].reshape(-1, 2).tolist()), mesh.tets[:, 4:].ravel().tolist(), strict=True
    )


def _divided(face: np.ndarray, middle: dict, mids: dict, fresh: dict) -> np.ndarray:
    """Triangles, divided as the elements behind them."""
    parts = []
    for corners in face[:, :3].tolist():
        stack = [corners]
        while stack:
            part = stack.pop()
            pairs = [tuple(sorted((part[i], part[j]))) for i, j in TRIANGLE_EDGES]
            ranks = [middle.get(pair, -1) for pair in pairs]
            if max(ranks) >= 0:
                i, j = TRIANGLE_EDGES[int(np.argmax(ranks))]
                for end in (i, j):
                    half = list(part)
                    half[end] = mids[tuple(sorted((part[i], part[j])))]
                    stack.append(half)
                continue
            parts.append(part + [mids[pair] if pair in mids else fresh[pair] for pair in pairs])
    return np.array(parts, int).reshape(-1, len(NODES_OF_TRIANGLE))


class Solved:
    """A mesh with its state, and what of the error its elements contribute."""

    def __init__(self, problem: Problem, mesh: TetMesh, at: Configuration, state: State):
        self.problem, self.mesh, self.at, self.state = problem, mesh, at, state
        self.tangent = Tangent(at.model)
        self.units = []
        for _ in range(3):
            began = time.process_time()
            self.tangent.factorise(at, state)
            self.units.append(time.process_time() - began)

    @property
    def size(self) -> int:
        return self.at.model.size

    def motion(self, component: int) -> float:
        return float(self.state.plate[component])

    def on(self, fine: Refined) -> Solved:
        """The state on a finer mesh."""
        model = model_of(self.problem, fine.mesh)
        there = replace(self.at, model=model, X=fine.mesh.points)
        found = solve(there, Tangent(model), on_refined(fine, self.at, self.state), DESIGN_TOLERANCE, most=80)
        if isinstance(found, NoEquilibrium):
            raise SystemExit(found.reason)
        return Solved(self.problem, fine.mesh, there, found.state)

    def contributions(self, component: int) -> np.ndarray:
        """Of every element to the change of a motion of the plate by uniform refinement, without signs."""
        fine = refine(self.mesh)
        model = model_of(self.problem, fine.mesh)
        there = replace(self.at, model=model, X=fine.mesh.points)
        start = on_refined(fine, self.at, self.state)
        vector, tangent = model.vector(start), Tangent(model)
        tangent.factorise(there, start)
        unit = np.zeros(len(vector))
        unit[len(vector) - 6 + component] = 1.0
        adjoint, residual = tangent.precondition(unit), model.state(residual_at(there, vector)).u
        step = 1e-6 / np.abs(adjoint).max()
        moved = [displacement(model.tip, there.X, model.state(vector + k * step * adjoint)) for k in (-1, 1)]
        z = (moved[1] - moved[0]) / (2 * step)
        # The coarse nodes' part of it adds nothing: forces there are balanced.
        surplus = z - fine.P @ z[: len(self.mesh.points)]
        nodes = np.abs((surplus * residual).sum(axis=1))
        owners = np.repeat(np.arange(len(self.mesh.tets)), 8)
        pairs = np.unique(np.column_stack([np.repeat(owners, 10), fine.mesh.tets.ravel()]), axis=0)
        shared = np.bincount(pairs[:, 1], minlength=len(nodes))
        return np.bincount(pairs[:, 0], nodes[pairs[:, 1]] / shared[pairs[:, 1]], len(self.mesh.tets))


def compared(name: str, size: float, rounds: int, share: float) -> None:
    problem = load(ROOT / "examples" / f"{name}.toml", trust=True)
    problem = problem.with_changes({"mesh.size": f"{size:g} mm", "mesh.element": "quadratic"})
    body = body_of(problem)
    near = analyse_near(problem, body, part_of(problem))
    task = problem.task[0]
    at, state = near.analysis.configurations[task.name], near.analysis.equilibria[task.name].state
    moves = [MOTIONS.index(each) for each in task.objective.tip_motions]
    component = moves[0] if moves else int(np.abs(state.plate).argmax())
    coarse = Solved(problem, near.disc.morph.mesh.at(near.analysis.X), at, state)
    contributed = np.sort(coarse.contributions(component))[::-1]
    for part in (0.1, 0.2, 0.4):
        some = contributed[: round(part * len(contributed))].sum() / contributed.sum()
        print(f"{name}: {100 * part:.0f} % of {len(contributed)} elements contribute {100 * some:.0f} %", flush=True)
    uniform = [coarse]
    for _ in range(2):
        uniform.append(uniform[-1].on(refine(uniform[-1].mesh)))
    graded = [coarse]
    for _ in range(rounds):
        found = graded[-1].contributions(component)
        order = np.argsort(found)[::-1]
        graded.append(graded[-1].on(bisected(graded[-1].mesh, order[: max(1, round(share * len(order)))])))
    zero, one, two = (each.motion(component) for each in uniform)
    ratio = min(max((two - one) / (one - zero), 0.05), 0.6)
    exact = two + (two - one) * ratio / (1.0 - ratio)
    order = -math.log2(ratio)
    print(f"{name}: {MOTIONS[component]} {zero:.4g} → {exact:.4g}, order {order:.2f}")
    print("| mesh | elements | unknowns | factorisation (ms) | error (%) | unknowns of equal elements for it |")
    print("|---|---|---|---|---|---|")
    errors = [abs(each.motion(component) / exact - 1.0) for each in uniform]
    sizes = [each.size for each in uniform]
    for kind, meshes in (("equal", uniform), ("graded", graded[1:])):
        for each in meshes:
            error = each.motion(component) / exact - 1.0
            # Between the equal meshes, by powers.
            same = math.exp(np.interp(-math.log(abs(error)), -np.log(errors), np.log(sizes)))
            cost = 1e3 * sorted(each.units)[1]
            row = f"| {kind} | {len(each.mesh.tets)} | {each.size} | {cost:.0f} | {100 * error:+.2f} | {same:.0f} |"
            print(row, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bodies", nargs="*", default=BODIES)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--share", type=float, default=0.15, help="of the elements that are divided in a round")
    asked = parser.parse_args()
    for body in asked.bodies:
        name, size = body.split(":")
        compared(name, float(size), asked.rounds, asked.share)


if __name__ == "__main__":
    main()
