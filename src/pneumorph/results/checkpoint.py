"""Check of a stored checkpoint: the arrays from which the design loop resumes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pneumorph.mesh.tets import TetMesh
from pneumorph.problem import Problem
from pneumorph.results.arrays import floats, indices
from pneumorph.results.fields import check_elements, unpack_mesh

_FLAT = 1e-12
"""Volume over the cube of the longest edge up to which an element counts as flat; `mesh_body` allows none near it."""


def check(problem: Problem, state: Mapping[str, Any]) -> None:
    """Check that a state is one from which the design loop can resume: kernels do not ask whether indices are in range.

    Raises
    ------
    KeyError, ValueError
        If it is not.
    """
    n = len(floats(state, "phi", None))
    mesh = unpack_mesh(state, "mesh_straight", "mesh_tets")
    _check_straight(mesh)
    controls = len(floats(state, "mesh_points", None, 3))
    entries = len(floats(state, "mesh_B_data", None))
    indices(state, "mesh_B_indices", entries, below=controls)
    starts = indices(state, "mesh_B_indptr", None, below=entries + 1)
    if not 2 <= len(starts) <= len(mesh.points) + 1 or starts[0] != 0 or starts[-1] != entries:
        raise ValueError('"mesh_B_indptr" does not fit the mesh')
    if (np.diff(starts.astype(np.int64)) < 0).any():
        raise ValueError('"mesh_B_indptr" falls')
    for name in ("mesh_fresh", "mesh_shift"):
        if name in state:
            floats(state, name, len(mesh.points), 3)
    if "mesh_fresh" in state:
        check_elements(mesh.at(state["mesh_fresh"]))
    if "mesh_halved" in state:
        floats(state, "mesh_halved", len(mesh.tets))
    if "mesh_offset" in state:
        floats(state, "mesh_offset", len(starts) - 1, 3)
    for name in state:
        if name.startswith("param "):
            floats(state, name, None, 6, 2, most=2.0)
        if name.startswith("moved "):
            floats(state, name, len(mesh.points), 3)
            floats(state, f"state {name.removeprefix('moved ')}", None)
        if name.startswith("changed "):
            floats(state, name)
    for task in problem.task:
        # That of a task with the pressures of another may be missing: it was added since.
        if task.pressures_of is None or f"state {task.name}" in state:
            floats(state, f"state {task.name}", None)
        for name in ("at rest", "limit state", "limit pressure"):
            if f"{name} {task.name}" in state:
                floats(state, f"{name} {task.name}", None)
        if f"limit {task.name}" in state:
            floats(state, f"limit {task.name}", 3)
    for name, shape in (("phi", (None,)), ("slope", (None,)), ("steps", (None, n)), ("changes", (None, n))):
        if "curvature_phi" in state:
            floats(state, f"curvature_{name}", *shape)
    for name in ("mesh_size", "radius", "dfp_iterations"):
        if name in state or name != "dfp_iterations":
            floats(state, name)
    # Earlier versions called multipliers prices.
    for name in ("multipliers", "prices"):
        if name in state:
            floats(state, name, None, None)
    if "dfp_slope" in state:
        floats(state, "dfp_slope", None)
    floats(state, "values", None)
    if "looked" in state and floats(state, "looked", None).shape not in ((0,), (len(problem.task),)):
        raise ValueError('"looked" does not fit the tasks')
    indices(state, "iteration", below=10**9)


def _check_straight(mesh: TetMesh) -> None:
    """ValueError if elements are flat while their edges are straight: they have no gradients.

    Some of a sound mesh are inverted while straight, see `mesh_body`.
    """
    corners = mesh.points[mesh.tets[:, :4]]
    edges = corners[:, 1:] - corners[:, :1]
    # Written so that elements whose corners coincide fail.
    if not (np.abs(np.linalg.det(edges)) > _FLAT * np.abs(edges).max(axis=(1, 2)) ** 3).all():
        raise ValueError("the mesh has elements without volume")
