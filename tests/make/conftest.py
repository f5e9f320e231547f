"""Bodies with every kind of end and several chambers, coarse enough to write and read in a second."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.geometry import Body
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import BodySpec


def chamber(name, radius, center, span, ends):
    return {
        "name": name,
        "radius": f"{radius} mm",
        "center": [f"{each} mm" for each in center],
        "span": [f"{each} mm" for each in span],
        "ends": ends,
    }


CHAMBERS = {
    "flat": [chamber("A", 4, (0, 0), (3, 27), "flat")],
    "poles": [chamber("A", 4, (0, 0), (3, 27), "pole")],
    # Beside each other and behind each other, off the axis.
    "several": [
        chamber("left", 2, (-4, 0), (3, 27), "flat"),
        chamber("right-1", 2, (4, 1), (3, 14), "pole"),
        chamber("right-2", 2, (4, 1), (17, 27), "flat"),
    ],
}


@pytest.fixture(params=CHAMBERS)
def body(request):
    return made(request.param)


@pytest.fixture
def bodies():
    """A body of a kind: one of `CHAMBERS`, or "plain", which is without ripple."""
    return made


def made(kind):
    table = {
        "length": "30 mm",
        "radius": "8 mm",
        "chamber": CHAMBERS["flat" if kind == "plain" else kind],
    }
    if kind != "plain":
        table["ripple"] = {"amplitude": "0.4 mm", "period": "10 mm", "lobes": 1}
    start = starting_body(BodySpec.model_validate(table))
    if kind == "plain":
        return start
    # No symmetry of the start is left, but the ends stay planes and the poles points with a tangent plane.
    random = np.random.default_rng(1)
    shaken = []
    for surface in start.surfaces:
        net = surface.net.copy()
        net[2:-2] += random.uniform(-0.1, 0.1, net[2:-2].shape)
        shaken.append(replace(surface, net=net))
    return Body(shaken[0], tuple(shaken[1:]))
