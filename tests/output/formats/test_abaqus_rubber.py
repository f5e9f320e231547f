"""Every rubber in the words of CalculiX and Abaqus: what is written, and what CalculiX makes of it."""

import numpy as np
import pytest
from installed import needs

from pneumorph.errors import ProblemError
from pneumorph.mechanics import Tangent, build_loads, build_model, configure, rubber_of, solve
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.memory import after_pulls
from pneumorph.mechanics.material.rubber import Rubber, nominal_stress
from pneumorph.output.formats.abaqus import abaqus_input, body_lines, rubber_lines
from pneumorph.output.formats.abaqus_rubber import can_hold, hyperelastic
from pneumorph.output.formats.febio import material_of
from pneumorph.problem.material import elastomer, library
from pneumorph.verify import calculix
from pneumorph.verify.solids import bar, tube

MODELS = {
    "neo-hookean": (energies.neo_hookean, 0.25),
    "mooney-rivlin": (energies.mooney_rivlin, 0.2, 0.05),
    "polynomial": (energies.polynomial, 0.2, 0.05, 0.01, 0.005, 0.002),
    "yeoh of two terms": (energies.yeoh, 0.11, 0.02),
    "yeoh of three terms": (energies.yeoh, 0.11, 0.02, 0.003),
    "arruda-boyce": (energies.arruda_boyce, 0.2, 2.0),
    "ogden of one term": (energies.ogden, 0.2, 2.5),
    "ogden of three terms": (energies.ogden, 0.2, 2.5, 0.01, -3.0, 0.02, 5.0),
}

DEFORMATION = np.array([[1.45, 0.2, 0.0], [0.0, 0.85, 0.1], [0.05, 0.0, 0.83]])
"""Principal stretches apart from each other, and a volume that changes by 2 %."""


def rubber(energy, *parameters, bulk=10.0):
    return Rubber(energy, (*parameters, bulk), 1.1e-9)


def numbers(of):
    """The keyword of a rubber, and its numbers."""
    lines = [line for line in hyperelastic(of) if not line.startswith("**")]
    return lines[0], [float(number) for line in lines[1:] for number in line.split(",")]


def stress(of):
    """The Cauchy stress (3, 3) of a rubber under `DEFORMATION` by CalculiX: every node of a block is moved."""
    needs(calculix.program)
    mesh = bar(2, 2, (1, 1, 1))
    model = build_model(mesh, of, plate=False)
    at = configure(model, mesh.points, build_loads(model, {}))
    moved = (mesh.points @ (DEFORMATION - np.eye(3)).T).tolist()
    step = ["*STEP, NLGEOM, INC=1000", "*STATIC", "0.1, 1., 1e-4, 0.1", "*BOUNDARY"]
    step += [f"{k}, {i}, {i}, {value:.12e}" for k, u in enumerate(moved, 1) for i, value in enumerate(u, 1)]
    step += ["*EL PRINT, ELSET=BODY, FREQUENCY=1000", "S", "*END STEP", ""]
    table = calculix.solved("\n".join([*body_lines(mesh), *rubber_lines(mesh, at), *step]))
    rows = [line.split() for line in table.splitlines()]
    found = np.array([row[2:] for row in rows if len(row) == 8 and row[0].isdigit()], float)
    assert len(found) >= 4 * len(mesh.tets)
    xx, yy, zz, xy, xz, yz = found[-1]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def ours(of):
    """The same by the package, with the volumetric energy of the manuals, which differs in Arruda and Boyce's model."""
    nominal, J = nominal_stress(of.energy, DEFORMATION, np.array(of.parameters)), np.linalg.det(DEFORMATION)
    differs = of.isochoric is energies.arruda_boyce
    pressure = of.bulk_modulus * ((J - 1 / J) / 2 - (J - 1)) if differs else 0.0
    return nominal @ DEFORMATION.T / J + pressure * np.eye(3)


@pytest.mark.parametrize("model", MODELS)
def test_calculix_has_the_same_model(model):
    of = rubber(*MODELS[model])
    assert np.abs(stress(of) - ours(of)).max() < 1e-4 * np.abs(ours(of)).max()


@pytest.mark.parametrize("name", library())
def test_calculix_has_the_same_rubber(name):
    of = rubber_of(elastomer(name))
    assert np.abs(stress(of) - ours(of)).max() < 1e-4 * np.abs(ours(of)).max()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Ecoflex 00-30", "Elastosil M4601"])
def test_calculix_moves_a_body_of_a_rubber_as_far(name):
    """A tube of nearly incompressible rubber is pulled and bent; both programs have plain elements here."""
    needs(calculix.program)
    of, mesh = rubber_of(elastomer(name)), tube(4, 8, 20, (1, 6, 3))
    model = build_model(mesh, of)
    load = of.shear_modulus * np.array([3, 0, 60, 0, 0, 60])
    at = configure(model, mesh.points, build_loads(model, {}, wrench=load))
    u, _ = calculix.equilibrium(mesh, at)
    found = solve(at, Tangent(model)).u
    assert np.abs(u).max() > 2.0
    assert np.abs(u - found).max() < 1e-3 * np.abs(u).max()


@pytest.mark.parametrize("name", library())
def test_every_rubber_of_the_library_is_written(name):
    of = rubber_of(elastomer(name))
    keyword, data = numbers(of)
    terms = int(keyword.partition("N=")[2] or 1)
    assert can_hold(of) and 2 / data[-terms] == pytest.approx(of.bulk_modulus)
    assert not any("Abaqus alone" in line for line in hyperelastic(of))


def test_long_models_are_written_in_lines_of_eight_numbers():
    of = rubber(energies.ogden, *(value for k in range(1, 6) for value in (0.1, float(k))))
    lines = list(hyperelastic(of))
    assert "3 terms" in lines[0] and lines[1] == "*HYPERELASTIC, OGDEN, N=5"
    assert [len(line.split(",")) for line in lines[2:]] == [8, 7]
    assert numbers(of)[1][-5:] == [0.2, *[1e20] * 4]


def test_a_model_with_a_limit_is_refused():
    of = rubber(energies.gent, 0.3, 30.0)
    mesh = bar(2, 2, (1, 1, 1))
    model = build_model(mesh, of)
    at = configure(model, mesh.points, build_loads(model, {}))
    with pytest.raises(ProblemError, match="Gent") as refused:
        abaqus_input(mesh, at)
    assert not can_hold(of) and "\n" not in str(refused.value)


def test_softened_rubber_has_no_keyword():
    softened = Rubber(after_pulls(energies.neo_hookean), (0.5, 0.01, 0.1, 0.02, 0.05, 5.0), 1e-9)
    assert not can_hold(softened)
    with pytest.raises(ProblemError, match="softened"):
        material_of(softened)
