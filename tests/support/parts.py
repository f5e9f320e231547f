"""Symmetric tubes with chambers, of which a part is meshed and solved in place of the whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import (
    NoEquilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    part_of,
    solve,
    whole_of,
)
from pneumorph.mesh.tets import TetMesh
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import Problem

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)
SILICONE = neo_hookean_rubber(0.49, 4.9e3, 1.1e-9)


def around(turns: int, radius: float, begin: float = 0.0) -> tuple[tuple[float, float], ...]:
    """Places on a circle around the axis, from an angle on, mm."""
    angle = begin + 2.0 * np.pi * np.arange(turns) / turns
    return tuple((float(radius * np.cos(a)), float(radius * np.sin(a))) for a in angle)


def symmetric(
    symmetry: Mapping[str, Any],
    centres: Sequence[tuple[float, float]] = ((0, 0),),
    radius: float = 4.0,
    length: float = 24.0,
    ends: str = "flat",
    body: Mapping[str, Any] | None = None,
    **others: Any,
) -> Problem:
    """A tube whose chambers A, B, … end 3 mm before its own ends, under 60 kPa in each.

    `body` are more keys of the body, and `others` further tables, or the pressure, motion or objective of the task.
    """
    chambers = [
        {
            "name": name,
            "radius": f"{radius} mm",
            "center": [f"{x} mm", f"{y} mm"],
            "span": ["3 mm", f"{length - 3} mm"],
            "ends": ends,
        }
        for name, (x, y) in zip("ABCD", centres, strict=False)
    ]
    motion = {"kind": "maximize", "motion": others.pop("motion", "extension")}
    task = {
        "name": "one",
        "pressure": others.pop("pressure", {chamber["name"]: "60 kPa" for chamber in chambers}),
        "objective": others.pop("objective", motion),
    }
    tube = {"length": f"{length} mm", "radius": "8 mm", "chamber": chambers, "symmetry": dict(symmetry)}
    tables = {"material": {"name": "Hei-Cast 8400"}, "body": tube | dict(body or {}), "task": [task]}
    return Problem.model_validate(tables | others)


def perturbed(asked: Problem):
    """The design space of a problem and a design Φ whose body is symmetric, but no tube of revolution."""
    space = build_design_space(asked, starting_body(asked.tubes))
    return space, space.start + 0.05 * np.random.default_rng(0).normal(size=space.n)


def part_mesh(asked: Problem) -> TetMesh:
    """The part of that body that is solved, in elements of 6 mm."""
    space, phi = perturbed(asked)
    return mesh_body(space.body(phi), 6.0, part_of(asked)).mesh


def solved_both(mesh: TetMesh, plate: bool, mixed: bool, weight: np.ndarray, wrench: np.ndarray):
    """The equilibrium of a part with its configuration and tangent, the whole body, and the equilibrium of that."""
    part = build_model(mesh, SILICONE if mixed else RUBBER, plate, mixed=mixed)
    carried = (np.array([0.3, 0.2, 0.5, 10, 20, 5]), wrench) if plate else (None, None)
    acting = build_loads(part, dict.fromkeys(part.chambers, 0.05), weight, *carried)
    at, tangent = configure(part, mesh.points, acting), Tangent(part)
    found = solve(at, tangent, tolerance=1e-12)
    assert not isinstance(found, NoEquilibrium), found
    whole = whole_of(part, mesh)
    there = whole.configuration(at)
    both = solve(there, whole.tangent, tolerance=1e-12)
    assert not isinstance(both, NoEquilibrium), both
    return (at, tangent, found), whole, (there, both)


def check_pullback(morph, points: int) -> None:
    """Whether the pullback of a morph of a body with so many control points is the transpose of its push."""
    rng = np.random.default_rng(2)
    dP, dX = rng.normal(size=(points, 3)), rng.normal(size=morph.mesh.points.shape)
    there, back = np.sum(morph.push(dP) * dX), np.sum(dP * morph.pullback(dX))
    assert abs(there - back) < 1e-12 * np.linalg.norm(dP) * np.linalg.norm(dX)
