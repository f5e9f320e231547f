"""Chains of rigid links: as near to exact states as they say, and in MuJoCo what they are here."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import tiny as problems
from texts import problem_text
from typer.testing import CliRunner

import pneumorph as pm
from pneumorph.cli import app
from pneumorph.problem import loads

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

REST = problems.REST.replace('A = "60 kPa"', 'A = "30 kPa", B = "20 kPa"')
CHAMBERS = (("A", 1.6, "4 mm", "0 mm"), ("B", 1.6, "-4 mm", "0 mm"))
TWO = problem_text(REST, chambers=CHAMBERS, body='control_density = "0.3 /mm"')


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("chain") / "two.xml"
    design = pm.starting_design(loads(TWO))
    return design, design.export_chain(path), path


def test_the_tip_is_as_near_as_it_says(written):
    design, chain, _ = written
    explorer, off = design.explorer(), []
    for p in ({"A": 0.03, "B": 0.0}, {"A": 0.02, "B": 0.015}):
        step = explorer.at(p).step
        place, turn = chain.tip(np.array([p["A"], p["B"]]))
        off.append(np.linalg.norm(place - [0, 0, 24.0] - step.translation))
        assert np.linalg.norm(turn.as_rotvec() - step.rotation) < 3 * chain.off[:, 1].max()
    assert max(off) < 3 * chain.off[:, 0].max() < 0.2 * chain.spans[0]
    assert 0.5 < chain.sideways < 1.05


def test_springs_in_series_are_as_soft_as_the_tip(written):
    design, chain, _ = written
    (step,) = design.simulate({"A": "0 kPa", "B": "0 kPa"}, stiffness=True).steps
    soft = np.diag(step.stiffness.compliance)[[2, 3, 4, 5]]
    np.testing.assert_allclose((1 / chain.stiffness).sum(axis=0), soft, rtol=1e-6)


def test_the_file_has_si_units_and_a_tendon_for_every_chamber(written):
    _, chain, path = written
    root = ElementTree.parse(path).getroot()
    joints = {each.get("name"): each for each in root.iter("joint") if each.get("name")}
    assert len(joints) == chain.rest.size
    assert float(joints["about_y_2"].get("stiffness")) == pytest.approx(1e-3 * chain.stiffness[1, 2], rel=1e-5)
    assert [each.get("tendon") for each in root.iter("motor")] == ["A", "B"]
    heights = sum(float(each.get("pos").split()[2]) for each in root.iter("body"))
    tip = next(root.iter("site"))
    assert heights + float(tip.get("pos").split()[2]) == pytest.approx(0.024, abs=1e-6)


def test_mujoco_finds_the_same_tip(written):
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    _, chain, path = written
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.ctrl[:] = [30.0, 10.0]
    for _ in range(int(0.5 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    place, _ = chain.tip(np.array([0.03, 0.01]))
    assert np.abs(1e3 * data.site("tip").xpos - place).max() < 1e-3 * chain.spans[0]


def test_what_cannot_be_a_chain_is_told_in_a_line(tmp_path):
    held = TWO.replace('spring = { axial = "0 N/mm" }', 'hold = ["axial"]')
    (tmp_path / "held.toml").write_text(held)
    result = CliRunner().invoke(app, ["export", str(tmp_path / "held.toml"), "--out", str(tmp_path / "held.xml")])
    assert result.exit_code == 2 and "held" in result.stderr and result.stderr.count("\n") == 1


def test_a_bent_axis_is_no_chain(tmp_path):
    bent = TWO.replace('length = "24 mm"', 'axis = [{ length = "24 mm", bend = "30 deg" }]')
    (tmp_path / "bent.toml").write_text(bent)
    result = CliRunner().invoke(app, ["export", str(tmp_path / "bent.toml"), "--out", str(tmp_path / "bent.xml")])
    assert result.exit_code == 2 and "bent axis" in result.stderr and result.stderr.count("\n") == 1
