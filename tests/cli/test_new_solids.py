"""Bodies to start from: the files are sound, and a PneuNet bends as far as one of its size is known to."""

import numpy as np
import pytest

from pneumorph.cad.bodies import Dome, Pneunet, write_step
from pneumorph.cad.findings import findings_of
from pneumorph.interface.design import starting_design
from pneumorph.problem import load
from pneumorph.problem.starts import SOLIDS


def test_a_dome_has_the_volumes_of_its_parts(run, tmp_path):
    result = run("new", tmp_path / "lift", "--kind", "dome", "--size", "radius=15mm", "--size", "wall=3mm")
    assert result.exit_code == 0
    asked = load(tmp_path / "lift.toml")
    found = findings_of(asked.body.faces(2.0))
    assert -found.shells.voids[0].volume == pytest.approx(2 / 3 * np.pi * 12**3, rel=1e-3)
    assert found.wall.thickness == pytest.approx(3.0, rel=0.03)
    assert asked.title == "Lift"


@pytest.mark.slow
def test_a_pneunet_bends(run, tmp_path):
    assert run("new", tmp_path / "finger", "--kind", "pneunet").exit_code == 0
    asked = load(tmp_path / "finger.toml")
    sizes = Pneunet()
    assert np.ptp(asked.body.outline.points, axis=0) == pytest.approx([sizes.height, sizes.width, sizes.length])
    found = findings_of(asked.body.outline)
    assert len(found.shells.voids) == 1
    assert found.wall.thickness == pytest.approx(sizes.wall)
    # 66.7° at 40 kPa with 83,000 unknowns.
    step = starting_design(asked).simulate().steps[0]
    assert np.degrees(step.rotation[1]) == pytest.approx(-66.7, rel=0.03)
    assert step.stable


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--kind", "dome", "--size", "wall=30mm"), "no room"),
        (("--kind", "pneunet", "--size", "chambers=40"), "no room"),
        (("--kind", "pneunet", "--size", "chambers=0"), "not between"),
        (("--kind", "pneunet", "--size", "wall=2"), "unit"),
        (("--kind", "pneunet", "--size", "depth=2mm"), "use one of length, width"),
        (("--kind", "finger", "--size", "length=2mm"), "is for pneunet and dome"),
    ],
)
def test_sizes_that_are_refused(run, tmp_path, arguments, said):
    result = run("new", tmp_path / "robot", *arguments)
    assert result.exit_code == 2 and said in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", SOLIDS)
def test_files_that_exist_stay(run, tmp_path, kind):
    (tmp_path / "robot.step").write_text("mine")
    assert run("new", tmp_path / "robot", "--kind", kind).exit_code == 2
    assert (tmp_path / "robot.step").read_text() == "mine"


def test_bodies_can_be_written_again(tmp_path):
    for number in range(2):
        write_step(Dome(), tmp_path / f"{number}.step")
        assert (tmp_path / f"{number}.step").stat().st_size > 1000
