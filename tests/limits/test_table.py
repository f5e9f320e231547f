"""What all limits have in common."""

import numpy as np
import pytest
from certifying import certified
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.limits.of_shape import tube_limits
from pneumorph.limits.table import BY_NAME, ROWS
from pneumorph.problem import Limits


@pytest.mark.parametrize("limit", BY_NAME.values(), ids=lambda limit: limit.name)
@given(bound=st.floats(1e-4, 1e4), beyond=st.floats(1e-6, 1.0))
def test_a_bound_is_a_bound(limit, bound, beyond):
    assert limit.satisfied(bound, bound)
    assert limit.satisfied(bound * (1.0 - limit.sign * beyond), bound)
    assert not limit.satisfied(bound * (1.0 + limit.sign * beyond), bound)


def test_certificates_decide_where_the_optimiser_leaves_designs(make_body, table):
    """The optimiser aims 0.2 % within bounds on distances and meets that to half; there certificates must agree."""
    body = make_body()
    attained = {reading.limit: reading.attained for reading in certified(body, table(wall=3.0, envelope=8.1)).readings}
    within = certified(body, table(wall=0.999 * attained["wall"], envelope=1.001 * attained["envelope"]))
    assert within["wall"].satisfied() and within["envelope"].satisfied()
    beyond = certified(body, table(wall=1.0001 * attained["wall"], envelope=0.9999 * attained["envelope"]))
    assert {"wall", "envelope"} <= {reading.limit for reading in beyond.violated()}


def test_an_envelope_of_planes_is_certified_and_linearised(make_body, table, waved):
    """A box and an oblique half-space that a wavy exterior passes, touches nearly, or stays within."""
    body = make_body(length=30.0)
    body = body.with_control_points(waved(body, 2, wave=0.8))
    q, r = np.linspace(0.0, 1.0, 400, endpoint=False), np.linspace(0.0, 1.0, 1200)
    x = body.exterior.sample(q, r).reshape(-1, 3)
    normal = np.array([1.0, 2.0, 0.5]) / np.sqrt(5.25)
    wide, deep, side = np.abs(x[:, 0]).max(), np.abs(x[:, 1]).max() + 1.0, (x @ normal).max()
    for beyond in (0.15, 0.002, -0.002):
        envelope = {
            "box": [[f"{beyond - wide} mm", f"{-deep} mm", "-1 mm"], [f"{wide - beyond} mm", f"{deep} mm", "31 mm"]],
            "half_space": [{"point": [f"{part} mm" for part in (side - beyond) * normal], "normal": normal.tolist()}],
        }
        spec = Limits.model_validate(table().model_dump(mode="json", exclude_none=True) | {"envelope": envelope})
        found = certified(body, spec)["envelope"]
        assert found.bound == 0.0 and found.satisfied() == (beyond < 0.0)
        assert found.attained - 1e-3 <= beyond <= found.value
        rows = tube_limits(body, spec).rows(body, 0.5, 1e9)
        of_kind = rows.kind == ROWS.index("envelope")
        assert 2.0 * rows.value[of_kind].max() == pytest.approx(beyond, abs=0.05)
    # Smooth, for rows near the bound stand for peaks between samples, whose places change with the form.
    way = 1e-5 * np.sin(body.control_points()[:, [1, 2, 0]] / 8.0)
    moved = tube_limits(body, spec).rows(body.with_control_points(body.control_points() + way), 0.5, 1e9)
    change = moved.value[moved.kind == ROWS.index("envelope")] - rows.value[of_kind]
    assert change == pytest.approx((rows.jacobian @ way.ravel())[of_kind], abs=5e-8)
