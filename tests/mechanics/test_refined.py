"""States on refined meshes by a few products with the tangent, against its factorisation there and a known solution."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import quad
from scipy.optimize import brentq
from texts import TWO_BESIDE, problem_text

from pneumorph.analysis import analyse_body
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import Tangent, build_loads, build_model, configure, model_of, solve
from pneumorph.mechanics.assembly.hessian import contact_in_pairs, tangent
from pneumorph.mechanics.solve import refined
from pneumorph.mechanics.solve.balance import residual_at
from pneumorph.mechanics.solve.refined import near_refined, on_refined, search_refined
from pneumorph.mechanics.solve.split import SOFTER, Split, surplus_of
from pneumorph.mesh.refine import refine
from pneumorph.problem import loads
from pneumorph.verify.solids import BULK, DENSITY, RUBBER, SHEAR, bar

TASK = '[[task]]\nname = "move"\npressure = { A = "20 kPa" }\nobjective = { motion = "extension" }\n'
HARD = TASK.replace("20 kPa", "150 kPa")
WALL = '[[obstacle]]\nname = "wall"\nkind = "plane"\npoint = ["0 mm", "0 mm", "24.2 mm"]\nnormal = [0, 0, -1]\n'
BALL = '[[obstacle]]\nname = "wall"\nkind = "sphere"\ncenter = ["0 mm", "0 mm", "27.3 mm"]\nradius = "3 mm"\n'
FIBRES = '[[fibres]]\nname = "wrap"\nsurfaces = ["exterior"]\nstiffness = "5 N/mm"\nwinding = "70 deg"\n'
QUARTER, SECTOR = 'symmetry = { mirror = ["xz", "yz"] }', "symmetry = { rotation = 3 }"
CASES = {
    "plain": (QUARTER, TASK, None, "quadratic"),
    "mixed": (QUARTER, TASK, None, "mixed"),
    "sector": (SECTOR, TASK, None, "quadratic"),
    "sector, mixed": (SECTOR, TASK, None, "mixed"),
    "fibres": (QUARTER, HARD + FIBRES, None, "quadratic"),
    "pressed": (QUARTER, HARD + WALL, None, "quadratic"),
    "pressed, its own surface too": ("", HARD + BALL, None, "quadratic"),
    "gas": ("", TASK, TWO_BESIDE, "quadratic"),
}


class Case:
    """An equilibrium on a coarse mesh, and the configuration of the refined one."""

    def __init__(self, which):
        symmetry, task, chambers, element = CASES[which]
        options = {} if chambers is None else {"chambers": chambers}
        text = problem_text(task, radius=10, body=symmetry, **options)
        if which == "gas":
            text = text.replace('name = "B"', 'name = "B"\ngas = { pressure = "10 kPa" }')
        problem = loads(text).with_changes({"mesh.size": "8 mm", "mesh.element": element})
        near = analyse_body(problem, starting_body(problem.tubes))
        self.at, self.state = near.analysis.configurations["move"], near.analysis.equilibria["move"].state
        self.tangent = near.disc.tangents["move"]
        self.fine = refine(near.disc.morph.mesh.at(near.analysis.X))
        self.there = replace(self.at, model=model_of(problem, self.fine.mesh), X=self.fine.mesh.points)
        self.start = on_refined(self.fine, self.at, self.state)

    def near(self):
        return near_refined(self.fine, self.at, self.tangent, self.state, self.there)


@pytest.fixture(scope="module", params=list(CASES))
def case(request):
    return Case(request.param)


def matrix(there, state):
    """The tangent of the refined mesh (n, n)."""
    model = there.model
    common, arguments = model.sparsity, (model, there.X, state, there.loads)
    data = tangent(*arguments, there.blocked)
    upper = sparse.csr_array((data, common.indices, common.indptr), shape=(model.size, model.size))
    if model.potential.has_pairs:
        upper = upper + sparse.csr_array(contact_in_pairs(*arguments, there.constrained))
    return sparse.csr_array(upper + sparse.triu(upper, 1).T)


def test_forces_are_the_transpose_of_directions(case):
    """On all unknowns that are free on both meshes."""
    split, random = Split(case.fine, case.at, case.state, case.there), np.random.default_rng(0)
    model = case.there.model
    x = random.standard_normal(case.at.model.size + split.free.size + len(split.inside))
    x[: case.at.model.size][case.at.constrained] = 0.0
    x[case.at.model.size :][: split.free.size][~split.free.ravel()] = 0.0
    v = np.where(case.there.constrained, 0.0, random.standard_normal(model.size))
    full = model.state(v)
    # Images have no forces of their own.
    hydrostatic = np.zeros(len(full.hydrostatic))
    hydrostatic[model.sparsity.corners] = v[model.hydrostatic_unknowns]
    forces = split.forces(full._replace(hydrostatic=hydrostatic))
    assert forces @ x == pytest.approx(v @ model.vector(split.direction(x)), rel=1e-10)


def test_the_blocks_of_new_nodes_are_those_of_the_assembled_tangent(case):
    split, model = Split(case.fine, case.at, case.state, case.there), case.there.model
    found, K = surplus_of(split, case.there, case.start), matrix(case.there, case.start)
    first = 3 * np.searchsorted(model.independent, split.new)
    own = (first[:, None] + np.arange(3)).ravel()
    whole = sparse.csr_array(K[own][:, own]).tobsr((3, 3))
    on_diagonal = np.repeat(np.arange(len(first)), np.diff(whole.indptr)) == whole.indices
    stiffness = np.linalg.inv(found.softness) / (SOFTER if model.mixed else 1.0)
    np.testing.assert_allclose(stiffness, whole.data[on_diagonal], atol=1e-9 * abs(stiffness).max())
    inside = model.hydrostatic_unknowns.start + np.searchsorted(model.sparsity.corners, split.inside)
    assert len(inside) > 0 if model.mixed else len(inside) == 0
    assert abs(found.coupling - K[inside][:, own]).sum() <= 1e-9 * abs(found.coupling).sum()
    assert abs(found.compression + K[inside][:, inside]).sum() <= 1e-9 * abs(found.compression).sum()


@pytest.mark.parametrize("case", [which for which in CASES if which != "gas"], indirect=True)
def test_a_few_products_give_about_what_a_factorisation_gives(case, monkeypatch):
    """And many give the same. Of gas the pressures change too: see below."""
    exact = Tangent(case.there.model)
    exact.factorise(case.there, case.start)
    vector = case.there.model.vector(case.start)
    step = case.there.model.state(-exact.precondition(residual_at(case.there, vector)))
    stretched, few = step.plate[2], case.near()[1].plate[2] - case.start.plate[2]
    assert few == pytest.approx(stretched, rel=0.5, abs=2e-3 * abs(case.start.plate[2]))
    for name, value in (("PLAIN", 150), ("MIXED", 150), ("PLAIN_LEFT", 0.0), ("MIXED_LEFT", 0.0)):
        monkeypatch.setattr(refined, name, value)
    monkeypatch.setattr(refined, "CONTRACTING", np.inf)
    # What balances the last residual is of second order.
    monkeypatch.setattr(Split, "of_coarse", lambda self, c: np.zeros(self.coarse + self.free.size + len(self.inside)))
    many = case.near()[1]
    np.testing.assert_allclose(many.plate - case.start.plate, step.plate, atol=0.02 * np.abs(step.plate).max())


def test_pressures_of_gas_follow_the_volume_on_the_refined_mesh():
    case = Case("gas")
    there, state = case.near()
    solved = solve(case.there, Tangent(case.there.model), case.start)
    before, after = case.at.loads.pressure, there.loads.pressure
    assert after[0] == before[0]
    assert after[1] - before[1] == pytest.approx(solved.enclosed["B"] - before[1], rel=0.2)
    assert state.plate[0] - case.start.plate[0] == pytest.approx(solved.plate[0] - case.start.plate[0], rel=0.5)


@pytest.mark.parametrize("case", [which for which in CASES if which != "gas"], indirect=True)
def test_a_search_by_products_comes_to_the_state_that_factorisations_find(case):
    solved = solve(case.there, Tangent(case.there.model), case.start)
    found = search_refined(case.fine, case.at, case.tangent, case.state, case.there)
    difference = np.abs(solved.state.plate - case.start.plate).max()
    np.testing.assert_allclose(found.plate, solved.state.plate, atol=0.05 * difference)


def test_where_one_step_does_not_do_a_search_goes_on():
    """Of a body near ballooning, displacements of the coarser mesh are rough on the refined one."""
    task = TASK.replace("20 kPa", "260 kPa").replace("extension", "bending_y")
    problem = loads(problem_text(task, radius=10, chambers=TWO_BESIDE)).with_changes(
        {"mesh.size": "8 mm", "mesh.element": "quadratic"}
    )
    near = analyse_body(problem, starting_body(problem.tubes))
    at, state = near.analysis.configurations["move"], near.analysis.equilibria["move"].state
    fine, tangent = refine(near.disc.morph.mesh.at(near.analysis.X)), near.disc.tangents["move"]
    there = replace(at, model=model_of(problem, fine.mesh), X=fine.mesh.points)
    assert near_refined(fine, at, tangent, state, there) is None
    found = search_refined(fine, at, tangent, state, there)
    exact = solve(there, Tangent(there.model), found).state.plate
    np.testing.assert_allclose(found.plate, exact, atol=0.03 * np.abs(exact - state.plate).max())


def hanging(count, length=40.0, pull=2e7):
    """A bar that hangs under its weight and keeps its width: the change by one refinement, and the whole error, mm."""
    mesh = bar(10.0, length, (1, 1, count))
    supports = np.zeros(mesh.points.shape, bool)
    supports[:, :2] = True
    supports[np.unique(mesh.faces["base"])] = True

    def configured(mesh, supports):
        model = build_model(mesh, RUBBER, supports=supports)
        return configure(model, mesh.points, build_loads(model, {}, acceleration=np.array([0.0, 0.0, pull])))

    def stretch(z):
        """Where the stress carries what hangs below."""

        def excess(s):
            change = SHEAR * (s ** (1 / 3) - (2 + s * s) * s ** (-5 / 3) / 3) + BULK * (s - 1)
            return change - DENSITY * pull * (length - z)

        return brentq(excess, 1.0, 3.0, xtol=1e-14)

    at = configured(mesh, supports)
    tangent, fine = Tangent(at.model), refine(mesh)
    state = solve(at, tangent, at.model.state(np.zeros(at.model.size)), 1e-10).state
    finer = np.zeros(fine.mesh.points.shape, bool)
    finer[:, :2] = True
    finer[np.unique(fine.mesh.faces["base"])] = True
    _, near = near_refined(fine, at, tangent, state, configured(fine.mesh, finer))
    true = quad(lambda z: stretch(z) - 1.0, 0.0, length, epsabs=1e-10)[0] - state.plate[2]
    return near.plate[2] - state.plate[2], true


def test_the_change_of_a_hanging_bar_is_nearly_all_of_its_error_and_falls_with_it():
    """Its solution is smooth: errors of the tip fall with the fourth power, by one refinement to a sixteenth."""
    changes, errors = np.transpose([hanging(count) for count in (2, 4, 8)])
    assert np.all(np.log2(errors[:-1] / errors[1:]) > 3.0)
    np.testing.assert_allclose(changes, errors, rtol=0.25)


def test_a_uniform_state_has_no_error():
    """Where the fields of the coarser mesh have the solution, nothing changes."""
    mesh = bar(10.0, 20.0, (1, 1, 2))
    fine = refine(mesh)

    def configured(mesh):
        supports = np.zeros(mesh.points.shape, bool)
        supports[np.unique(mesh.faces["base"]), 2] = True
        supports[:, :2] = True
        model = build_model(mesh, RUBBER, supports=supports)
        return configure(model, mesh.points, build_loads(model, {}, wrench=np.array([0.0, 0.0, 60.0, 0.0, 0.0, 0.0])))

    at = configured(mesh)
    tangent = Tangent(at.model)
    state = solve(at, tangent, at.model.state(np.zeros(at.model.size)), 1e-12).state
    _, near = near_refined(fine, at, tangent, state, configured(fine.mesh))
    assert state.plate[2] > 1.0
    assert near.plate[2] == pytest.approx(state.plate[2], rel=1e-9)
