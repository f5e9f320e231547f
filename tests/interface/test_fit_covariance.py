"""The covariance that `material fit` writes is that of its fit, in the terms of the problem file."""

import numpy as np
import pytest
from texts import EXTEND, problem_text

from pneumorph.interface.material import fit_material
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.homogeneous import nominal_stress
from pneumorph.problem import loads
from pneumorph.problem.constants import with_constants
from pneumorph.problem.covariance import root_of

KINDS = {"yeoh": energies.yeoh, "ogden": energies.ogden}


@pytest.mark.parametrize("model", KINDS)
def test_a_problem_reads_errors_of_constants_that_give_the_errors_of_the_fitted_curve(model, tmp_path):
    """The deviation of the stress by the file's covariance is what the fit says of its own curve."""
    stretch = np.linspace(1.05, 2.5, 40)
    exact = nominal_stress(energies.yeoh, np.array([0.2, 0.01]), stretch)
    noisy = exact * (1.0 + 0.02 * np.random.default_rng(3).standard_normal(len(stretch)))
    path = tmp_path / "test.csv"
    rows = (f"{one}, {other}" for one, other in zip(stretch, noisy, strict=True))
    path.write_text("\n".join(["stretch, nominal_stress_MPa", *rows]))
    fitted = fit_material(path, model=model)
    problem = loads(problem_text(EXTEND)).with_changes({"material": fitted.table})
    material = loads(problem.to_toml()).material

    best, curve = fitted.fits[0], fitted.fits[0].curves["uniaxial"]
    assert len(material.covariance) == len(best.parameters)
    changes = []
    for error in root_of(material.covariance):
        ways = []
        for way in (1e-4, -1e-4):
            values = {
                name: (1.0 + way * part) * value
                for (name, value), part in zip(material.constants.items(), error, strict=True)
            }
            parameters = np.array(list(with_constants(material, values).constants.values()))
            ways.append(nominal_stress(KINDS[model], parameters, curve.stretch))
        changes.append((ways[0] - ways[1]) / 2e-4)
    np.testing.assert_allclose(np.linalg.norm(changes, axis=0), curve.deviation, rtol=1e-3)
