"""Splines for outlines of sections: near to them, symmetric as they are, and nowhere bent more."""

import numpy as np
import pytest
from pydantic import TypeAdapter

from pneumorph.geometry.bspline import periodic
from pneumorph.geometry.tube.fitted import fitted
from pneumorph.problem.section import Section

SECTIONS = {
    "rectangle": {"kind": "rectangle", "width": "20 mm", "depth": "26 mm", "corner": "2.5 mm"},
    "slot": {"kind": "rectangle", "width": "3 mm", "depth": "16 mm", "corner": "1.4 mm"},
    "half-round": {"kind": "half-round", "round_radius": "12 mm", "corner": "2.5 mm"},
    "cross": {
        "kind": "points",
        "points": [[f"{x} mm", f"{y} mm"] for x, y in
                   [(9, -3), (9, 3), (3, 3), (3, 9), (-3, 9), (-3, 3), (-9, 3), (-9, -3), (-3, -3), (-3, -9), (3, -9),
                    (3, -3)]],
        "corner": "1.5 mm",
    },
}  # fmt: skip


def outline_of(keys):
    return TypeAdapter(Section).validate_python(keys).outline


@pytest.mark.parametrize("density", [0.4, 0.8, 1.6])
@pytest.mark.parametrize("name", SECTIONS)
def test_a_spline_is_bent_no_more_than_its_outline(name, density):
    outline = outline_of(SECTIONS[name])
    basis = periodic(4 * round(density * outline.length / 4))
    points, at = fitted(outline, basis), np.arange(2000) / 2000
    (x, y), (xx, yy) = (basis.matrix(at, 1) @ points).T, (basis.matrix(at, 2) @ points).T
    assert (np.abs(x * yy - y * xx) / np.hypot(x, y) ** 3).max() < 1.04 * outline.curvature
    # The fewer control points there are, the less of an arc of a corner they can follow.
    assert outline.distances(basis.matrix(at) @ points).max() < 0.08 / density**1.5
    mirrored = basis.matrix(-at % 1.0) @ points * [1.0, -1.0]
    np.testing.assert_allclose(mirrored, basis.matrix(at) @ points, atol=1e-10)


def test_a_gentle_outline_is_fitted_best():
    """Where the nearest spline does not overshoot, it is kept."""
    outline = outline_of({"kind": "rectangle", "width": "20 mm", "depth": "20 mm", "corner": "9.99 mm"})
    basis, at = periodic(64), np.arange(1024) / 1024
    nearest = np.linalg.lstsq(basis.matrix(at), outline.at(at), rcond=None)[0]
    np.testing.assert_allclose(fitted(outline, basis), nearest, atol=2e-3)
