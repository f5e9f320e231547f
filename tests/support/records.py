"""Results of designs and sweeps with plausible values, to be changed by name."""

from dataclasses import replace

import numpy as np

from pneumorph.mesh import TetMesh
from pneumorph.results import Fields, HistoryEntry, TaskResult

TASK = TaskResult(
    pressures={"A": 0.06},
    objective=-0.1,
    errors={},
    translation=(0.0, 0.0, 0.1),
    rotation=(0.0, 0.0, 0.0),
    section_positions=(),
    section_rotations=(),
    volumes={"A": 900.0},
    max_stretch=1.1,
    beyond_validity=False,
    stable=True,
)

ENTRY = HistoryEntry(
    iteration=0,
    objective=-0.1,
    tasks={"extend": TASK},
    limits={
        "wall_mm": 3.0,
        "fold_mm": 2.0,
        "curvature": 0.1,
        "skew": 0.0,
        "stretch": 0.01,
        "envelope_mm": None,
        "margin": 1.4,
    },
    held=True,
    elements=100,
    dofs=1000,
    factorisations=3,
    seconds={"geometry": 1.0, "equilibrium": 2.0, "gradient": 0.5, "subproblem": 1.0, "total": 4.5},
    equivalents=9.0,
    remeshed=False,
)


def task_result(**changes) -> TaskResult:
    return replace(TASK, **changes)


def entry(iteration: int, **changes) -> HistoryEntry:
    return replace(ENTRY, iteration=iteration, **changes)


def one_element() -> Fields:
    """Fields on a single tetrahedron."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    ends = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
    points = np.concatenate([corners, corners[ends].mean(axis=1)])
    faces = {"base": np.array([[0, 2, 1, 6, 5, 4]])}
    u = 0.1 * points
    return Fields(TetMesh(points, np.arange(10)[None], faces), {"extend": u}, {"extend": np.full(10, 1.1)})
