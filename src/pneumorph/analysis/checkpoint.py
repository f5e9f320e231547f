"""What the design loop needs to resume after an interruption: the design, its mesh and its states, as plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
from scipy import sparse

from pneumorph.analysis.analyse import Analysis, Discretisation, analyse, build_discretisation
from pneumorph.analysis.ballooning import FARTHEST
from pneumorph.analysis.castings import Casting, casting_name
from pneumorph.errors import ProblemError
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.mechanics import NoEquilibrium, Tangent
from pneumorph.mesh.morph import build_morph
from pneumorph.mesh.tets import TetMesh
from pneumorph.problem import Problem
from pneumorph.results.fields import check_elements, pack_caps, pack_covers, unpack_caps, unpack_covers
from pneumorph.sensitivity import Margin


def pack(analysis: Analysis, disc: Discretisation) -> dict[str, Any]:
    """Arrays from which `unpack` restores the design, its mesh and its equilibria."""
    carrier = disc.morph
    arrays = {
        "phi": analysis.phi,
        "mesh_points": disc.built_at,
        "mesh_straight": carrier.reference,
        "mesh_fresh": carrier.mesh.points,
        "mesh_shift": carrier.shift,
        "mesh_tets": carrier.mesh.tets,
        "mesh_size": carrier.size,
        "mesh_B_data": carrier.B.data,
        "mesh_B_indices": carrier.B.indices,
        "mesh_B_indptr": carrier.B.indptr,
    }
    if carrier.offset.any():
        arrays["mesh_offset"] = carrier.offset
    if carrier.mesh.halved is not None:
        arrays["mesh_halved"] = carrier.mesh.halved
    arrays |= {f"region {name}": elements for name, elements in carrier.mesh.regions.items()}
    arrays |= {f"face {name}": triangles for name, triangles in carrier.mesh.faces.items()}
    for task, castings in disc.castings.items():
        for number, (casting, solved) in enumerate(zip(castings, analysis.castings[task], strict=True)):
            name = casting_name(task, number)
            arrays |= {f"moved {name}": casting.motion, f"state {name}": disc.model.vector(solved.equilibrium.state)}
            arrays |= {f"changed {name}: {cause}": change for cause, change in casting.changes.items()}
    arrays |= pack_covers(carrier.mesh) | pack_caps(carrier.mesh)
    arrays |= {f"param {name}": values for name, values in carrier.param.items()}
    arrays |= {
        f"state {name}": disc.model.vector(equilibrium.state) for name, equilibrium in analysis.equilibria.items()
    }
    return arrays | _pack_limit_points(analysis, disc)


def _pack_limit_points(analysis: Analysis, disc: Discretisation) -> dict[str, Any]:
    """Those of the tasks, which take long to find: λ, its estimate and whether it is known; pressures and state."""
    arrays: dict[str, Any] = {}
    for task in analysis.equilibria:
        ahead = analysis.limit_points.get(task)
        if ahead is None:
            continue
        arrays[f"limit {task}"] = np.array([ahead.load, min(ahead.estimate, FARTHEST), ahead.known])
        if ahead.state is not None:
            arrays[f"limit state {task}"] = disc.model.vector(ahead.state)
            arrays[f"limit pressure {task}"] = np.array([ahead.pressures[name] for name in disc.model.chambers])
    return arrays


def _limit_points(disc: Discretisation, arrays: dict[str, Any]) -> dict[str, Margin]:
    """What `_pack_limit_points` packed."""
    found = {}
    for task in disc.tangents:
        if (numbers := arrays.get(f"limit {task}")) is None:
            continue
        load, estimate, known = map(float, numbers)
        found[task] = Margin(load, None, estimate, known=bool(known))
        if (vector := arrays.get(f"limit state {task}")) is not None:
            pressures = dict(zip(disc.model.chambers, map(float, arrays[f"limit pressure {task}"]), strict=True))
            found[task] = replace(found[task], state=disc.model.state(np.asarray(vector)), pressures=pressures)
    return found


def unpack(
    problem: Problem, space: DesignSpace, arrays: dict[str, Any], heights: Sequence[float] = ()
) -> tuple[Discretisation, Analysis]:
    """Restore a mesh and the analysed design from the arrays of `pack`.

    Parameters
    ----------
    problem : Problem
        Of the run.
    space : DesignSpace
        Its design space, of n variables.
    arrays : dict of arrays
        What `pack` made.
    heights : sequence of float
        Of planes across the axis in which nodes stay, mm.

    Raises
    ------
    ProblemError
        If the number of design variables has changed since, the mesh does not fit the problem, or an equilibrium is not
        found again.
    """
    if len(arrays["phi"]) != space.n:
        raise ProblemError(
            f"the run was made with {len(arrays['phi'])} design variables, but this version of pneumorph has {space.n} "
            "for the same problem; start the run again in another directory"
        )
    points = arrays["mesh_points"]
    faces = {name.removeprefix("face "): value for name, value in arrays.items() if name.startswith("face ")}
    regions = {name.removeprefix("region "): value for name, value in arrays.items() if name.startswith("region ")}
    param = {name.removeprefix("param "): value for name, value in arrays.items() if name.startswith("param ")}
    B = sparse.csr_array(
        (arrays["mesh_B_data"], arrays["mesh_B_indices"], arrays["mesh_B_indptr"]),
        shape=(len(arrays["mesh_B_indptr"]) - 1, len(points)),
    )
    caps = unpack_caps(arrays, faces, len(arrays["mesh_straight"]))
    covers, halved = unpack_covers(arrays), arrays.get("mesh_halved")
    straight = TetMesh(arrays["mesh_straight"], arrays["mesh_tets"], faces, regions, covers, caps, halved)
    offset = arrays.get("mesh_offset", np.zeros((len(B.indptr) - 1, 3)))
    try:
        morph = build_morph(straight, B, offset, points, float(arrays["mesh_size"]), param, heights)
        if "mesh_shift" in arrays:
            morph = replace(morph, mesh=morph.mesh.at(arrays["mesh_fresh"]), shift=arrays["mesh_shift"])
        check_elements(morph.at(space.control_points(arrays["phi"])))
        disc = build_discretisation(problem, morph, points)
        castings = _castings(problem, disc, arrays)
        disc = replace(disc, castings={task: tuple(own.values()) for task, own in castings.items()})
        # Tasks with the pressures of others may be new.
        known = [each.name for each in problem.task if each.pressures_of is None or f"state {each.name}" in arrays]
        names = [*known, *(name for own in castings.values() for name in own)]
        starts = {name: disc.model.state(np.asarray(arrays[f"state {name}"])) for name in names}
        points = _limit_points(disc, arrays)
    # It is a mesh, but not one of this problem.
    except (ArithmeticError, KeyError, RuntimeError, ValueError) as error:
        raise ProblemError(
            f"the checkpoint does not fit its problem ({error}); start the run again in another directory"
        ) from None
    analysis = analyse(problem, space, disc, arrays["phi"], starts)
    if isinstance(analysis, NoEquilibrium):
        raise ProblemError(f"the checkpoint's design cannot be analysed again: {analysis.reason}")
    return disc, replace(analysis, limit_points=points) if points else analysis


def _castings(problem: Problem, disc: Discretisation, arrays: dict[str, Any]) -> dict[str, dict[str, Casting]]:
    """The perturbed castings, by task and name."""
    castings: dict[str, dict[str, Casting]] = {}
    for task in problem.task:
        for number in count():
            if (moved := f"moved {(name := casting_name(task.name, number))}") not in arrays:
                break
            key = f"changed {name}: "
            changes = {each.removeprefix(key): float(arrays[each]) for each in arrays if each.startswith(key)}
            castings.setdefault(task.name, {})[name] = Casting(changes, arrays[moved], Tangent(disc.model))
    return castings
