"""The table of limits."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph.limits.table import BY_NAME


@pytest.mark.parametrize("limit", BY_NAME.values(), ids=lambda limit: limit.name)
@given(bound=st.floats(1e-4, 1e4), slack=st.floats(0.1, 4.0))
def test_what_is_certified_to_be_needed_is_held(limit, bound, slack):
    assert limit.excess(limit.needed(bound, slack), bound) <= slack * limit.tolerance
    assert limit.excess(limit.needed(bound, slack), bound) == pytest.approx(slack * limit.tolerance, rel=1e-5)
