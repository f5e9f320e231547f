"""What all limits have in common."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.limits.of_shape import certified
from pneumorph.limits.table import BY_NAME


@pytest.mark.parametrize("limit", BY_NAME.values(), ids=lambda limit: limit.name)
@given(bound=st.floats(1e-4, 1e4), beyond=st.floats(1e-6, 1.0))
def test_a_bound_is_a_bound(limit, bound, beyond):
    assert limit.satisfied(bound, bound)
    assert limit.satisfied(bound * (1.0 - limit.sign * beyond), bound)
    assert not limit.satisfied(bound * (1.0 + limit.sign * beyond), bound)


def test_certificates_decide_where_the_optimiser_leaves_designs(make_body, table):
    """The optimiser aims 0.2 % within bounds on distances and meets that to half; there certificates must agree."""
    body = make_body()
    attained = {reading.limit: reading.seen for reading in certified(body, table(wall=3.0, envelope=8.1)).readings}
    within = certified(body, table(wall=0.999 * attained["wall"], envelope=1.001 * attained["envelope"]))
    assert within["wall"].satisfied() and within["envelope"].satisfied()
    beyond = certified(body, table(wall=1.0001 * attained["wall"], envelope=0.9999 * attained["envelope"]))
    assert {"wall", "envelope"} <= {reading.limit for reading in beyond.violated()}
