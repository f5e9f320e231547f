"""Balloons of two rubbers whose sheets were blown up (Treloar 1944; Meunier and others 2008).

The pole of a sheet that is blown up is stretched alike in all directions, as a spherical balloon is everywhere. So the
nominal stress S measured there at a stretch λ is that of a thin balloon under p = 2 (t/r) S/λ², with the wall t and the
radius r at rest. The balloon's rubber is that of a tension test alone. The volume of air is given, since pressures fall
beyond a stretch of about 1.4; a quarter is solved.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import Equilibrium, Tangent, configure, enclosed_of, loads_of, model_of, part_of, sweep
from pneumorph.mechanics.material.fit import TensionTest
from pneumorph.mechanics.material.homogeneous import first_invariant, stretch_at
from pneumorph.mechanics.material.judge import as_good_in, fit_all
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.validation.comparison import Comparison
from pneumorph.validation.tables import problem_of, table_of

SHEETS: Mapping[str, str] = {"silicone": "silicone", "natural": "natural", "natural_moderate": "natural"}
"""The rubbers of the problem files, and whose sheet was measured."""

MODERATE = ("natural_moderate",)
"""Rubbers of part of a tension test; beyond it, that of the whole test is compared."""

RADIUS, WALL = 20.0, 1.0
"""Of the balloon at rest, mm, the radius that of the middle of its wall."""

SIZE, QUICK = 5.0, 8.0
"""Of elements, mm. The prediction is that with half of this size, and the difference between both its mesh part."""

MODE = "equibiaxial"


def balloons(quick: bool = False) -> Iterator[Comparison]:
    """Pressures at all stretches of the measurement, with every rubber, as far as its tension test goes and beyond.

    Parameters
    ----------
    quick : with large elements.
    """
    table = table_of("balloon")
    for rubber, sheet in SHEETS.items():
        size = QUICK if quick else SIZE
        coarse, fine = (problem_of("balloon", rubber, each) for each in (size, size / 2.0))
        test = tension(fine, sheet)
        until = stretch_at(float(first_invariant(test.stretch.max(), test.mode)), MODE)
        own = table[(table["rubber"] == sheet) & (table["stretch"] > 1.0)]
        if rubber in MODERATE:
            own = own[own["stretch"] <= until]
        stretch, stress = own["stretch"], own["nominal_stress_MPa"]
        before, ended = filled(coarse, volumes_at(stretch))
        pressures, reason = filled(fine, volumes_at(stretch[: len(before)]))
        found = len(pressures)
        stretch, measured = stretch[:found], 2 * WALL / RADIUS * stress[:found] / stretch[:found] ** 2
        parts = (
            (fine.material.scatter or 0.0) * pressures,
            spread(test, stretch) * pressures,
            pressures - before[:found],
        )
        error = np.linalg.norm(parts, axis=0)
        inside = stretch <= until
        for case, chosen in (("within the tension test", inside), ("beyond it", ~inside)):
            if chosen.any() or (chosen is inside and not found):
                yield Comparison(
                    body="balloon",
                    rubber=fine.material.name,
                    quantity="pressure",
                    unit="kPa",
                    case=case,
                    along="stretch",
                    at=stretch[chosen],
                    measured=1e3 * measured[chosen],
                    scatter=np.zeros(chosen.sum()),
                    predicted=1e3 * pressures[chosen],
                    error=1e3 * error[chosen],
                    fitted=np.zeros(chosen.sum(), bool),
                    missing=(reason or ended) if chosen[-1:].all() else "",
                )


def tension(problem: Problem, sheet: str) -> TensionTest:
    """The tension test of a sheet's rubber, as far as the rubber of a problem was fitted to it."""
    table = table_of("balloon_tension")
    own = table[(table["rubber"] == sheet) & (table["stretch"] <= (problem.material.valid_stretch or np.inf))]
    return TensionTest(own["stretch"], own["nominal_stress_MPa"])


def spread(test: TensionTest, stretch: np.ndarray) -> np.ndarray:
    """Half of what models that fit a tension test as well as the best differ by in a balloon, over its stress (n,).

    Parameters
    ----------
    test : TensionTest
    stretch : (n,) of the balloon.
    """
    fits = fit_all([test])
    stresses = np.array([one.stress(stretch, MODE) for one in as_good_in(fits, MODE)])
    return np.ptp(stresses, axis=0) / 2.0 / stresses[0]


def volumes_at(stretch: np.ndarray) -> np.ndarray:
    """Air in mm³ (n,) that is added until the middle of a spherical wall has the stretches (n,).

    The wall within its middle keeps its volume, so that the air grows as the sphere of the middle does.
    """
    return 4.0 / 3.0 * np.pi * RADIUS**3 * (stretch**3 - 1.0)


def filled(problem: Problem, volumes: np.ndarray) -> tuple[np.ndarray, str]:
    """Pressures in MPa (m,) at volumes of air, and why there are no more; empty if there is one at every volume.

    Parameters
    ----------
    problem : of the balloon.
    volumes : (n,) of air that is added, one after another, mm³.
    """
    under = acting(problem, problem.task[0])
    mesh = mesh_of(problem, body_of(problem), part_of(problem, [{"A": 0.0}], [under])).mesh
    model = model_of(problem, mesh)
    loads = loads_of(problem, model, {"A": 0.0}, under=under)
    path = [configure(model, mesh.points, loads, enclosed=enclosed_of(problem, {"A": each})) for each in volumes]
    found = []
    for answer in sweep(path, Tangent(model)):
        if not isinstance(answer, Equilibrium):
            return np.array(found), answer.reason
        found.append(answer.enclosed["A"])
    return np.array(found), ""
