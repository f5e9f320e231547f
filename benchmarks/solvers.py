"""One equilibrium by four solvers: time, memory, and displacement of the tip, for the same mesh and load.

    python benchmarks/solvers.py [--plot PICTURE.png] [8000 30000 …]

The load case is the starting tube of the linear actuator at 60 kPa with a free tip, from rest. The arguments are
approximate numbers of quadratic tetrahedra. All solvers use the same ten-node elements, the four-point rule if the
quadrature can be chosen, both cores, one load step, and a relative residual of 1e-9. The time is that from a mesh and
loads in memory to displacements, without imports and without JAX's compilation, which is kept between runs; for
CalculiX it includes reading the input file and writing the result. Every solver runs in its own process, whose peak
memory is reported. A solver that fails, needs more than five minutes, or would by its growth so far, is left out on
larger meshes. The picture shows the growth of time and memory; its exponents are those between the first and the last
mesh of each solver.
"""

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

import matplotlib.pyplot as plt
import numpy as np

from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.mechanics.assembly.hessian import tangent
from pneumorph.mesh.tets import TET_EDGES, TET_FACES, TET_RULE, TRIANGLE_RULE, TetMesh
from pneumorph.mesh.tube import mesh_body
from pneumorph.verify import calculix, symbolic
from pneumorph.verify.actuator import PRESSURE, linear_actuator

TOLERANCE = 1e-9
LONGEST = 300.0
"""Seconds for a solver on a mesh, its preparation included."""

MANY = 50_000
"""Elements from which on a solve is long against compiling, and measured once."""

SHEAR, BULK = 0.49, 4.80


def ours(mesh: TetMesh) -> dict:
    def whole():
        built = build_model(mesh, neo_hookean_rubber(SHEAR, BULK, 1.1e-9), plate=False)
        at = configure(built, mesh.points, build_loads(built, {"A": PRESSURE}))
        solver = Tangent(built)
        return built, at, solver, solve(at, solver, tolerance=TOLERANCE)

    if len(mesh.tets) < MANY:
        whole()
    (built, at, solver, found), seconds = timed(whole)
    assembly, factor = [], []
    for _ in range(5 if len(mesh.tets) < MANY else 1):
        data, took = timed(lambda: tangent(built, at.X, found.state, at.loads, at.blocked))
        assembly.append(took)
        factor.append(timed(partial(solver._factor.refactorise, data))[1])
    return {
        "seconds": seconds,
        "u": found.u,
        "note": f"{found.factorisations} factorisations, {found.solves} back-solves; "
        f"assembly {median(assembly):.3f} s, factorisation {median(factor):.3f} s, "
        f"{100 * median(assembly) / median(factor):.0f} %",
    }


def ngsolve(mesh: TetMesh) -> dict:
    import ngsolve as ng

    def whole():
        body = symbolic.ngsolve_mesh(mesh)
        space = ng.VectorH1(body.mesh, order=2, dirichlet="base")
        u = space.TrialFunction()
        in_tets = {ng.TET: ng.IntegrationRule([tuple(point) for point in TET_RULE.tolist()], [1 / 24] * 4)}
        places, weights = TRIANGLE_RULE
        on_walls = {ng.TRIG: ng.IntegrationRule([tuple(place) for place in places.tolist()], weights.tolist())}
        # Pressure by the volume of the chamber instead of tractions, so that the tangent is symmetric.
        work = ng.BilinearForm(space, symmetric=True)
        work += ng.Variation(symbolic.neo_hookean(ng.Id(3) + ng.Grad(u), SHEAR, BULK) * ng.dx(intrules=in_tets))
        area = ng.Cof(ng.Id(3) + ng.Grad(u).Trace()) * ng.specialcf.normal(3)
        outward = ng.CF((ng.x, ng.y, ng.z)) + u.Trace()
        work += ng.Variation(PRESSURE / 3 * outward * area * ng.ds("chamber A", intrules=on_walls))
        state = ng.GridFunction(space)
        residual, step = state.vec.CreateVector(), state.vec.CreateVector()
        free = np.fromiter(space.FreeDofs(), bool)
        scale, count = None, 0
        while True:
            work.Apply(state.vec, residual)
            size = np.linalg.norm(residual.FV().NumPy()[free])
            scale = scale or size
            if size <= TOLERANCE * scale:
                return body, state, count
            work.AssembleLinearization(state.vec)
            step.data = work.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky") * residual
            state.vec.data -= step
            count += 1

    with ng.TaskManager():
        (body, state, count), seconds = timed(whole)
    return {"seconds": seconds, "u": symbolic.nodal(body, state.vec.FV().NumPy()), "note": f"{count} Newton steps"}


def felupe(mesh: TetMesh) -> dict:
    import felupe as fem
    from pypardiso import spsolve

    behind = with_first_face(mesh, mesh.faces["chamber A"])

    def whole():
        solid = fem.Mesh(mesh.points, mesh.tets, "tetra10")
        region = fem.RegionQuadraticTetra(solid, quadrature=fem.quadrature.Scheme(TET_RULE, np.full(4, 1 / 24)))
        field = fem.FieldContainer([fem.Field(region, dim=3)])
        wall = wall_region(fem, fem.Mesh(mesh.points, behind, "tetra10"))
        body = fem.SolidBody(umat=fem.NeoHooke(mu=SHEAR, bulk=BULK), field=field)
        pressure = fem.SolidBodyPressure(fem.FieldContainer([fem.Field(wall, dim=3)]), pressure=PRESSURE)
        base = np.isin(np.arange(len(mesh.points)), np.unique(mesh.faces["base"]))
        clamped = {"base": fem.Boundary(field[0], mask=base)}
        fixed, free = fem.dof.partition(field, clamped)
        found = fem.newtonraphson(
            items=[body, pressure],
            dof0=fixed,
            dof1=free,
            ext0=fem.dof.apply(field, clamped, fixed),
            solver=spsolve,
            tol=TOLERANCE,
            verbose=0,
        )
        return found, field

    (found, field), seconds = timed(whole)
    return {"seconds": seconds, "u": field[0].values, "note": f"{found.iterations} Newton steps, linear solver PARDISO"}


def with_first_face(mesh: TetMesh, triangles: np.ndarray) -> np.ndarray:
    """The tetrahedra at the given triangles, renumbered so that the triangle is the face of corners 0, 1, 2."""
    keys = {tuple(sorted(triangle)) for triangle in triangles[:, :3].tolist()}
    edge = {frozenset(pair): 4 + k for k, pair in enumerate(TET_EDGES.tolist())}
    rows = []
    for corners in TET_FACES:
        (last,) = set(range(4)) - set(corners.tolist())
        # Faces are oriented outwards; with reversed corners, the opposite corner completes a positive tetrahedron.
        order = [*corners[::-1].tolist(), last]
        local = order + [edge[frozenset((order[i], order[j]))] for i, j in TET_EDGES]
        chosen = [tuple(sorted(face)) in keys for face in mesh.tets[:, corners].tolist()]
        rows.append(mesh.tets[chosen][:, local])
    return np.concatenate(rows)


def wall_region(fem, solid):
    """A FElupe boundary region of the faces ζ = 0 of quadratic tetrahedra, which the library does not have."""
    places, weights = TRIANGLE_RULE
    scheme = fem.quadrature.Scheme(np.column_stack([places, np.zeros(len(places))]), weights)
    region = fem.Region(solid, fem.QuadraticTetra(), scheme, grad=True)
    slope = np.einsum("caI,aJgc->IJgc", solid.points[solid.cells], region.dhdr)
    area = np.cross(slope[:, 1], slope[:, 0], axis=0)
    region.dA = area * weights[:, None]
    region.dV = np.linalg.norm(region.dA, axis=0)
    region.normals = region.dA / region.dV
    return region


def ccx(mesh: TetMesh) -> dict:
    built = build_model(mesh, neo_hookean_rubber(SHEAR, BULK, 1.1e-9), plate=False)
    at = configure(built, mesh.points, build_loads(built, {"A": PRESSURE}))
    os.environ |= {"OMP_NUM_THREADS": "2", "CCX_NPROC_STIFFNESS": "2", "CCX_NPROC_RESULTS": "2"}
    (u, _), seconds = timed(lambda: calculix.equilibrium(mesh, at, increment=1.0, tolerance=TOLERANCE))
    return {"seconds": seconds, "u": u, "note": "SPOOLES"}


SOLVERS = {"pneumorph": ours, "NGSolve": ngsolve, "FElupe": felupe, "CalculiX": ccx}


def timed(function):
    began = time.perf_counter()
    answer = function()
    return answer, time.perf_counter() - began


def alone(name: str, path: str) -> None:
    """Run one solver on a stored mesh and print time, memory and result as JSON."""
    with np.load(path) as stored:
        faces = {key: stored[key] for key in stored.files if key not in ("points", "tets")}
        mesh = TetMesh(stored["points"], stored["tets"], faces)
    found = SOLVERS[name](mesh)
    tip = np.unique(mesh.faces["tip"])
    who = resource.RUSAGE_CHILDREN if name == "CalculiX" else resource.RUSAGE_SELF
    print(
        json.dumps(
            {
                "seconds": found["seconds"],
                "megabytes": resource.getrusage(who).ru_maxrss / 1024,
                "tip_mm": float(found["u"][tip, 2].mean()),
                "note": found["note"],
            }
        )
    )


@dataclass(frozen=True)
class Row:
    """What a solver needed for a number of displacements."""

    unknowns: int
    seconds: float
    megabytes: float


def table(count: int, names: list[str], before: list[dict[str, Row]]) -> dict[str, Row]:
    """Print the line of every solver on a mesh of about so many elements; those that solved it.

    `before` has what they needed on smaller meshes.
    """
    body, size = starting_body(linear_actuator().body), 2.0
    mesh = mesh_body(body, size).mesh
    # The number of elements is not a continuous function of their size.
    while not 0.8 * count < len(mesh.tets) < 1.25 * count:
        size *= (len(mesh.tets) / count) ** (1 / 3.5)
        mesh = mesh_body(body, size).mesh
    print(f"\n{len(mesh.tets)} quadratic tetrahedra, {3 * len(mesh.points)} displacements")
    print(f"{'solver':10s} {'s':>8s} {'ratio':>6s} {'MB':>6s} {'tip, mm':>12s}", flush=True)
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mesh.npz")
        np.savez(path, points=mesh.points, tets=mesh.tets, **mesh.faces)
        for name in names:
            foreseen = by_growth([each[name] for each in before], 3 * len(mesh.points))
            if rows and foreseen > LONGEST:  # the first, which others are compared with, is always tried
                print(f"{name:10s} not tried: by its growth, more than {LONGEST:.0f} s", flush=True)
                continue
            command = [sys.executable, __file__, "--alone", name, str(path)]
            found = outcome(command)
            if isinstance(found, str):
                print(f"{name:10s} {found}", flush=True)
                continue
            rows[name] = Row(3 * len(mesh.points), found["seconds"], found["megabytes"])
            ratio = found["seconds"] / next(iter(rows.values())).seconds
            print(
                f"{name:10s} {found['seconds']:8.2f} {ratio:6.1f} {found['megabytes']:6.0f} "
                f"{found['tip_mm']:12.8f}  {found['note']}",
                flush=True,
            )
    return rows


def by_growth(rows: list[Row], unknowns: int) -> float:
    """Seconds for so many displacements, by the exponent between the last two meshes; 0 where there are no two."""
    if len(rows) < 2:
        return 0.0
    first, last = rows[-2:]
    exponent = np.log(last.seconds / first.seconds) / np.log(last.unknowns / first.unknowns)
    return float(last.seconds * (unknowns / last.unknowns) ** exponent)


def outcome(command: list[str]) -> dict | str:
    """What a solver's process printed, or why it did not."""
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True) as process:
        try:
            said, complaint = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)  # with programs that it started
            return f"more than {LONGEST:.0f} s"
    if process.returncode:
        return (complaint.strip().splitlines() or [f"ended with status {process.returncode}"])[-1]
    return json.loads(said.splitlines()[-1])


def plot(rows: list[dict[str, Row]], picture: str) -> None:
    """Time and memory over unknowns, with their exponents."""
    figure, panels = plt.subplots(1, 2, figsize=(11, 4.2))
    for name in rows[0]:
        line = [each[name] for each in rows if name in each]
        unknowns = [row.unknowns for row in line]
        values = ([row.seconds for row in line], [row.megabytes / 1024 for row in line])
        for panel, column, unit in zip(panels, values, ("s", "GB"), strict=True):
            label = name
            if len(line) > 1:
                label += f", exponent {np.log(column[-1] / column[0]) / np.log(unknowns[-1] / unknowns[0]):.2f}"
            panel.loglog(unknowns, column, "o-", label=label)
            panel.set(xlabel="displacements", ylabel={"s": "one equilibrium, s", "GB": "peak memory, GB"}[unit])
            panel.grid(True, which="both", alpha=0.3)
            panel.legend()
    figure.tight_layout()
    figure.savefig(picture, dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("counts", type=int, nargs="*", default=[8000, 30000])
    parser.add_argument("--plot", metavar="PICTURE")
    asked = parser.parse_args()
    rows, names = [], list(SOLVERS)
    for count in sorted(asked.counts):
        rows.append(table(count, names, rows))
        names = list(rows[-1])
        if asked.plot:
            plot(rows, asked.plot)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--alone"]:
        alone(*sys.argv[2:])
    else:
        main()
