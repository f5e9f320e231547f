"""Bodies to start from: their files are sound, their sizes as asked for, and a PneuNet bends as far as is known."""

import doctest
import inspect

import numpy as np
import pytest
from typer.testing import CliRunner

import pneumorph as pm
from pneumorph import bodies
from pneumorph.analysis.bodies import mesh_of
from pneumorph.cad.findings import findings_of
from pneumorph.cli import app
from pneumorph.cli.new import BODIES
from pneumorph.geometry.starting import body_of
from pneumorph.interface.design import starting_design
from pneumorph.limits.limit import ROUNDING
from pneumorph.problem import load

pytestmark = pytest.mark.usefixtures("without_mesh_errors")


@pytest.fixture
def run():
    """Run the command with arguments; the result has exit_code and stderr."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


SOLIDS = [kind for kind in BODIES if kind != "half-round"]


@pytest.mark.parametrize("kind", BODIES)
def test_a_kind_is_meshed_and_its_text_is_whole(run, tmp_path, kind):
    path = tmp_path / "my_robot.toml"
    assert run("new", tmp_path / "my_robot", "--kind", kind).exit_code == 0
    problem, text = load(path), path.read_text(encoding="utf-8")
    assert problem.title == "My robot"
    assert "$" not in text and "FILE" not in text and "STEP" not in text
    assert max(len(line) for line in text.replace(str(path), "").splitlines()) <= 125
    mesh = mesh_of(problem, body_of(problem), (), 2.0 * problem.mesh.size).mesh
    assert all(len(mesh.faces[f"chamber {each.name}"]) for each in problem.body.chamber)


@pytest.mark.parametrize("kind", [kind for kind in SOLIDS if kind != "cup"])
def test_walls_are_as_thick_as_asked(tmp_path, kind):
    """The default of `wall`, for each of as many closed voids as there are chambers."""
    problem = load(BODIES[kind]().write(tmp_path / "robot"))
    found = findings_of(problem.body.outline)
    wall = float(inspect.signature(BODIES[kind]).parameters["wall"].default.removesuffix(" mm"))
    assert found.wall.thickness == pytest.approx(wall, rel=0.05)
    assert problem.limits.wall < wall
    assert len(found.shells.voids) == len(problem.body.chamber) == (3 if kind == "hand" else 1)


@pytest.mark.parametrize("kind", ["dome", "bellows", "pneunet", "fast_pneunet"])
def test_a_body_of_odd_sizes_is_within_its_own_envelope(kind, tmp_path):
    """Base and tip stay, so that no design could make up for rounded numbers."""
    sizes = {
        "dome": {"radius": "13.63127 mm", "wall": "2.15437 mm", "floor": "2.71828 mm"},
        "bellows": {"pitch": "10.31416 mm", "floor": "4.27183 mm", "folds": 2},
    }
    row = {"length": "61.41593 mm", "height": "17.34567 mm", "chambers": 3}
    problem = load(getattr(bodies, kind)(**sizes.get(kind, row)).write(tmp_path / "odd"))
    lower, upper = np.sort(problem.limits.envelope.box, axis=0)
    points = problem.body.outline.points
    assert max((points - upper).max(), (lower - points).max()) <= ROUNDING
    assert np.ptp(points[:, 2]) == pytest.approx(upper[2] - lower[2], abs=ROUNDING)


@pytest.mark.parametrize("name", [name for name in bodies.__all__ if name[0].islower()])
def test_examples_of_docstrings_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    [example] = doctest.DocTestFinder().find(getattr(bodies, name), name, globs={"pm": pm})
    assert doctest.DocTestRunner().run(example).failed == 0 and example.examples


def test_a_dome_has_the_volume_of_half_a_ball(run, tmp_path):
    result = run("new", tmp_path / "lift", "--kind", "dome", "--size", "radius=15mm", "--size", "wall=3mm")
    assert result.exit_code == 0
    found = findings_of(load(tmp_path / "lift.toml").body.faces(2.0))
    assert -found.shells.voids[0].volume == pytest.approx(2 / 3 * np.pi * 12**3, rel=1e-3)


def test_a_bellows_has_the_volume_of_its_cones(tmp_path):
    """Of the void: frustums whose radii are less than those outside by the wall over the cosine of the slope."""
    problem = load(
        bodies.bellows("15 mm", "12 mm", pitch="8 mm", folds=2, wall="1.6 mm", floor="3 mm").write(tmp_path / "b")
    )
    inwards = 1.6 * np.hypot(1.0, 3.0 / 4.0)
    crest, neck = 15.0 - inwards, 12.0 - inwards
    frustum = np.pi * 4.0 / 3.0 * (crest**2 + crest * neck + neck**2)
    found = findings_of(problem.body.faces(1.0))
    assert -found.shells.voids[0].volume == pytest.approx(4.0 * frustum, rel=2e-3)
    assert problem.body.length == pytest.approx(2 * 8.0 + 2 * 3.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", BODIES)
def test_a_kind_is_within_its_limits_and_is_solved(tmp_path, kind):
    problem = load(BODIES[kind]().write(tmp_path / "robot"))
    design = starting_design(problem.with_changes({"mesh.size": f"{2.0 * problem.mesh.size} mm"}))
    assert all(limit.satisfied() for limit in design.limits)
    pressures = {each.name: "-2 kPa" if kind == "cup" else "2 kPa" for each in problem.body.chamber}
    [step] = design.simulate(pressures).steps
    assert step.stable and step.volumes


@pytest.mark.slow
def test_a_pneunet_bends(tmp_path):
    asked = load(bodies.fast_pneunet().write(tmp_path / "finger"))
    assert np.ptp(asked.body.outline.points, axis=0) == pytest.approx([18.0, 16.0, 80.0])
    # 66.7° at 40 kPa with 83,000 unknowns.
    step = starting_design(asked.with_changes({"mesh.size": "4 mm"})).simulate().steps[0]
    assert np.degrees(step.rotation[1]) == pytest.approx(-66.7, rel=0.03)
    assert step.stable


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--kind", "dome", "--size", "wall=30mm"), "--size wall: 30 mm is not between 0.8 and"),
        (("--kind", "dome", "--size", "boss=18mm"), "--size boss: "),
        (("--kind", "fast-pneunet", "--size", "chambers=40"), "--size length: "),
        (("--kind", "fast-pneunet", "--size", "chambers=0"), "--size chambers: "),
        (("--kind", "fast-pneunet", "--size", "chambers=2.5"), "--size chambers: "),
        (("--kind", "fast-pneunet", "--size", "wall=2"), "--size wall: "),
        (("--kind", "fast-pneunet", "--size", "gap=0.2mm"), "--size gap: "),
        (("--kind", "pneunet", "--size", "rib=0.2mm"), "--size rib: "),
        (("--kind", "pneunet", "--size", "channel=9mm"), "--size channel: "),
        (("--kind", "pneunet", "--size", "depth=2mm"), "use one of length, width"),
        (("--kind", "bellows", "--size", "neck=20mm"), "--size radius: "),
        (("--kind", "bellows", "--size", "wall=12mm"), "--size wall: "),
        (("--kind", "hand", "--size", "opening=8mm"), "--size opening: "),
        (("--kind", "hand", "--size", "fingers=9"), "--size fingers: "),
        (("--kind", "half-round", "--size", "wall=6mm"), "--size wall: "),
        (("--kind", "half-round", "--size", "corner=9mm"), "--size corner: "),
        (("--kind", "finger", "--size", "length=2mm"), "--size: is for pneunet, fast-pneunet, dome"),
    ],
)
def test_sizes_that_are_refused(run, tmp_path, arguments, said):
    result = run("new", tmp_path / "robot", *arguments)
    assert result.exit_code == 2 and said in result.stderr and result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", SOLIDS)
def test_files_that_exist_stay(run, tmp_path, kind):
    (tmp_path / "robot.step").write_text("mine")
    assert run("new", tmp_path / "robot", "--kind", kind).exit_code == 2
    assert (tmp_path / "robot.step").read_text() == "mine"


def test_sizes_may_be_quantities(tmp_path):
    import pint

    path = bodies.dome(1.5 * pint.UnitRegistry().cm).write(tmp_path / "dome")
    # With its floor, and half a wall of the boss.
    assert load(path).body.length == pytest.approx(15.0 + 4.0 + 1.5)
