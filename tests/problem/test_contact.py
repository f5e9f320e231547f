"""Contact and obstacles in problem files."""

from contextlib import nullcontext

import numpy as np
import pytest
from records import task_result
from tiny import tiny

from pneumorph.cad import stl
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.mechanics import mirrors_of, setup
from pneumorph.output.obstacles import obstacles_of
from pneumorph.problem import loads
from pneumorph.verify.solids import tube

BALL = '[[obstacle]]\nname = "ball"\nkind = "sphere"\ncenter = ["20 mm", "0 mm", "20 mm"]\nradius = "4 mm"\n'
TABLE = '[[obstacle]]\nname = "table"\nkind = "plane"\npoint = ["0 mm", "0 mm", "-5 mm"]\nnormal = [0, 0, 2]\n'
ROD = (
    '[[obstacle]]\nname = "rod"\nkind = "cylinder"\ncenter = ["20 mm", "0 mm", "9 mm"]\naxis = [0, 3, 4]\n'
    'radius = "2 mm"\nlength = "9 mm"\n'
)
BLOCK = (
    '[[obstacle]]\nname = "block"\nkind = "box"\ncenter = ["20 mm", "0 mm", "9 mm"]\nsize = ["4 mm", "5 mm", "6 mm"]\n'
)


def test_all_kinds_are_read_and_written():
    problem = loads(tiny() + "[contact]\n" + BALL + TABLE + ROD + BLOCK)
    assert problem.contact is not None and problem.contact.self and problem.contact.distance is None
    assert [each.kind for each in problem.obstacle] == ["sphere", "plane", "cylinder", "box"]
    assert problem.obstacle[1].normal == (0.0, 0.0, 1.0)
    assert problem.obstacle[2].axis == pytest.approx((0.0, 0.6, 0.8))
    assert loads(problem.to_toml()) == problem


TETRAHEDRON = np.array([[[0, 0, 0], [0, 2, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 3]]], float)
TETRAHEDRON = np.concatenate([TETRAHEDRON, [[[0, 0, 0], [0, 0, 3], [0, 2, 0]], [[1, 0, 0], [0, 2, 0], [0, 0, 3]]]])
PART = '[[obstacle]]\nname = "part"\nkind = "mesh"\nfile = "parts/part.stl"\n'


def binary(corners) -> bytes:
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["corners"] = corners
    return b"solid, although it is binary".ljust(80) + np.uint32(len(corners)).tobytes() + records.tobytes()


def text(corners) -> bytes:
    facets = ("\n".join("vertex " + " ".join(map(repr, map(float, corner))) for corner in each) for each in corners)
    body = "\n".join(f"facet normal 0 0 0\nouter loop\n{each}\nendloop\nendfacet" for each in facets)
    return f"solid part\n{body}\nendsolid\n".encode()


def with_part(folder, content, more="", path="parts/part.stl"):
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "parts/part.stl").write_bytes(content)
    return loads(tiny() + PART.replace("parts/part.stl", path) + more, folder=folder)


@pytest.mark.parametrize("written", [binary, text])
def test_the_triangles_of_a_file_are_kept(written, tmp_path):
    """Turned inside out, and without the file: they are what a run stores."""
    placed = 'scale = 2.0\nrotation = ["0 deg", "0 deg", "90 deg"]\nposition = ["20 mm", "0 mm", "5 mm"]\n'
    problem = with_part(tmp_path, written(TETRAHEDRON[:, ::-1]), placed)
    again = loads(problem.to_toml())
    assert again == problem and "part.stl" not in problem.to_toml()
    mesh = setup.rigid_body_of(again.obstacle[0]).mesh(1.0)
    (drawn,) = obstacles_of(again, np.zeros((1, 3)))
    assert np.array_equal(drawn.points, mesh.points)
    a, b, c = np.moveaxis(mesh.points[mesh.triangles], 1, 0)
    assert np.einsum("ti,ti->", a, np.cross(b, c)) / 6 == pytest.approx(8.0)
    where = sorted(map(tuple, mesh.points.round(9) + 0.0))
    assert where == [(16, 0, 5), (20, 0, 5), (20, 0, 11), (20, 2, 5)]


def test_an_obstacle_from_a_file_that_is_in_the_body_is_refused(tmp_path):
    mesh = tube(4, 8, 24, (1, 8, 6))
    inside, beside = (
        with_part(tmp_path, binary(TETRAHEDRON), f'position = ["{x} mm", "0 mm", "10 mm"]') for x in (-8.2, 9)
    )
    for problem, refused in ((inside, True), (beside, False)):
        with pytest.raises(ComputationError, match='"part" touches the body') if refused else nullcontext():
            setup.contact_of(problem, mesh, setup.rubber_of(problem.material))
    with pytest.raises(ProblemError, match=r"obstacle\[0\].position: is in the rubber"):
        with_part(tmp_path, binary(TETRAHEDRON), 'position = ["6 mm", "0 mm", "10 mm"]')


@pytest.mark.parametrize(
    "content, message",
    [
        (binary(TETRAHEDRON[:3]), "is not watertight: 3 of 6 edges do not join two triangles; close it"),
        (binary([*TETRAHEDRON[:3], TETRAHEDRON[3][::-1]]), "has triangles that are not turned alike"),
        (binary(TETRAHEDRON * [1e-8, 1, 1]), "has [0-9] triangles without area; remesh it"),
        (binary(TETRAHEDRON * [np.nan, 1, 1]), "has a corner that is not a finite number"),
        (binary(np.tile(TETRAHEDRON, (5001, 1, 1))), "has 20004 triangles, more than 20000; make it coarser"),
        (binary(TETRAHEDRON)[:-1], "is not a whole STL file; export it again"),
        (text(TETRAHEDRON)[:-60], "is not a whole STL file; export it again"),
        (text(TETRAHEDRON).replace(b"3.0", b"three"), "has a corner that is no number"),
        (b"", "is not a whole STL file"),
        (bytes(stl.MOST_BYTES + 1), "cannot be read .it has more than 8 MB"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_one_line(content, message, tmp_path):
    with pytest.raises(ProblemError, match=r"obstacle\[0\].file: .*part.stl " + message) as refused:
        with_part(tmp_path, content)
    assert "\n" not in str(refused.value)


def test_all_files_together_have_an_end():
    many = TETRAHEDRON + 200.0 + 1.0 * np.arange(4000)[:, None, None, None]
    text = stl.pack(stl.read_stl(binary(many.reshape(-1, 3, 3))))
    parts = [f'[[obstacle]]\nname = "p{i}"\nkind = "mesh"\ntriangles = "{text}"\n' for i in range(3)]
    assert len(loads(tiny() + "".join(parts[:2])).obstacle) == 2
    with pytest.raises(ProblemError, match="obstacle: those of kind mesh have 48000 triangles together"):
        loads(tiny() + "".join(parts))


KEPT = stl.pack(stl.read_stl(binary(TETRAHEDRON)))


@pytest.mark.parametrize(
    "change, message",
    [
        (('file = "parts/part.stl"', 'file = "no.stl"'), r"file: .*no.stl cannot be read \(No such file"),
        (('file = "parts/part.stl"', "file = 3"), r"file: should be the name of an STL file"),
        (('file = "parts/part.stl"\n', ""), r'triangles: is missing; add a file .* e.g. file = "part.stl"'),
        (("file =", 'triangles = ""\nfile ='), r"file: is given together with triangles"),
        (('file = "parts/part.stl"', 'triangles = "eJxj"'), r"triangles: .*is not the text of a surface"),
        (('file = "parts/part.stl"', f'scale = 0.0\ntriangles = "{KEPT}"'), r"scale: 0.0 is out of range"),
    ],
)
def test_wrong_keys_of_an_obstacle_from_a_file(change, message, tmp_path):
    with pytest.raises(ProblemError, match=r"obstacle\[0\]." + message) as refused:
        loads(tiny() + PART.replace(*change), folder=tmp_path)
    assert "\n" not in str(refused.value)


def test_nothing_touches_by_default():
    problem = loads(tiny())
    assert problem.contact is None and problem.obstacle == ()
    assert "contact" not in problem.to_toml()


def test_the_whole_body_is_solved_where_anything_touches():
    symmetric = tiny().replace(
        'control_density = "0.3 /mm"', 'control_density = "0.3 /mm"\nsymmetry = {mirror = ["xz"]}'
    )
    assert mirrors_of(loads(symmetric)) == ("xz",)
    assert mirrors_of(loads(symmetric + BALL)) == ()
    assert mirrors_of(loads(symmetric + "[contact]\n")) == ()


@pytest.mark.parametrize(
    "text, message",
    [
        (
            BALL.replace('"sphere"', '"egg"'),
            r'obstacle\[0\].kind: "egg" is not a known kind of obstacle; use one of plane',
        ),
        (BALL.replace('kind = "sphere"\n', ""), r"obstacle\[0\].kind: is missing; use one of plane"),
        (BALL.replace('"4 mm"', '"-4 mm"'), r"obstacle\[0\].radius: .* is not above zero"),
        (BALL.replace('radius = "4 mm"\n', ""), r"obstacle\[0\].radius: is missing"),
        (BALL + BALL, r'obstacle\[1\].name: "ball" is used twice'),
        (
            TABLE.replace("[0, 0, 2]", "[0, 0, 0]"),
            r"obstacle\[0\].normal: has length zero; write e.g. normal = \[0, 0, 1\]",
        ),
        ("[contact]\nself = 1\n", r"contact.self"),
        ("[contact]\nfriction = 0.3\n", r"contact.friction: acts on obstacles alone, and there is none"),
        (BALL + "[contact]\nfriction = -0.3\n", r"contact.friction"),
        (
            '[contact]\ndistance = "0.8 mm"\n',
            r"contact.distance: 0.8 mm is more than half of limits.fold.distance = 1 mm",
        ),
        ("[contact]\nstiffness = 0.3\n", r"contact.stiffness: unknown key"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(text, message):
    with pytest.raises(ProblemError, match=message) as refused:
        loads(tiny() + text)
    assert "\n" not in str(refused.value)


def test_pictures_show_obstacles_at_their_poses():
    turned = tiny(pressure='{ A = "60 kPa" }\nturn = { block = ["0 deg", "0 deg", "90 deg"] }')
    problem = loads(turned + BLOCK + BALL + "free = {}\n")
    result = task_result(pose_translations={"ball": (0.0, 1.0, 2.0)}, pose_rotations={"ball": (0.0, 0.0, 0.3)})
    block, ball = obstacles_of(problem, np.zeros((1, 3)), problem.task[0], result)
    assert np.ptp(block.points, axis=0) == pytest.approx([5.0, 4.0, 6.0])
    assert np.mean([block.points.min(axis=0), block.points.max(axis=0)], axis=0) == pytest.approx([20.0, 0.0, 9.0])
    assert np.linalg.norm(ball.points - [20.0, 1.0, 22.0], axis=1).min() > 4.0 - 1e-9


GRAVITY = "[gravity]\ndirection = [0, 0, -1]\n"
FREE = BALL + 'free = { mass = "5 g", hold = ["x", "turn_z"], spring = { y = "0.2 N/mm", turn_x = "3 N*mm/rad" } }\n'


def test_a_free_obstacle_is_read_and_written():
    aim = '{ kind = "pose", obstacle = "ball", z = "2 mm", turn_x = "5 deg" }'
    problem = loads(tiny(objective=aim) + FREE + GRAVITY)
    free = problem.obstacle[0].free
    assert free.mass == pytest.approx(5e-6) and free.hold == ("x", "turn_z") and free.spring.turn_x == 3.0
    assert problem.task[0].objective.targets == {"z": 2.0, "turn_x": pytest.approx(np.radians(5.0))}
    assert loads(problem.to_toml()) == problem


@pytest.mark.parametrize(
    "text, message",
    [
        (tiny() + FREE, r"obstacle\[0\].free.mass: has no weight without gravity; add a table \[gravity\]"),
        (tiny() + FREE.replace('"x"', '"up"') + GRAVITY, r"obstacle\[0\].free.hold\[0\]: "),
        (tiny() + FREE.replace('"5 g"', '"-5 g"') + GRAVITY, r"obstacle\[0\].free.mass: "),
        (tiny() + TABLE + "free = {}\n", r"obstacle\[0\].free: "),
        (
            tiny(objective='{ kind = "pose", obstacle = "ball", z = "2 mm" }') + BALL,
            'objective.obstacle: there is no free obstacle "ball"; give one a table free',
        ),
        (tiny(objective='{ kind = "pose", obstacle = "ball" }') + FREE + GRAVITY, "objective.z: is missing, and so is"),
        (
            tiny(pressure='{ A = "60 kPa" }\nturn = { bell = ["0 deg", "0 deg", "1 deg"] }') + BALL,
            r'task\[0\].turn.bell: there is no obstacle "bell"; the obstacles are ball',
        ),
    ],
)
def test_free_obstacles_that_are_refused(text, message):
    with pytest.raises(ProblemError, match=message) as refused:
        loads(text)
    assert "\n" not in str(refused.value)
