"""Files of bodies from files: their own faces, displaced, as STEP; and closed triangles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from netgen.occ import OCCGeometry
from solids import box, cylinder, occ, problem, written

from pneumorph.geometry.starting import body_of, space_of
from pneumorph.optimize.smoothing import build_smoothing
from pneumorph.problem import loads

make = pytest.importorskip("pneumorph.make", reason="needs the extra cad")
from pneumorph.make.checks import distances  # noqa: E402
from pneumorph.make.faces.checks import check_solids, points_of, volume_within  # noqa: E402
from pneumorph.make.faces.files import make_faces  # noqa: E402
from pneumorph.make.faces.splines import evaluated, fitted  # noqa: E402
from pneumorph.make.faces.triangles import triangulated  # noqa: E402

DESIGN = """
[design]
spacing = "5 mm"
keep = [{ within = [["3 mm", "3 mm", "0 mm"], ["7.5 mm", "7.5 mm", "4 mm"]] }]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A file with a block: rounded edges, a slanted side, a screw hole, and a cylinder with half a ball as void."""
    where = tmp_path_factory.mktemp("faces")
    block = box((-8, -8, 0), (8, 8, 24))
    block = block.MakeFillet([edge for edge in block.edges if abs(edge.start.z - edge.end.z) > 1], 3.0)
    void = cylinder(4, 5, 16) + occ().Sphere(occ().Pnt(0, 0, 16), 4)
    slant = box((0, 0, 0), (30, 30, 30)).Rotate(occ().Axis(occ().Pnt(0, 0, 0), occ().X), 20).Move((6, -8, 10))
    written(block - void - cylinder(1.2, -1, 3.5, 5.5, 5.5) - slant, where / "block.step")
    return where


@pytest.fixture(scope="module")
def asked(folder):
    return loads(problem("block.step", size="4 mm") + DESIGN, folder=folder)


def moved(asked, far=0.6):
    space = space_of(asked)
    z = build_smoothing(space).apply(np.random.default_rng(1).uniform(-1, 1, space.n))
    return space.body(space.start + far * z / np.abs(z).max())


@pytest.fixture(scope="module")
def made(asked, tmp_path_factory):
    body = moved(asked)
    where = tmp_path_factory.mktemp("made")
    return body, where, make_faces(asked, body, where, chord=0.05)


def test_all_files_pass_their_checks(made):
    _, _, files = made
    assert [path.name for path in files.files] == [
        "body.step",
        "chamber_A.step",
        "body.3mf",
        "body.stl",
        "checks.json",
    ]
    assert not files.failed
    assert {check.file for check in files.checks} == {path.name for path in files.files[:-1]}


def test_another_opencascade_reads_the_same_solid(made):
    body, where, _ = made
    assert np.abs(body.exterior.net - body.exterior.lattice.points()).max() > 0.3
    read = OCCGeometry(str(where / "body.step")).shape
    assert len(read.solids) == 1
    # Triangles of six nodes enclose what they are in up to the fourth order of their size.
    assert read.mass == pytest.approx(volume_within(body.surfaces), rel=2e-4)
    core = OCCGeometry(str(where / "chamber_A.step")).shape
    assert core.mass == pytest.approx(-volume_within(body.chambers), rel=2e-3)


def test_a_screw_hole_stays(made):
    """Its face is the cylinder of the file, with the same axis."""
    _, where, _ = made
    read = OCCGeometry(str(where / "body.step")).shape
    near = [face for face in read.faces if abs(face.center.x - 5.5) < 1.3 and abs(face.center.y - 5.5) < 1.3]
    hole = [face for face in near if face.bounding_box[1].z < 3.5 + 1e-4 and face.bounding_box[0].z > -1e-4]
    assert sum(face.mass for face in hole) == pytest.approx(np.pi * 1.2 * (2 * 3.5 + 1.2), rel=1e-6)
    text = (where / "body.step").read_text(encoding="utf-8")
    assert text.count("= CYLINDRICAL_SURFACE(") == 2, "the two halves of the hole, and nothing else that is round"


def test_a_design_that_is_the_start_is_the_file(asked, folder, tmp_path):
    files = make_faces(asked, body_of(asked), tmp_path, chord=0.2)
    assert not files.failed
    text = (tmp_path / "body.step").read_text(encoding="utf-8")
    assert "B_SPLINE_SURFACE" not in text
    one, other = (
        OCCGeometry(str(path / name)).shape for path, name in ((folder, "block.step"), (tmp_path, "body.step"))
    )
    assert other.mass == pytest.approx(one.mass, rel=1e-9)


def test_another_design_is_told(asked, made):
    body, where, _ = made
    other = body.with_control_points(body.control_points() + 0.03)
    checks = check_solids(where / "body.step", other.surfaces, 2, {"body": volume_within(body.surfaces)}, ["body"])
    failed = {check.what: check.value for check in checks if not check.passed}
    assert list(failed) == ["distance of the design's points from the faces"]
    assert 0.03 < failed.popitem()[1] < 0.06


def test_files_of_triangles_have_no_step(folder, made, tmp_path):
    asked = loads(problem(made[1] / "body.stl", size="4 mm") + '[design]\nspacing = "8 mm"\n', folder=folder)
    files = make_faces(asked, moved(asked, 0.2), tmp_path, chord=0.1)
    assert not files.failed
    assert [path.name for path in files.files] == ["body.3mf", "body.stl", "checks.json"]


def test_triangles_are_closed_and_as_near_as_asked(made):
    body, counts = made[0], []
    for chord in (0.2, 0.02):
        parts = triangulated(body.surfaces, chord)
        counts.append(sum(len(part.corners) for part in parts))
        for part, surface in zip(parts, body.surfaces, strict=True):
            ways = part.corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
            forth, back = ({tuple(way) for way in each.tolist()} for each in (ways, ways[:, ::-1]))
            assert forth == back and len(forth) == len(ways)
            assert distances(part, points_of([surface])).max() < chord
    assert counts[1] > 1.5 * counts[0]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_splines_are_exact_for_what_they_can_be(seed):
    """Cubics between knots that are given, however smooth the function is there."""
    random = np.random.default_rng(seed)
    knots = np.array([0.0, 0.4, 1.0]), np.array([-1.0, 0.5, 0.5, 0.5, 2.0])
    coefficients = random.uniform(-1, 1, (4, 4, 3))
    bend, kink = random.uniform(-1, 1, (2, 3))

    def value(u, v):
        powers = np.einsum("ia,jb,abc->ijc", u[:, None] ** np.arange(4), v[:, None] ** np.arange(4), coefficients)
        bent = np.maximum(u - 0.4, 0.0)[:, None, None] ** 3 * bend
        return powers + bent + np.maximum(v - 0.5, 0.0)[None, :, None] * kink, np.ones((len(u), len(v)), bool)

    found = fitted(value, knots, 1e-3)
    assert found.deviation < 1e-11
    assert [len(each) for each in found.knots] == [3 + 6, 5 + 6]


def test_splines_are_refined_until_they_are_near_enough():
    def value(t):
        return np.stack([np.cos(t), np.sin(t), np.abs(t - 1.1) ** 2.5], axis=1), np.ones(len(t), bool)

    counts = []
    for tolerance in (1e-2, 1e-4, 1e-6):
        found = fitted(value, [np.array([0.0, 3.0])], tolerance)
        at = np.linspace(0.0, 3.0, 1001)
        away = np.linalg.norm(evaluated(found.poles, found.knots, [at]) - value(at)[0], axis=1).max()
        assert away < 1.5 * tolerance
        counts.append(len(found.poles))
    assert counts == sorted(set(counts))
