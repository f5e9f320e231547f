"""Other sources on rubbers of the library."""

import math

import numpy as np
import pytest

from pneumorph.mechanics import rubber_of
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.homogeneous import DIRECTIONS, nominal_stress
from pneumorph.mechanics.material.memory import after, at_rest
from pneumorph.problem.material import elastomer, library
from pneumorph.problem.sources import (
    at_100_percent,
    chosen,
    deviation_of,
    doubt,
    history_of,
    largest_deviation,
    other_sources,
    range_of,
    told,
)

WITH_OTHERS = [name for name, table in library().items() if "others" in table]


@pytest.mark.parametrize("name", WITH_OTHERS)
def test_other_sources_are_told_of_the_library_s_rubber_alone(name):
    rubber = elastomer(name)
    others = other_sources(rubber)
    assert all(0.1 < each.shear_modulus / rubber.initial_shear_modulus < 10.0 and each.source for each in others)
    low, high = range_of(rubber)
    assert low <= rubber.initial_shear_modulus <= high and low < high
    assert f"{1e3 * low:.3g} to {1e3 * high:.3g} kPa" in (doubt(rubber) or "")
    assert chosen(rubber)
    other = rubber.model_copy(update={"density": 2 * rubber.density})
    assert doubt(other) is None and deviation_of(other) is None and chosen(other) == ""


@pytest.mark.parametrize("name", list(library()))
def test_the_stress_at_100_percent_is_that_of_the_energy(name):
    rubber = rubber_of(elastomer(name))
    (stress,) = nominal_stress(rubber.isochoric, np.array(rubber.parameters[:-1]), np.array([2.0]))
    assert at_100_percent(elastomer(name)) == pytest.approx(float(stress), rel=1e-9)


@pytest.mark.parametrize(("name", "sheet"), [("Ecoflex 00-10", 0.055), ("Ecoflex 00-50", 0.083)])
def test_rubbers_with_the_data_sheet_s_stress_have_it(name, sheet):
    assert at_100_percent(elastomer(name)) == pytest.approx(sheet, rel=1e-3)


def test_sources_are_read_as_initial_shear_moduli():
    by_source = {each.source.split(":")[0]: each.shear_modulus for each in other_sources(elastomer("Dragon Skin 10"))}
    assert by_source["data sheet"] == pytest.approx(0.152 / (2.0 - 1.0 / 4.0))  # a neo-Hookean rubber
    gent = next(each for each in other_sources(elastomer("Ecoflex 00-30")) if "data sheet" in each.source)
    assert gent.shear_modulus == pytest.approx(0.069 / 1.75 * (1.0 - 2.0 / 39.6), rel=0.01)


@pytest.mark.parametrize("mode", list(DIRECTIONS))
def test_the_polynomial_of_ecoflex_00_30_is_the_gent_model_of_its_source(mode):
    rubber, stretch = rubber_of(elastomer("Ecoflex 00-30")), np.linspace(1.01, 3.0, 50)
    gent = nominal_stress(energies.gent, np.array([0.0317, 39.6]), stretch, mode)
    ours = nominal_stress(rubber.isochoric, np.array(rubber.parameters[:-1]), stretch, mode)
    assert ours == pytest.approx(gent, rel=8e-3)
    compressed = next(each for each in other_sources(elastomer("Ecoflex 00-30")) if "compression" in each.source)
    assert compressed.shear_modulus == pytest.approx(0.0973 / 3.0)


def test_the_deviation_is_half_the_range_of_logarithms():
    low, high = range_of(elastomer("Dragon Skin 30"))
    assert deviation_of(elastomer("Dragon Skin 30")) == pytest.approx(0.5 * math.log(high / low))
    assert deviation_of(elastomer("Ecoflex 00-10")) == 0.5  # more would be beyond first derivatives
    assert deviation_of(elastomer("Hei-Cast 8400").model_copy(update={"scatter": 0.07})) == 0.07


def test_a_rubber_with_one_source_has_no_doubt_unless_its_scatter_is_known():
    assert WITH_OTHERS
    one = elastomer("Hei-Cast 8400")
    assert doubt(one) is None and deviation_of(one) is None
    assert "± 7 %" in doubt(one.model_copy(update={"scatter": 0.07}))


def test_what_time_does_is_told_where_a_public_test_tells_it():
    history = history_of(elastomer("Dragon Skin 10"))
    assert 0.0 < history.deviation < 0.2 and "2201.12560" in history.source
    assert history_of(elastomer("Hei-Cast 8400")) is None
    assert history_of(elastomer("Dragon Skin 10").model_copy(update={"density": 1e-9})) is None


@pytest.mark.parametrize("name", list(library()))
def test_every_rubber_says_why_it_has_its_value_and_how_far_that_is_known(name):
    rubber = elastomer(name)
    assert rubber.source and chosen(rubber)
    if deviation_of(rubber) is None:
        assert "no other source" in chosen(rubber)


def test_least_is_known_of_the_rubber_with_the_largest_deviation():
    rubbers = [elastomer(name) for name in ("Hei-Cast 8400", "Smooth-Sil 950", "Dragon Skin 30")]
    assert largest_deviation(rubbers) == deviation_of(rubbers[2])
    assert largest_deviation(rubbers[:1]) is None


def test_of_a_rubber_that_relaxes_it_is_told_in_which_state_it_is_elastic():
    about = list(told(elastomer("Filaflex 60A")))
    assert len(about) == 2 and 'the state "first pull"; 24 % of its moduli relax' in about[1]
    assert len(list(told(elastomer("Dragon Skin 30")))) == 1 and not list(told(elastomer("Hei-Cast 8400")))


def test_a_rubber_of_the_library_relaxes_as_it_was_measured_to():
    """The share of the stress that was left of Filaflex 60A at a stretch of 1.25 (Roels and others 2026)."""
    memory = rubber_of(elastomer("Filaflex 60A")).memory
    F = np.diag([1.25, 1.25**-0.5, 1.25**-0.5])[:, :, None]
    pulled = after(memory, at_rest(memory, (1,)), F, 0.0)
    for time, left in {
        1.0: 0.9800,
        10.0: 0.9383,
        100.0: 0.8881,
        1000.0: 0.8372,
        5000.0: 0.7998,
        10000.0: 0.7833,
    }.items():
        held = after(memory, pulled, F, time)
        stress = (1.0 - sum(memory.shares)) * held.stress + held.parts.sum(axis=0)
        assert stress[0, 0] / pulled.stress[0, 0] == pytest.approx(left, abs=5e-4)
