"""Equilibria at any pressures: those of a simulation, from the nearest known one, on part of a body where it serves."""

import numpy as np
import pytest
from texts import EXTEND, problem_text
from tiny import tiny

import pneumorph as pm
from pneumorph.analysis import Explorer, Stopped
from pneumorph.problem import loads
from pneumorph.results import to_json

pytestmark = pytest.mark.usefixtures("without_mesh_errors")


def mirrored(mirrors: str, **changes: str) -> str:
    return tiny(**changes).replace("[[body.chamber]]", f"symmetry = {{ mirror = [{mirrors}] }}\n[[body.chamber]]")


PARTS = {"whole": tiny(), "half": mirrored('"xz"'), "quarter": mirrored('"xz", "yz"')}


@pytest.fixture(scope="module", params=PARTS.values(), ids=list(PARTS))
def start(request):
    return pm.starting_design(loads(request.param))


def same(one, other):
    """Whether two steps have the same numbers, as far as the solver's tolerance goes."""
    # Only what is simulated is estimated on a refined mesh too.
    found, expected = (
        {key: value for key, value in to_json(each).items() if not key.startswith("fine_")} for each in (one, other)
    )
    assert found.keys() == expected.keys()
    for key in ("translation_mm", "rotation_rad", "max_stretch"):
        np.testing.assert_allclose(found[key], expected[key], rtol=1e-6, atol=1e-8)
    assert found["volume_mm3"] == pytest.approx(expected["volume_mm3"])
    assert found["pressure_MPa"] == pytest.approx(expected["pressure_MPa"])
    return found["stable"] == expected["stable"]


def test_the_numbers_are_those_of_a_simulation(start):
    explorer = start.explorer()
    for kilopascals in (60, 20, -5, 35):
        found = explorer.at({"A": kilopascals / 1e3})
        assert same(found.step, start.simulate({"A": f"{kilopascals} kPa"}).steps[0]), kilopascals


def test_the_fields_are_those_of_the_whole_body(start):
    found = start.explorer().at(start.pressures["extend"])
    np.testing.assert_allclose(
        found.fields.whole().stretch["extend"].max(), start.fields.stretch["extend"].max(), rtol=1e-4
    )
    assert found.fields.whole().mesh.mirrors == ()


def test_from_a_near_state_it_takes_less(start):
    explorer, counts = start.explorer(), []
    for pressure in (0.06, 0.055, 0.0575):
        asked = []
        explorer.at({"A": pressure}, lambda asked=asked: bool(asked.append(1)))
        counts.append(len(asked))
    assert counts[2] <= counts[1] <= counts[0]


def test_what_is_given_up_leaves_nothing_behind(start):
    explorer = start.explorer()
    with pytest.raises(Stopped):
        explorer.at({"A": 0.06}, lambda: True)
    asked = []
    with pytest.raises(Stopped):
        explorer.at({"A": 0.06}, lambda: bool(asked.append(1)) or len(asked) > 1)
    assert same(explorer.at({"A": 0.06}).step, start.simulate().steps[0])


def test_where_there_is_nothing_there_is_a_reason():
    found = pm.starting_design(loads(tiny())).explorer().at({"A": 5.0})
    assert not found.step.converged and found.fields is None
    assert "no equilibrium found" in found.step.reason


def test_from_what_is_stored_little_is_left_to_solve(start):
    stored, asked = start._computed(), {None: [], "stored": []}
    found = {}
    for name, fields in ((None, None), ("stored", stored)):
        explorer = Explorer(start.problem, start.body, fields, start.results)
        found[name] = explorer.at({"A": 0.06}, lambda name=name: bool(asked[name].append(1)))
    assert same(found["stored"].step, found[None].step)
    assert found["stored"].fields.mesh is stored.mesh
    assert len(asked["stored"]) < len(asked[None]) / 2
    # The stored task's own result, to the tolerance of a design.
    np.testing.assert_allclose(
        found["stored"].step.translation, start.results["extend"].translation, rtol=1e-4, atol=1e-6
    )


def test_pressures_that_break_a_mirror_unfold_what_is_stored():
    """Of a quarter, half is enough for pressures that break one mirror; what is stored as a half stays one."""
    chambers = (("A", 1.8, "4 mm", "0 mm"), ("B", 1.8, "-4 mm", "0 mm"))
    symmetric = 'control_density = "0.3 /mm"\nsymmetry = { mirror = ["xz", "yz"] }'
    rest = EXTEND.replace('A = "60 kPa"', 'A = "60 kPa", B = "60 kPa"') + '[mesh]\nsize = "6 mm"\n'
    start = pm.starting_design(loads(problem_text(rest, chambers=chambers, body=symmetric)))
    quarter = start._computed()
    assert quarter.mesh.mirrors == ("xz", "yz")
    half = quarter.unfolded(["xz"])
    unlike = {"A": 0.05, "B": 0.04}
    for stored, pressures, mirrors in (
        (quarter, {"A": 0.05, "B": 0.05}, ("xz", "yz")),
        (quarter, unlike, ("xz",)),
        (half, {"A": 0.05, "B": 0.05}, ("xz",)),
    ):
        found = Explorer(start.problem, start.body, stored, start.results).at(pressures)
        assert found.fields.mesh.mirrors == mirrors
        assert found.step.converged and found.step.stable
        bent = abs(found.step.rotation[1])
        assert bent > 1e-4 if pressures == unlike else bent < 1e-9
