"""STEP files: the design's own surfaces, read again by the OpenCASCADE that Netgen brings, which is another release."""

import subprocess
import sys

import numpy as np
import pytest
from netgen.occ import OCCGeometry
from scipy.interpolate import BSpline

from pneumorph.geometry.starting import body_of
from pneumorph.geometry.tube.surface import enclosed_volume
from pneumorph.interface.design import starting_design
from pneumorph.problem import loads

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

make = pytest.importorskip("pneumorph.make", reason="needs the extra cad")
from pneumorph.make.patches import ALONG, patches  # noqa: E402

SECOND_LIBRARY = """
import netgen.occ
from pathlib import Path
from pneumorph.make import read_step
print(read_step(Path("{path}")).NbChildren())
"""


def volume(body):
    return enclosed_volume(body.exterior) - sum(map(enclosed_volume, body.chambers))


def clamped(knots):
    return np.concatenate([[knots[0]] * 3, knots, [knots[-1]] * 3])


def test_patches_are_the_same_polynomials(body):
    for surface in body.surfaces:
        rows = patches(surface)
        assert sum(len(row[0].r) - 1 for row in rows) == surface.basis_r.spans
        for patch in (patch for row in rows for patch in row):
            assert len(patch.r) <= ALONG + 1
            q, r = np.linspace(*patch.q[[0, -1]], 23), np.linspace(*patch.r[[0, -1]], 29)
            along_q = BSpline(clamped(patch.q), patch.poles, 3)(q)
            found = BSpline(clamped(patch.r), np.moveaxis(along_q, 1, 0), 3)(r)
            assert np.abs(found - surface.sample(q, r)).max() < 1e-13


def test_the_body_is_one_solid_of_the_exact_volume(body, tmp_path):
    make.write_body_step(body, tmp_path / "body.step")
    read = OCCGeometry(str(tmp_path / "body.step")).shape
    flat = sum(surface.ends.count("flat") for surface in body.surfaces)
    assert len(read.solids) == 1
    assert len(read.faces) == flat + sum(2 * len(patches(surface)) for surface in body.surfaces)
    assert read.mass == pytest.approx(volume(body), rel=1e-6)
    low, high = read.bounding_box
    assert (low.z, high.z) == pytest.approx((0.0, 30.0), abs=1e-3)


def test_chambers_are_solids_of_their_own(body, tmp_path):
    for chamber in body.chambers:
        path = tmp_path / f"{chamber.name}.step"
        make.write_chamber_step(chamber, path)
        read = OCCGeometry(str(path)).shape
        assert len(read.solids) == 1
        assert read.mass == pytest.approx(enclosed_volume(chamber), rel=1e-6)
        assert f"PRODUCT('chamber {chamber.name}'" in path.read_text(encoding="utf-8")


def test_names_units_and_shells_are_in_the_file(bodies, tmp_path):
    make.write_body_step(bodies("several"), tmp_path / "body.step")
    text = tmp_path.joinpath("body.step").read_text(encoding="utf-8")
    assert "PRODUCT('body'" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    assert "BREP_WITH_VOIDS" in text and text.count("= ORIENTED_CLOSED_SHELL(") == 3


def test_nothing_is_printed(bodies, tmp_path, capfd):
    make.write_body_step(bodies("flat"), tmp_path / "body.step")
    make.read_step(tmp_path / "body.step")
    assert capfd.readouterr() == ("", "")


def test_files_that_cannot_be(bodies, tmp_path):
    with pytest.raises(OSError, match="cannot be written"):
        make.write_body_step(bodies("flat"), tmp_path / "none" / "body.step")
    with pytest.raises(OSError, match="not a STEP file"):
        make.read_step(tmp_path / "none.step")


def test_both_releases_of_opencascade_in_one_process(bodies, tmp_path):
    """Loaded first, Netgen's gives its symbols to whatever comes after; another one then crashed."""
    path = tmp_path / "body.step"
    make.write_body_step(bodies("poles"), path)
    done = subprocess.run(
        [sys.executable, "-c", SECOND_LIBRARY.format(path=path)], capture_output=True, encoding="utf-8"
    )
    assert (done.returncode, done.stdout) == (0, "2\n"), done.stderr


DOMED = """
[material]
model = "neo-hookean"
shear_modulus = "0.15 MPa"
bulk_modulus = "1.5 MPa"
density = "1.1 g/cm^3"
{body}
symmetry = {{ mirror = ["xz"] }}
[[body.chamber]]
name = "A"
{chamber}
[end_effector]
kind = "plate"
[[task]]
name = "bend"
pressure = {{ A = "30 kPa" }}
objective = {{ kind = "maximize", motion = "bending_y" }}
[mesh]
size = "1.3 mm"
"""
TUBE = {
    "body": '[body]\n{axis}\nradius = "8 mm"\ncontrol_density = "0.4 /mm"\ndome = {{ plate = "3 mm" }}',
    "chamber": 'radius = "4 mm"\ncenter = ["1.5 mm", "0 mm"]\nspan = ["4 mm", "20 mm"]\nends = "pole"',
}
STEP = {
    "body": '[body]\nfile = "domed.step"\ntip = { name = "tip" }',
    "chamber": 'inside = ["1.5 mm", "0 mm", "8 mm"]',
}
AXES = {"straight": 'length = "26 mm"', "bent": 'axis = [{ length = "26 mm", bend = "50 deg" }]'}


@pytest.fixture(params=AXES)
def domed(request, tmp_path):
    """The problem of a tube with a dome, and that of its STEP file."""
    tube = loads(DOMED.format(**TUBE | {"body": TUBE["body"].format(axis=AXES[request.param])}))
    make.write_body_step(body_of(tube), tmp_path / "domed.step")
    return tube, loads(DOMED.format(**STEP), folder=tmp_path)


def test_what_is_bonded_of_a_dome_is_a_face_that_is_named(domed):
    tube, file = domed
    # The outline of the file has large triangles, which are flatter than the cap.
    np.testing.assert_allclose(file.body.ends, tube.body.ends, atol=0.05)
    tip = file.body.outline.triangles[file.body.parts.triangles["tip"]]
    points = file.body.outline.points[np.unique(tip[:, :3])]
    place, along = tube.body.farthest[1], np.array(body_of(tube).exterior.directions[1])
    heights = (points - place) @ along
    assert heights.max() == pytest.approx(0.0, abs=1e-6)
    assert np.linalg.norm(points - place - heights[:, None] * along, axis=1).max() == pytest.approx(3.0, abs=0.01)


@pytest.mark.slow
def test_a_domed_tube_moves_like_its_file(domed):
    moved = [starting_design(each).simulate().steps[0] for each in domed]
    one, other = (np.array(each.translation) for each in moved)
    assert np.linalg.norm(one - other) < 3e-3 * np.linalg.norm(one)
