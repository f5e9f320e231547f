"""Quantities: read, refused with a readable reason, and written so that they read back the same."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneumorph import units

KINDS = [kind for kind in vars(units).values() if isinstance(kind, units.Kind)]


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("60 kPa", units.PRESSURE, 0.06),
        ("60kPa", units.PRESSURE, 0.06),
        ("-1e1 kPa", units.PRESSURE, -0.01),
        ("1 bar", units.PRESSURE, 0.1),
        ("8 cm", units.LENGTH, 80.0),
        ("0.6 /mm", units.PER_LENGTH, 0.6),
        ("0.6 1/mm", units.PER_LENGTH, 0.6),
        ("0.6 mm^-1", units.PER_LENGTH, 0.6),
        ("0.3 /mm^2", units.CURVATURE, 0.3),
        ("0.3 /mm²", units.CURVATURE, 0.3),
        ("1.10 g/cm^3", units.DENSITY, 1.1e-9),
        ("9.81 m/s^2", units.ACCELERATION, 9810.0),
        ("2 N", units.FORCE, 2.0),
        ("1 kg*m/s^2", units.FORCE, 1.0),
        ("4 N/mm", units.STIFFNESS, 4.0),
        ("0.1 N*m/rad", units.ROTATIONAL_STIFFNESS, 100.0),
        ("100 N*mm", units.ROTATIONAL_STIFFNESS, 100.0),
    ],
)
def test_reads(text, kind, value):
    assert units.parse(text, kind) == value


def test_inside_units_are_consistent():
    """N = t·mm/s² and MPa = N/mm², so densities and moduli can meet in one potential."""
    assert units.parse("1 t*mm/s^2", units.FORCE) == units.parse("1 N", units.FORCE)
    assert units.parse("1 N/mm^2", units.PRESSURE) == units.parse("1 MPa", units.PRESSURE)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_usual_units_are_worth_what_pint_says(kind):
    assert (units._factor(kind.inside, kind), units._factor(kind.written, kind)) == (
        units._converted(kind.inside, kind),
        units._converted(kind.written, kind),
    )


def test_degrees_become_radians():
    assert units.parse("1 N*mm/deg", units.ROTATIONAL_STIFFNESS) == pytest.approx(180 / math.pi, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (60, 'the number 60 has no unit; write e.g. "60 kPa"'),
        (0, 'the number 0 has no unit; write e.g. "0 kPa"'),
        (math.inf, 'the number inf has no unit; write e.g. "60 kPa"'),
        ("60", '"60" has no unit; write e.g. "60 kPa"'),
        ("kPa", '"kPa" is not a number with a unit; write e.g. "60 kPa"'),
        ("60,5 kPa", '"60,5 kPa" has a comma; write a decimal point, "60.5 kPa"'),
        ("61", '"61" has no unit; write e.g. "61 kPa"'),
        ("60 mm", '"mm" is not a unit of a pressure; write e.g. "60 kPa"'),
        ("60 KPa", '"KPa" is not a known unit; write e.g. "60 kPa"'),
        ("60 kPa*2", '"kPa*2" is not a unit; write e.g. "60 kPa"'),
        ("nan kPa", '"nan kPa" is not a number with a unit; write e.g. "60 kPa"'),
        ("2e7 kPa", '"2e7 kPa" is too large; write e.g. "60 kPa"'),
        ("1e999 kPa", '"1e999 kPa" is too large; write e.g. "60 kPa"'),
        (True, 'a pressure with its unit is expected here; write e.g. "60 kPa"'),
        (["60 kPa"], 'a pressure with its unit is expected here; write e.g. "60 kPa"'),
    ],
)
def test_refuses(text, reason):
    with pytest.raises(ValueError) as caught:
        units.parse(text, units.PRESSURE)
    assert str(caught.value) == reason


MENDED = re.compile(r'write (e\.g\.|a decimal point,) "[^"]+"$')
"""How every refusal ends."""


@given(st.text())
def test_any_text_is_read_or_refused(text):
    try:
        assert math.isfinite(units.parse(text, units.PRESSURE))
    except ValueError as error:
        assert MENDED.search(str(error))


@given(st.from_regex(r"\A[0-9]{1,3} ?[kMmNtsradPa/*^()·² -]{1,8}\Z"))
def test_any_unit_is_read_or_refused(text):
    try:
        assert math.isfinite(units.parse(text, units.PRESSURE))
    except ValueError as error:
        assert MENDED.search(str(error))


@given(st.sampled_from(KINDS), st.floats(-1, 1).filter(lambda x: x == 0 or abs(x) > 1e-20))
def test_written_text_reads_back_exactly(kind, part):
    value = part * min(kind.most, 1e12)
    assert units.parse(units.write(value, kind), kind) == value


def test_written_text_is_short():
    assert units.write(0.06, units.PRESSURE) == "60 kPa"
    assert units.write(1.1e-9, units.DENSITY) == "1.1 g/cm^3"
    assert units.write(80.0, units.LENGTH) == "80 mm"
    assert units.write(0.6, units.PER_LENGTH) == "0.6 /mm"
    assert units.write(9810.0, units.ACCELERATION) == "9.81 m/s^2"


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_zero_is_written_as_zero(kind):
    assert units.write(0.0, kind) == f"0 {kind.written}"
