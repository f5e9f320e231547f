"""Tests of other solvers are skipped, with the reason, on machines that do not have them."""

import pytest

from pneumorph.verify import Unavailable


def needs(available):
    """Skip the test where asking for a solver says that it is not installed."""
    try:
        available()
    except Unavailable as reason:
        pytest.skip(str(reason))
