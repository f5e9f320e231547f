"""What the errors of a rubber's fit do to the motion: beside those by its modulus, and against solutions."""

from dataclasses import replace

import numpy as np
import pytest
from texts import BEND_UNDER_LOADS, TWO_BESIDE, problem_text

from pneumorph.analysis.near import Solved, analyse_near
from pneumorph.analysis.scatter import one_deviation, scatter_of
from pneumorph.analysis.tolerances import Tolerances
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import loads

NONE = Tolerances(rubber=0.0, pressure=0.0, wall=0.0, shift=0.0, tilt=0.0, scale=0.0, load=0.0)
YEOH = 'model = "yeoh"\ncoefficients = ["0.15 MPa", "0.02 MPa"]\nbulk_modulus = "6 MPa"\ndensity = "1.1 g/cm^3"\n'


@pytest.fixture(scope="module")
def whole() -> Solved:
    problem = loads(problem_text(BEND_UNDER_LOADS, material=YEOH, chambers=TWO_BESIDE, radius=10))
    problem = problem.with_changes({"mesh.size": "9 mm"})
    return analyse_near(problem, starting_body(problem.tubes), ())


def with_covariance(whole: Solved, covariance) -> Solved:
    material = whole.problem.material.model_copy(update={"covariance": tuple(map(tuple, np.asarray(covariance)))})
    return replace(whole, problem=whole.problem.model_copy(update={"material": material}))


def test_the_variance_is_that_of_the_covariance_beside_that_of_the_modulus(whole):
    """Constants that make up for one another move the tip less than independent ones; the causes are independent."""
    covariance = np.array([[1e-4, -8e-4], [-8e-4, 1e-2]])
    scatter = scatter_of(with_covariance(whole, covariance), replace(NONE, rubber=0.05))["bend"]
    by = 100.0 * np.array([scatter.constants["c1"], scatter.constants["c2"]]).T
    fits = [k for k, cause in enumerate(scatter.causes) if cause.name.startswith("fit of the rubber")]
    own = scatter.variances[fits].sum(axis=0)
    np.testing.assert_allclose(own, np.einsum("mi,ij,mj->m", by, covariance, by), rtol=1e-9)
    modulus = scatter.causes[0]
    assert modulus.name == "modulus of the rubber"
    total = own + np.square(5.0 * np.array(modulus.by))
    np.testing.assert_allclose(np.square(scatter.deviations), total, rtol=1e-9)
    assert own[scatter.quantities.index("volume_A")] > 0.0
    # The first of the independent errors is nearly all.
    assert scatter.variances[fits[0], 4] > 0.9 * own[4]
    assert own[4] < np.einsum("i,i,i->", by[4], np.diag(covariance), by[4])


def test_an_error_of_all_constants_alike_is_one_of_the_modulus(whole):
    """But for the bulk modulus, of which a fit says nothing."""
    scatter = scatter_of(with_covariance(whole, np.full((2, 2), 0.03**2)), NONE)["bend"]
    modulus, fit, *_ = scatter.causes
    together = 3.0 * (np.array(modulus.by) - np.array(scatter.constants["bulk_modulus"]))
    np.testing.assert_allclose(np.abs(fit.by), np.abs(together), rtol=1e-6, atol=1e-9)
    assert fit.constants["c1"] == pytest.approx(fit.constants["c2"], rel=1e-5)


def test_castings_off_by_an_error_of_the_fit_are_solved(whole):
    """First-order deviations approach the solutions with order 2."""
    far = []
    for part in (0.2, 0.1):
        there = with_covariance(whole, part**2 * np.array([[0.01, -0.02], [-0.02, 0.2]]))
        scatter = scatter_of(there, NONE)["bend"]
        found = one_deviation(there, "bend", scatter, 4)
        middle, deviation = scatter.motion[4], scatter.deviations[4]
        far.append(max(abs(found.up - middle - deviation), abs(middle - found.down - deviation)))
        assert far[-1] < 0.1 * deviation
    assert far[1] < 0.35 * far[0]
