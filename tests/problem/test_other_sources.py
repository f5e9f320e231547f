"""Other sources on rubbers of the library."""

import pytest

from pneumorph.problem.material import doubt, elastomer, library, other_sources

WITH_OTHERS = [name for name, table in library().items() if "others" in table]


@pytest.mark.parametrize("name", WITH_OTHERS)
def test_other_sources_are_told_of_the_library_s_rubber_alone(name):
    rubber = elastomer(name)
    others = other_sources(rubber)
    assert all(0.1 < each.shear_modulus / rubber.initial_shear_modulus < 10.0 and each.source for each in others)
    assert f"{1e3 * others[0].shear_modulus:.3g}" in (doubt(rubber) or "")
    assert doubt(rubber.model_copy(update={"density": 2 * rubber.density})) is None


def test_a_rubber_with_one_source_has_no_doubt():
    assert WITH_OTHERS
    assert doubt(elastomer("Hei-Cast 8400")) is None
