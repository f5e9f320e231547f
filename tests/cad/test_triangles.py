"""Bodies in files of triangles: the same body as in a STEP file, in any format, and what is refused."""

import io
import zipfile

import numpy as np
import pytest
from solids import cylinder, problem, written

from pneumorph.analysis.bodies import mesh_of
from pneumorph.cad.findings import findings_of, quarters
from pneumorph.cad.obj import read_obj
from pneumorph.cad.read import read_faces
from pneumorph.cad.stl import Surface
from pneumorph.cad.threemf import read_3mf
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry.starting import body_of
from pneumorph.problem import loads

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def stl(surface):
    records = np.zeros(len(surface.triangles), RECORD)
    records["corners"] = surface.points[surface.triangles]
    return bytes(80) + np.array([len(records)], "<u4").tobytes() + records.tobytes()


def obj(surface):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in surface.points.tolist()]
    return "\n".join([*lines, *(f"f {a}/1 {b}//2 {c}" for a, b, c in (surface.triangles + 1).tolist())]).encode()


def threemf(surface, unit="millimeter", transform=""):
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in surface.points.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in surface.triangles.tolist())
    text = (
        f'<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>'
        f'<object id="2"><components><component objectid="1"/></components></object></resources>'
        f'<build><item objectid="2"{transform}/></build></model>'
    )
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("3D/3dmodel.model", text)
    return file.getvalue()


@pytest.fixture(scope="module")
def surface(tmp_path_factory):
    """A tube with a void, in fine triangles."""
    path = written(cylinder(8, 0, 24) - cylinder(5, 3, 21), tmp_path_factory.mktemp("triangles") / "tube.step")
    faces = read_faces(path.read_bytes(), "step", 1.0, 2.0)
    return Surface(faces.points, quarters(faces.triangles))


@pytest.mark.parametrize("form", ["stl", "obj", "3mf"])
def test_formats_of_triangles_are_the_same_body(surface, tmp_path, form):
    write = {"stl": stl, "obj": obj, "3mf": threemf}[form]
    (tmp_path / f"tube.{form}").write_bytes(write(surface))
    asked = loads(problem(f"tube.{form}", size="4 mm"), folder=tmp_path)
    found = findings_of(asked.body.outline)
    assert found.volume == pytest.approx(np.pi * (64 * 24 - 25 * 18), rel=0.02)
    assert [chamber.name for chamber in asked.body.chamber] == ["A"]
    if form == "stl":
        mesh = mesh_of(asked, body_of(asked), ()).mesh
        assert mesh.volume() == pytest.approx(np.pi * (64 * 24 - 25 * 18), rel=0.01)
        assert set(mesh.faces) == {"base", "tip", "exterior", "chamber A"}


def test_units_and_scale(surface, tmp_path):
    (tmp_path / "tube.stl").write_bytes(stl(Surface(surface.points / 1000.0, surface.triangles)))
    asked = loads(problem("tube.stl", 'unit = "m"\nscale = 2.0', size="6 mm"), folder=tmp_path)
    assert asked.body.length == pytest.approx(48.0, rel=1e-5)


@pytest.mark.parametrize(("factor", "scale"), [(1e-3, "1000"), (1e3, "0.001")])
def test_units_that_are_mixed_up_are_noticed(surface, tmp_path, factor, scale):
    (tmp_path / "tube.stl").write_bytes(stl(Surface(surface.points * factor, surface.triangles)))
    with pytest.raises(ProblemError, match=f"give scale = {scale}$"):
        loads(problem("tube.stl", size="6 mm"), folder=tmp_path)


def test_3mf_has_its_own_unit_and_transforms(surface):
    turn = ' transform="0 1 0 -1 0 0 0 0 1 5 0 0"'
    found = read_3mf(threemf(surface, "centimeter", turn), 10_000)
    expected = np.stack([5.0 - surface.points[:, 1], surface.points[:, 0], surface.points[:, 2]], axis=1)
    np.testing.assert_allclose(found.points, 10.0 * expected, atol=1e-12)
    mirrored = read_3mf(threemf(surface, "inch", ' transform="-1 0 0 0 1 0 0 0 1 0 0 0"'), 10_000)
    volumes = [np.linalg.det(each.points[each.triangles]).sum() for each in (surface, mirrored)]
    assert volumes[1] == pytest.approx(25.4**3 * volumes[0])


def test_polygons_and_negative_numbers_in_obj():
    found = read_obj(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n# a square\nf -4 -3 -2 -1\n", 10)
    np.testing.assert_array_equal(found.triangles, [[0, 1, 2], [0, 2, 3]])


def spoiled(surface, how):
    points, triangles = surface
    outside = np.abs(points[triangles]).max(axis=(1, 2)) > 7.9
    if how == "open":
        return Surface(points, triangles[1:])
    if how == "turned":
        return Surface(points, np.vstack([triangles[:1, ::-1], triangles[1:]]))
    if how == "inside out":
        return Surface(points, triangles[:, ::-1])
    if how == "void turned":
        inner = points[triangles][:, :, 2].min(axis=1) > 2.9
        inner &= np.hypot(*np.moveaxis(points[triangles][:, :, :2], 2, 0)).max(axis=1) < 5.1
        inner &= points[triangles][:, :, 2].max(axis=1) < 21.1
        return Surface(points, np.vstack([triangles[inner][:, ::-1], triangles[~inner]]))
    if how == "three at an edge":
        return Surface(points, np.vstack([triangles, triangles[:1]]))
    assert how == "many" and outside.any()
    return Surface(points, np.tile(triangles, (60, 1)))


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("open", "3 open edges, the first at ("),
        ("turned", "not turned alike, at ("),
        ("inside out", "inside out"),
        ("void turned", "closed surface inside, at (0, 0, 12) mm"),
        ("three at an edge", "more than two faces meet"),
        ("many", "MB when compressed, more than"),
    ],
)
def test_wrong_surfaces_are_refused_in_a_line_with_a_place(surface, tmp_path, how, said):
    (tmp_path / "wrong.stl").write_bytes(stl(spoiled(surface, how)))
    with pytest.raises(ProblemError, match=r"body\.file") as error:
        loads(problem("wrong.stl"), folder=tmp_path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("form", ["stl", "obj", "3mf"])
@pytest.mark.parametrize("data", [b"", b"nonsense " * 50, b"PK\x03\x04" + b"x" * 99, b"solid\nendsolid\n"])
def test_files_of_something_else(form, data):
    with pytest.raises(ComputationError) as error:
        read_faces(data, form)
    assert "again" in str(error.value) or "closed" in str(error.value)
