"""What tests of the page's part in JavaScript read is what the Python reader says."""

import json

import numpy as np
from models import PATH, told


def same(one, other):
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            same(one[key], other[key])
    elif isinstance(one, list) and one and isinstance(one[0], dict):
        assert len(one) == len(other)
        for pair in zip(one, other, strict=True):
            same(*pair)
    elif isinstance(one, list) and one and not isinstance(one[0], str):
        # Libraries of linear algebra round differently.
        np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9)
    elif isinstance(one, float):
        assert abs(one - other) <= 1e-7 * max(abs(one), 1.0)
    else:
        assert one == other


def test_the_file_of_the_model_is_what_the_reader_says():
    same(json.loads(PATH.read_text(encoding="utf-8")), told())
