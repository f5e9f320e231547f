"""What tests do not determine of a model, and the further test that does."""

import re

import numpy as np
import pytest

from pneumorph.errors import ProblemError
from pneumorph.interface.material import fit_material
from pneumorph.mechanics.material.energies import yeoh
from pneumorph.mechanics.material.fit import TensionTest, forms
from pneumorph.mechanics.material.homogeneous import nominal_stress
from pneumorph.mechanics.material.judge import fit
from pneumorph.mechanics.material.undetermined import sentences, undetermined

TRUE = np.array([0.25, 0.02])
"""Coefficients of a rubber, MPa."""


def made(mode, longest, seed=0):
    """A test of it with 20 points and errors of 1 %."""
    stretch = np.linspace(1.01, longest, 20)
    errors = 1.0 + 0.01 * np.random.default_rng(seed).standard_normal(20)
    return TensionTest(stretch, nominal_stress(yeoh, TRUE, stretch, mode) * errors, mode)


def fitted(*tests):
    (form,) = [form for form in forms(tests) if form.label == "yeoh, 2 terms"]
    return fit(form, tests)


def test_a_further_test_that_is_named_determines_the_constant():
    short = made("uniaxial", 1.08, seed=3)
    one = fitted(short)
    assert list(undetermined(one)) == ["coefficient 2"]
    (told,) = sentences(one, [short])
    assert told.startswith("the tests do not determine coefficient 2 of yeoh, 2 terms, ") and " MPa within" in told
    named = re.findall(r"an? (\w+) test up to a stretch of ([\d.]+)", told)
    assert named and told.endswith("would, if the model holds there")
    for mode, longest in named:
        longer = made(mode, float(longest), seed=1)
        both = fitted(short, longer)
        assert undetermined(both) == {} and list(sentences(both, [short, longer])) == []
        assert both.parameters[1] == pytest.approx(TRUE[1], abs=2.5 * both.deviations[1])


def test_too_few_points_say_how_many_are_needed_and_how_to_have_them(tmp_path):
    test = made("uniaxial", 3.0)
    path = tmp_path / "test.csv"
    rows = [f"{stretch:.4f},{stress:.5f}" for stretch, stress in zip(test.stretch, test.stress, strict=True)]
    path.write_text("stretch,nominal_stress_MPa\n" + "\n".join(rows) + "\n")
    with pytest.raises(ProblemError, match="leaves 2 of the 20 points") as refused:
        fit_material(path, "yeoh", max_stretch=1.2)
    least = re.search(r"--max-stretch ([\d.]+)\)", str(refused.value))
    assert least
    assert len(fit_material(path, "yeoh", max_stretch=float(least[1])).tests[0].stretch) == 5
