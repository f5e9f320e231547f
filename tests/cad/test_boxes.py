"""The nearest places and first hits that trees of boxes find, against every triangle on its own."""

import numpy as np
import pytest
from scipy.optimize import nnls

from pneumorph.cad.boxes import boxes_of, first_hits, nearest

RNG = np.random.default_rng(3)


def scattered(count: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of all shapes about a cube of 10 mm, some of them without area."""
    corners = RNG.uniform(0.0, 10.0, (count, 1, 3)) + size * RNG.normal(size=(count, 3, 3)) * RNG.uniform(
        0.01, 1.0, (count, 1, 1)
    )
    corners[5::17, 2] = corners[5::17, 1]
    corners[7::23] = corners[7::23, :1]
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


@pytest.mark.parametrize(("count", "size"), [(1, 1.0), (3, 5.0), (8, 1.0), (150, 0.5), (150, 6.0)])
def test_no_triangle_is_nearer(count, size):
    points, triangles = scattered(count, size)
    places = RNG.uniform(-5.0, 15.0, (40, 3))
    found = nearest(boxes_of(points, triangles), places)
    away = np.linalg.norm(found.place - places, axis=1)
    corners = points[triangles[found.triangle]]
    # The nearest place of its triangle: no corner lies towards the place.
    onto = np.einsum("ni,nki->nk", places - found.place, corners - found.place[:, None])
    assert onto.max() < 1e-9
    for place, own in zip(found.place, corners, strict=True):
        # A mean of the corners.
        assert nnls(np.vstack([own.T, np.ones(3)]), np.append(place, 1.0))[1] < 1e-9
    one_by_one = [np.linalg.norm(nearest(boxes_of(points, each[None]), places).place - places, axis=1)
                  for each in triangles]  # fmt: skip
    np.testing.assert_allclose(away, np.min(one_by_one, axis=0), rtol=1e-12)


@pytest.mark.parametrize(("count", "size"), [(1, 3.0), (150, 0.5), (150, 6.0)])
def test_no_triangle_is_met_before(count, size):
    points, triangles = scattered(count, size)
    starts, stops = RNG.uniform(-5.0, 15.0, (2, 200, 3))
    stops[:60] = starts[:60]
    stops[:60, 2] += 20.0
    middles = points[triangles].mean(axis=1)[np.arange(60) % count]
    stops[60:120] = 2.0 * middles - starts[60:120]
    found = first_hits(boxes_of(points, triangles), starts, stops)
    shares = np.full((len(starts), count), np.inf)
    for number, (o, e, f) in enumerate(points[triangles]):
        for segment, (start, stop) in enumerate(zip(starts, stops, strict=True)):
            system = np.column_stack([e - o, f - o, start - stop])
            if abs(np.linalg.det(system)) > 1e-12:
                x, y, share = np.linalg.solve(system, start - o)
                if min(x, y, share, 1.0 - x - y, 1.0 - share) >= 0.0:
                    shares[segment, number] = share
    met = np.isfinite(shares.min(axis=1))
    assert met.any() and not met.all()
    np.testing.assert_array_equal(found.triangle, np.where(met, shares.argmin(axis=1), -1))
    expected = starts + shares.min(axis=1, initial=1e3)[:, None] * (stops - starts)
    np.testing.assert_allclose(found.place[met], expected[met], atol=1e-9)
    assert np.isnan(found.place[~met]).all()


def test_flat_surfaces_along_the_axes_are_met():
    """Boxes without thickness, and segments along their sides."""
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0))
    points = np.stack([x.ravel(), y.ravel(), np.full(36, 2.0)], axis=1)
    at = (np.arange(5)[:, None] * 6 + np.arange(5)).ravel()
    triangles = np.concatenate([np.stack([at, at + 1, at + 7], axis=1), np.stack([at, at + 7, at + 6], axis=1)])
    boxes = boxes_of(points, triangles)
    starts = np.array([[2.25, 3.5, 0.0], [0.0, 1.0, 2.0], [7.0, 7.0, 0.0]])
    stops = np.array([[2.25, 3.5, 4.0], [5.0, 1.0, 2.0], [7.0, 7.0, 4.0]])
    found = first_hits(boxes, starts, stops)
    np.testing.assert_array_equal(found.triangle >= 0, [True, False, False])
    np.testing.assert_allclose(found.place[0], [2.25, 3.5, 2.0])
    np.testing.assert_allclose(nearest(boxes, stops).place[2], [5.0, 5.0, 2.0])
