"""By how much the results of a simulation scatter with the rubber, against castings of a stiffer and a softer one."""

import math

import numpy as np
import pytest
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis.simulate import prepare_simulation
from pneumorph.geometry.tube.start import starting_body
from pneumorph.output.certainty import of_step
from pneumorph.output.sweeps import table
from pneumorph.problem import loads
from pneumorph.results import SweepStep, from_json, to_json

SPRING = """
[end_effector]
spring = { axial = "0.5 N/mm" }
force = ["0.1 N", "0 N", "0 N"]
"""
HELD = """
[end_effector]
hold = ["axial"]
"""
TASK = """
[[task]]
name = "move"
pressure = { B = "8 kPa" }
objective = { motion = "bending_y" }
[mesh]
size = "8 mm"
"""
SCATTER, SMALL = 0.2, 1e-3


def curve(plate, factor=1.0, scatter=SCATTER, **given):
    """A sweep of a body with two chambers whose rubber is stiffer by a factor."""
    text = problem_text(plate + TASK, radius=10, chambers=TWO_BESIDE)
    problem = loads(text)
    tables = problem.model_dump(mode="json", exclude_none=True)
    rubber = {key: f"{factor * value!r} MPa" for key, value in (("shear_modulus", 0.49), ("bulk_modulus", 4.80))}
    tables["material"] = {"name": "own", "model": "neo-hookean", "density": "1.1 g/cm^3", **rubber}
    if scatter:
        tables["material"]["scatter"] = scatter
    problem = type(problem).model_validate(tables)
    curves = []
    pressures = {"move": {"B": 0.008}} if "volumes" in given else {"move": {"A": 0.0, "B": 0.008}}
    list(
        prepare_simulation(problem, starting_body(problem.tubes), pressures, given.pop("given", {}), **given).run(
            curves
        )
    )
    return curves[0]


def values(step):
    """All results that scatter."""
    return np.array([*step.translation, *step.rotation, *step.reaction.values(), *step.volumes.values()])


@pytest.mark.parametrize("loaded", [{"given": {"A": "12 kPa"}}, {"volumes": {"A": "0.12 ml"}}])
@pytest.mark.parametrize("plate", [SPRING, HELD])
def test_the_scatter_is_that_of_stiffer_and_softer_rubber(plate, loaded):
    (step,) = curve(plate, **loaded).steps
    stiff, soft = (curve(plate, 1.0 + way * SMALL, **loaded).steps[0] for way in (1.0, -1.0))
    off = SCATTER * np.abs(values(stiff) - values(soft)) / (2.0 * SMALL)
    told = np.array(
        [
            *(step.rubber_translation or ()),
            *(step.rubber_rotation or ()),
            *step.rubber_reaction.values(),
            *step.rubber_volumes.values(),
        ]
    )
    assert told == pytest.approx(off, rel=1e-4, abs=1e-7 * off.max())
    assert from_json(SweepStep, to_json(step)) == step


def test_the_scatter_is_told_and_in_the_table():
    found = curve(HELD, given={"A": "0:12:12 kPa"})
    header, rows = table([found], ["A", "B"])
    last = dict(zip(header, rows[-1], strict=True))
    step = found.steps[-1]
    assert last["rubber_rotation_y_deg"] == pytest.approx(math.degrees((step.rubber_rotation or ())[1]))
    assert last["rubber_reaction_axial_N"] == step.rubber_reaction["axial"] > 0.0
    assert "(mesh) ± " in of_step(step) and "(rubber)" in of_step(step)


def test_nothing_is_told_of_a_rubber_of_which_nothing_is_known():
    found = curve(HELD, scatter=0.0, given={"A": "12 kPa"})
    assert found.steps[0].rubber_translation is None and not found.steps[0].rubber_reaction
    assert not [title for title in table([found], ["A", "B"])[0] if title.startswith("rubber")]
