"""Triangles: closed, oriented, near enough, and through a file and back."""

import locale
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import enclosed_volume

make = pytest.importorskip("pneumorph.make", reason="needs the extra cad")
manifold3d = pytest.importorskip("manifold3d")
from pneumorph.make.checks import crossings  # noqa: E402


def solid_of(part):
    return manifold3d.Manifold(manifold3d.Mesh64(part.points, part.corners.astype(np.uint64)))


def test_closed_and_oriented(body):
    part = make.triangulate(body.surfaces, 0.1)
    solid = solid_of(part)
    assert solid.status() == manifold3d.Error.NoError
    assert solid.num_tri() == len(part.corners) and solid.num_vert() == len(part.points)
    assert len(solid.decompose()) == len(body.surfaces)
    assert crossings(part, solid) == 0
    assert part.volume > 0
    for chamber in body.chambers:
        assert make.triangulate([make.fill_chamber(chamber)], 0.1).volume == pytest.approx(
            enclosed_volume(chamber), rel=0.1
        )


@pytest.mark.parametrize("chord", [0.2, 0.05, 0.01])
def test_the_chord_error_is_kept(bodies, chord):
    """On a round tube it is measured at the middles of edges and triangles; and not kept much better than asked for."""
    exterior = bodies("plain").exterior
    part = make.triangulate([exterior], chord)
    corners = part.points[part.corners]
    wall = corners[np.ptp(corners[..., 2], axis=1) > 1e-6]
    middles = np.concatenate([wall.mean(axis=1), (wall + np.roll(wall, 1, axis=1)).reshape(-1, 3) / 2.0])
    off = 8.0 - np.linalg.norm(middles[:, :2], axis=1)
    assert chord / 6.0 < off.max() <= chord


def test_walls_that_cross_are_found(bodies):
    body = bodies("flat")
    (chamber,) = body.chambers
    moved = replace(chamber, net=chamber.net + np.array([5.0, 0.0, 0.0]))
    part = make.triangulate(Body(body.exterior, (moved,)).surfaces, 0.1)
    assert crossings(part, solid_of(part)) > 0


def test_a_surface_that_crosses_itself_is_found(bodies):
    exterior = bodies("flat").exterior
    net = exterior.net.copy()
    # Two neighbouring rows change places and go far apart: the wall runs back through itself.
    net[[8, 9]] = net[[9, 8]] + np.array([[[0.0, 0.0, 4.0]], [[0.0, 0.0, -4.0]]])
    net[8] *= [1.3, 1.3, 1.0]
    part = make.triangulate([replace(exterior, net=net)], 0.1)
    assert crossings(part, solid_of(part)) > 0


def test_too_many(bodies):
    with pytest.raises(ComputationError, match="allow a larger error"):
        make.triangulate(bodies("flat").surfaces, 1e-9)


def test_3mf_and_stl(body, tmp_path):
    part = make.triangulate(body.surfaces, 0.1)
    cores = {chamber.name: make.triangulate([make.fill_chamber(chamber)], 0.1) for chamber in body.chambers}
    make.write_3mf(tmp_path / "body.3mf", {"body": part, **cores})
    make.write_stl(tmp_path / "body.stl", part)
    read = make.read_3mf(tmp_path / "body.3mf")
    assert list(read) == ["body", *cores]
    for name, expected in {"body": part, **cores}.items():
        assert np.array_equal(read[name].corners, expected.corners)
        assert np.abs(read[name].points - expected.points).max() < 1e-5
    stl = make.read_stl(tmp_path / "body.stl")
    assert stl.points.shape == part.points.shape and stl.volume == pytest.approx(part.volume, rel=1e-5)
    text = zipfile.ZipFile(tmp_path / "body.3mf").read("3D/3dmodel.model").decode()
    assert 'unit="millimeter"' in text and "transform" not in text
    # The body alone is built.
    assert text.count("<item") == 1 and text.count('type="other"') == len(cores)


def test_the_locale_stays(body, tmp_path):
    """lib3mf changes it, and with it the encoding of all files that the process opens later."""
    before = locale.setlocale(locale.LC_ALL)
    make.write_3mf(tmp_path / "body.3mf", {"body": make.triangulate(body.surfaces, 0.2)})
    make.read_3mf(tmp_path / "body.3mf")
    assert locale.setlocale(locale.LC_ALL) == before
