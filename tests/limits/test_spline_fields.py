"""Fields on a grid by the few control points that affect each sample, against whole matrices of B-splines."""

import numpy as np
import pytest

from pneumorph.limits.tube.measures.grid import SampledFields, grid


@pytest.mark.parametrize("ends", ["flat", "pole"])
def test_fields_equal_products_with_whole_matrices(make_body, waved, ends):
    body = make_body(chambers=((4.0, (0.0, 0.0), (3.0, 21.0), ends),))
    body = body.with_control_points(waved(body, 0, wave=1.0))
    for surface in body.surfaces:
        samples = grid(surface, (4, 8))
        orders = ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0))
        found = SampledFields(*samples.combine(surface.net, samples.local_r, orders))
        for one, other in zip(found, samples.fields(surface.net), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11 * np.abs(other).max())
        for of, part in enumerate(samples.frame[:4]):
            along = part @ np.moveaxis(surface.net, 2, 0)
            (one,) = samples.combine(surface.net, samples.local_frame, ((of, 1),))
            other = along @ samples.values_q[1].T
            np.testing.assert_allclose(one, other, atol=1e-11 * np.abs(other).max())
