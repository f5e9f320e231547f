"""The table of the envelope: its forms, what is refused, and the symmetry that it must have."""

import numpy as np
import pytest
from texts import problem_text

from pneumorph.errors import ProblemError
from pneumorph.limits.kinds.region import ENVELOPE, within_envelope
from pneumorph.problem import loads

REST = (
    '[[task]]\nname = "t"\npressure = { A = "10 kPa" }\nobjective = { kind = "maximize", motion = "extension" }\n'
    "[limits]\nenvelope = "
)


def problem(envelope, body=""):
    return loads(problem_text(REST + envelope, 30, body=body))


def test_every_form_is_a_region():
    rng = np.random.default_rng(0)
    x = rng.uniform([-15, -15, -5], [15, 15, 35], (500, 3))
    radius = np.hypot(x[:, 0], x[:, 1]) - 12.0
    box = np.maximum(np.abs(x - [0.0, 1.0, 15.0]) - [11.0, 10.0, 16.0], -np.inf).max(axis=1)
    side = (x[:, 1] + x[:, 0]) / np.sqrt(2.0) - 9.0
    forms = {
        'radius = "12 mm"': radius,
        'box = [["-11 mm", "11 mm", "-1 mm"], ["11 mm", "-9 mm", "31 mm"]]': box,
        'half_space = [{ point = ["9 mm", "3.7279220613578552 mm", "5 mm"], normal = [2, 2, 0] }]': side,
    }
    for text, beyond in forms.items():
        limits = problem("{ " + text + " }").limits
        np.testing.assert_allclose(within_envelope(limits, 30.0).beyond(x), beyond, atol=1e-9)
        assert ENVELOPE.bound(limits) == (12.0 if "radius" in text else 0.0)
    whole = problem("{ " + ", ".join(forms) + " }").limits
    np.testing.assert_allclose(within_envelope(whole, 30.0).beyond(x), np.max([radius, box, side], axis=0), atol=1e-9)
    again = loads(problem("{ " + ", ".join(forms) + " }").to_toml())
    assert again.limits == whole


@pytest.mark.parametrize(
    ("envelope", "key"),
    [
        ("{ }", "limits.envelope.radius"),
        ('{ box = [["0 mm", "0 mm", "0 mm"], ["9 mm", "0 mm", "9 mm"]] }', "limits.envelope.box"),
        ('{ half_space = [{ point = ["0 mm", "0 mm", "0 mm"], normal = [0, 0, 0] }] }', "normal"),
    ],
)
def test_what_is_no_space_is_refused(envelope, key):
    with pytest.raises(ProblemError) as caught:
        problem(envelope)
    assert key in str(caught.value) and "\n" not in str(caught.value)


def test_the_envelope_is_as_symmetric_as_the_body():
    mirrored, turned = 'symmetry = { mirror = ["xz"] }', "symmetry = { rotation = 4 }"
    wide = '{ box = [["-14 mm", "-12 mm", "-1 mm"], ["20 mm", "12 mm", "31 mm"]] }'
    assert problem(wide, mirrored).limits.envelope.planes
    with pytest.raises(ProblemError, match=r"limits\.envelope"):
        problem(wide, turned)
    with pytest.raises(ProblemError, match=r"limits\.envelope"):
        problem('{ half_space = [{ point = ["0 mm", "12 mm", "0 mm"], normal = [0, 1, 0] }] }', mirrored)
    assert problem('{ box = [["-12 mm", "-12 mm", "0 mm"], ["12 mm", "12 mm", "30 mm"]] }', turned)
