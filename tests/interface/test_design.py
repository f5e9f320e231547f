"""Designs in Python: what is stored is read, what is not is computed, and half bodies leave as whole ones."""

import signal
import sys
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from runs import line
from tiny import tiny

import pneumorph as pm
from pneumorph.analysis import analyse, collect_fields, discretise
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.interface import design as module
from pneumorph.interface import sweep as sweeps
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import loads
from pneumorph.results import Fields
from pneumorph.run import StoredDesign, create

HALF = tiny().replace("[[body.chamber]]", 'symmetry = { mirror = ["xz"] }\n[[body.chamber]]')


@pytest.fixture(scope="module")
def start():
    """The starting design of a body of which half is analysed."""
    return pm.starting_design(loads(HALF))


def test_fields_are_computed_where_none_are_stored(start):
    assert start.stored is None
    fields = start.fields
    assert fields.mesh.mirrors == (), "always the whole body"
    (u,) = fields.u.values()
    assert u[:, 1].min() == pytest.approx(-u[:, 1].max())
    assert start.results["extend"].translation[2] == pytest.approx(u[fields.mesh.faces["tip"], 2].mean())


def test_stored_fields_are_not_computed_again(start, monkeypatch):
    problem = start.problem
    space = build_design_space(problem, start.body)
    disc = discretise(problem, start.body)
    stored = collect_fields(disc, analyse(problem, space, disc, space.start))
    again = pm.Design(problem, start.body, start.pressures, stored=stored)
    computed = start.fields.u["extend"]  # now, for no other test of this process may have asked for them
    monkeypatch.setattr(module, "discretise", None)
    np.testing.assert_allclose(again.fields.u["extend"], computed, atol=1e-6)
    assert again.mesh.n_cells == 2 * len(stored.mesh.tets)


def test_the_grid(start):
    grid, moved = start.mesh, start.deformed()
    assert set(grid.point_data) == {"extend displacement", "extend stretch", "extend stress"}
    assert set(grid.celltypes) == {pv.CellType.QUADRATIC_TETRA}
    assert grid.volume == pytest.approx(start.fields.mesh.volume(), rel=3e-2)
    np.testing.assert_allclose(moved.points - grid.points, grid.point_data["extend displacement"], atol=1e-12)
    assert moved.point_data["stress"].max() > 0.01
    with pytest.raises(ProblemError, match='no task "bend"; use one of extend'):
        start.deformed("bend")


def test_exports(start, tmp_path):
    start.export(tmp_path / "deep" / "body.vtu")
    grid = pv.read(tmp_path / "deep" / "body.vtu")
    np.testing.assert_allclose(grid.point_data["extend displacement"], start.fields.u["extend"])
    start.export(tmp_path / "body.dat", format="inp")
    text = (tmp_path / "body.dat").read_text(encoding="utf-8")
    assert text.count("*ELEMENT, TYPE=C3D10") == 1 and "P" in text
    start.export(tmp_path / "named.dat", format="vtu")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["body.dat", "deep", "named.dat"]
    for path, format, words in (
        (
            tmp_path / "body.stl",
            None,
            '"stl" is not a known format; use one of vtu, inp, msh, feb, py, xml; STL, 3MF and STEP of a run',
        ),
        (tmp_path, "inp", "cannot be written"),
    ):
        with pytest.raises(ProblemError, match=words):
            start.export(path, format)


def test_a_rubber_that_an_input_file_cannot_hold(start, tmp_path):
    gent = {"model": "gent", "shear_modulus": "0.3 MPa", "limit": 30.0, "bulk_modulus": "30 MPa"}
    other = pm.starting_design(start.problem.with_changes({"material": gent | {"density": "1.1 g/cm^3"}}))
    alike = pm.Design(other.problem, other.body, other.pressures, stored=start.fields)
    with pytest.raises(ProblemError, match="cannot hold Gent's model, which body has"):
        alike.export(tmp_path / "body.inp")
    alike.export(tmp_path / "body.feb")


def test_a_sweep(start, tmp_path):
    sweep = start.simulate({"A": "0:40:20 kPa"}, block="axial")
    assert [step.pressures["A"] for step in sweep.steps] == pytest.approx([0.0, 0.02, 0.04])
    assert sweep.steps[-1].reaction["axial"] > 0.1
    assert sweep.to_json()["steps"][0]["pressure_MPa"] == {"A": 0.0}
    assert sweep.to_csv().count("\n") == 4
    figure = sweep.plot(tmp_path / "sweep.png")
    assert figure.get_suptitle() == "Tiny, blocked: extension"
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ProblemError, match="no sweep to draw"):
        sweeps.Sweep(sweep.simulation, [], 0.0).plot()


def test_a_table_for_pandas(start, monkeypatch):
    sweep = start.simulate()
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "pandas", None)
        with pytest.raises(ProblemError, match="pip install pneumorph"):
            sweep.to_pandas()
    pytest.importorskip("pandas")
    frame = sweep.to_pandas()
    assert list(frame["pressure_A_kPa"]) == [60.0]


def test_a_design_is_simulated_at_its_own_pressures(start):
    softer = pm.Design(start.problem, start.body, {"extend": {"A": 0.02}})
    assert softer.simulate().steps[0].pressures == {"A": 0.02}
    assert softer.results["extend"].pressures == {"A": 0.02}


def test_a_run_that_has_nothing_yet(tmp_path):
    (tmp_path / "problem.toml").write_text(HALF)
    with pytest.raises(ProblemError, match="has no finished design yet"):
        _ = pm.open_run(tmp_path).best


@pytest.mark.slow
def test_an_interrupted_design_is_kept(tmp_path):
    """In Python, Ctrl-C is KeyboardInterrupt, wherever it comes."""
    problem = loads(tiny())

    def show(event):
        if getattr(event, "iteration", None) == 1:
            signal.raise_signal(signal.SIGINT)

    # As in any program; libraries that other tests use may have left something else.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            pm.design(problem, out=tmp_path / "run", show=show)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    run = pm.open_run(tmp_path / "run")
    assert run.latest == 1 and run.best.entry.iteration == 1 and run.result is None
    assert pm.design(problem, out=tmp_path / "run", resume=True).latest == 2


@pytest.mark.parametrize("changes", [{"symmetry": {"mirror": ["xz"]}}, {}], ids=["a mirror plane", "an end"])
def test_control_points_that_are_no_design_of_the_problem(tmp_path, changes):
    problem = loads(tiny()).with_changes({f"body.{key}": value for key, value in changes.items()})
    stored = StoredDesign.of(starting_body(problem.tubes), {"extend": {"A": 0.06}})
    run = create(tmp_path / "run", problem)
    mesh = mesh_body(starting_body(problem.tubes), 8.0).mesh
    fields = Fields(mesh, {"extend": 0.0 * mesh.points}, {"extend": np.ones(len(mesh.points))})
    run.record(line(problem, 0, stored.pressures), stored, fields, {})
    assert pm.open_run(run.path).best.iteration == 0

    place = tmp_path / "run" / "designs" / "0000.npz"
    arrays = dict(np.load(place))
    arrays["exterior"][0, 1] += [0.0, 0.02, 0.01]
    np.savez(place, **arrays)
    with pytest.raises(ProblemError, match=r"0\.0\d+ mm"):
        _ = pm.open_run(run.path).best


def test_every_task_is_explored_on_the_mesh_that_is_stored(start):
    """That of a design has been moved from one design to the next: a new one would have other errors."""
    tasks = [*start.problem.task, start.problem.task[0].model_copy(update={"name": "again"})]
    mesh = start.fields.mesh
    stored = replace(start.fields, mesh=replace(mesh, points=1.001 * mesh.points))
    design = replace(start, problem=start.problem.model_copy(update={"task": tuple(tasks)}), stored=stored)
    for task in ("extend", "again"):
        np.testing.assert_allclose(design.explorer(task).mesh({"A": 0.03}).points, stored.mesh.points)
