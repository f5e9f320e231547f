"""Bars of two rubbers, one after the other and side by side, whose ends stay plane, in uniaxial tension."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.optimize import root_scalar

from pneumorph.geometry import Body
from pneumorph.geometry.starting import body_of
from pneumorph.geometry.tube.level import build_levels
from pneumorph.geometry.tube.wedge import build_wedges
from pneumorph.mechanics import Tangent, build_loads, build_model, configure, neo_hookean_rubber
from pneumorph.mesh import TetMesh
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import Problem
from pneumorph.problem.regions import REST
from pneumorph.verify.homogeneous import UNIAXIAL, homogeneous, neo_hookean
from pneumorph.verify.prescribed import equilibrium, prescribed, residual
from pneumorph.verify.verdict import Verdict, absolute, relative

RADIUS, LENGTH, BORE = 4.0, 48.0, 2.0
SOFT, STIFF, RATIO = 0.3, 0.9, 10.0
"""Shear moduli in MPa, and the bulk moduli over these: both rubbers narrow alike at one stretch."""


def in_series(size: float = 1.6, tolerance: float = 3e-4) -> Iterator[Verdict]:
    """Another rubber beyond a plane: half way along each part, two diameters and more from the plane, it is alone."""
    height = LENGTH / 2.0
    X, u, force = _pulled({"beyond": f"{height} mm"}, ("xz", "yz"), size, 1.3)
    for word, shear, middle in (("soft", SOFT, 0.5 * height), ("stiff", STIFF, 1.5 * height)):
        within = np.abs(X[:, 2] - middle) < 0.2 * height
        ours = 1.0 + float(np.polyfit(X[within, 2], u[within, 2], 1)[0])
        exact = _stretch(shear, force / (np.pi * RADIUS**2))
        yield relative(f"strain of the {word} part", ours - 1.0, exact - 1.0, tolerance)


def side_by_side(size: float = 2.0, tolerance: float = 3e-4) -> Iterator[Verdict]:
    """Another rubber within a third of a turn: both have one homogeneous deformation, and the forces add up."""
    for stretch in (0.9, 1.3):
        X, u, force = _pulled({"within": ["-60 deg", "60 deg"]}, (), size, stretch)
        exact = np.pi * RADIUS**2 * (2.0 * _stress(SOFT, stretch) + _stress(STIFF, stretch)) / 3.0
        yield relative(f"force at stretch {stretch:g}, N", force, exact, tolerance)
        side = homogeneous(RATIO * SOFT, neo_hookean(SOFT), UNIAXIAL, stretch)[0][1]
        away = u - X * [side - 1.0, side - 1.0, stretch - 1.0]
        yield absolute(
            f"largest deviation from the homogeneous displacement at stretch {stretch:g} / largest displacement",
            float(np.abs(away).max() / np.abs(u).max()),
            0.0,
            0.05 * tolerance,
        )


def _stress(shear: float, stretch: float) -> float:
    """The nominal stress of uniaxial tension, MPa."""
    return homogeneous(RATIO * shear, neo_hookean(shear), UNIAXIAL, stretch)[1]


def _stretch(shear: float, stress: float) -> float:
    """The stretch of uniaxial tension at a nominal stress in MPa."""
    return root_scalar(lambda stretch: _stress(shear, stretch) - stress, bracket=(1.0, 3.0), xtol=1e-14).root


def _pulled(
    shape: dict[str, Any], mirrors: tuple[str, ...], size: float, stretch: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Nodes (N, 3) and displacements (N, 3) of the bar, and the force of the whole of it, N."""
    mesh = _bar(shape, mirrors, size)
    X = mesh.points
    base, tip = np.abs(X[:, 2]) < 1e-9, np.abs(X[:, 2] - LENGTH) < 1e-9
    supports = np.zeros(X.shape, bool)
    supports[base | tip, 2] = True
    # It narrows freely, about its axis.
    axis = np.linalg.norm(X, axis=1).argmin()
    rim = np.linalg.norm(X - [RADIUS, 0.0, 0.0], axis=1).argmin()
    supports[axis, :2] = supports[rim, 1] = True
    rubbers = {name: neo_hookean_rubber(shear, RATIO * shear, 1e-9) for name, shear in ((REST, SOFT), ("other", STIFF))}
    model = build_model(mesh, rubbers, plate=False, supports=supports)
    at = configure(model, X, build_loads(model, {}))
    side = homogeneous(RATIO * SOFT, neo_hookean(SOFT), UNIAXIAL, stretch)[0][1]
    start = X * [side - 1.0, side - 1.0, stretch - 1.0]
    solution = equilibrium(at, Tangent(model), prescribed(at, start))
    forces = np.asarray(model.state(residual(at, solution)).u)
    return X, np.asarray(model.state(solution).u), 2.0 ** len(mirrors) * float(forces[tip, 2].sum())


def _bar(shape: dict[str, Any], mirrors: tuple[str, ...], size: float) -> TetMesh:
    """A bar without chambers, or half or a quarter of it, with the region "other"."""
    rubber = {"model": "neo-hookean", "shear_modulus": "1 MPa", "bulk_modulus": "9 MPa", "density": "1 g/cm^3"}
    chamber = {"name": "A", "radius": f"{BORE} mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", f"{LENGTH - 3} mm"]}
    problem = Problem.model_validate(
        {
            "material": rubber,
            "region": [{"name": "other", "material": rubber, **shape}],
            "body": {
                "length": f"{LENGTH} mm",
                "radius": f"{RADIUS} mm",
                "control_density": "1.2 /mm",
                "chamber": [chamber],
            },
            "task": [{"name": "one", "pressure": {"A": "0 kPa"}, "objective": {"motion": "extension"}}],
        }
    )
    # No file has a body without chambers.
    body = Body(body_of(problem).exterior, ())
    levels, wedges = build_levels(problem.tubes, problem.region), build_wedges(problem.tubes, problem.region)
    return mesh_body(body, size, mirrors, (), (), levels, wedges).mesh
