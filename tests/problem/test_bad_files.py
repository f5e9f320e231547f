"""Wrong problem files: each gets one line that names the key, what is wrong, and how to fix it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from texts import TWO_BESIDE, problem_text

from pneumorph.errors import ProblemError
from pneumorph.problem import load, loads

REST = """
[end_effector]
kind = "plate"
spring = { axial = "4 N/mm" }
[gravity]
acceleration = "9.81 m/s^2"
direction = [0, 0, -1]
[[task]]
name = "bend"
weight = 1.0
pressure = { A = "60 kPa", B = { start = "30 kPa", min = "0 kPa", max = "60 kPa" } }
objective = { kind = "maximize", motion = "bending_y" }
[limits]
wall = "2 mm"
fold = { distance = "1 mm", neighbourhood = "2 mm" }
curvature = "0.3 /mm^2"
skew = 0.2
stretch = "0.1 /mm^2"
envelope = { radius = "14 mm" }
[mesh]
size = "2 mm"
element = "quadratic"
[optimizer]
step = "0.2 mm"
method = "sqp"
iterations = 40
"""
SPHERE = '[[obstacle]]\nname = "o"\nkind = "sphere"\ncenter = ["20 mm", "0 mm", "40 mm"]\nradius = "0.5 mm"\n'
RIPPLE = 'ripple = { amplitude = "0.2 mm", period = "10 mm" }'
GOOD = problem_text(REST, 80, 12, TWO_BESIDE, body=RIPPLE, head='title = "Two chambers"')

TARGET = '"maximize", motion = "bending_y"'


def curve(*points: str, more: str = "") -> str:
    """A target curve through places like "0 0 9", in mm."""
    listed = ", ".join("[" + ", ".join(f'"{part} mm"' for part in point.split()) + "]" for point in points)
    return f'"match_curve", control_points = [{listed}]{more}'


SOUND = ("0 0 0", "0 0 30", "20 0 50", "30 0 80")

# What to put in place of what, the key that the answer has to name, and a word of the reason or the fix.
BULK = 'bulk_modulus = "5 MPa"\ndensity = "1 g/cm^3"'
MOONEY = f'model = "mooney-rivlin"\nc10 = "0.1 MPa"\nc01 = "0.02 MPa"\n{BULK}'

WRONG = [
    ('length = "80 mm"', 'length = "80 mm"\nends = "pole"', "body.ends", "[body.dome]"),
    ('length = "80 mm"', 'length = "80 kg"', "body.length", "not a unit of a length"),
    ('length = "80 mm"', "length = 80", "body.length", "has no unit"),
    ('length = "80 mm"', 'length = "80"', "body.length", "has no unit"),
    ('length = "80 mm"', 'length = "long"', "body.length", "not a number with a unit"),
    ('length = "80 mm"', 'length = "1e300 mm"', "body.length", "too large"),
    ('size = "2 mm"', 'size = "1e-300 mm"', "mesh.size", "too small"),
    ('length = "80 mm"', 'length = "2 km"', "body.length", "too large"),
    ('"60 kPa", B', '"2e4 MPa", B', "task[0].pressure.A", "too large"),
    ("[gravity]", 'force = ["0 N", "0 N", "1e9 N"]\n[gravity]', "end_effector.force[2]", "too large"),
    ("[limits]", f'turn = {{ o = ["0 deg", "1e9 deg", "0 deg"] }}\n{SPHERE}[limits]', "task[0].turn.o[1]", "too large"),
    ("[limits]", f"{SPHERE.replace('20 mm', '9.5 mm')}[limits]", "obstacle[0].center", "is in the rubber"),
    ('radius = "12 mm"', 'radius = "8.001 mm"', "body.chamber[0].center", "leaves a wall of 0.001 mm"),
    ('center = ["-5 mm"', 'center = ["-1.001 mm"', "body.chamber[1]", 'leaves a wall of 0.001 mm to "A"'),
    (
        'envelope = { radius = "14 mm" }',
        'envelope = { radius = "1e-9 mm" }',
        "limits.envelope.radius",
        "leaves no room",
    ),
    ('length = "80 mm"', 'length = "-80 mm"', "body.length", "not above zero"),
    ('length = "80 mm"', "", "body.length", 'is missing; add e.g. length = "80 mm"'),
    ('length = "80 mm"', 'lenght = "80 mm"', "body.lenght", 'did you mean "length"?'),
    ("[material]", "[materials]", "materials", 'did you mean "material"?'),
    ('[material]\nname = "Hei-Cast 8400"', "", "material", "is missing"),
    ('name = "Hei-Cast 8400"', "", "material.name", 'use one of "Hei-Cast 8400"'),
    ('name = "Hei-Cast 8400"', 'name = "Ecoflex"', "material.name", 'not in the library; did you mean "Ecoflex 00-'),
    ('name = "Hei-Cast 8400"', 'name = "ecoflex  00-30"', "material.name", 'did you mean "Ecoflex 00-30"?'),
    ('name = "Hei-Cast 8400"', 'name = "RTV 615"', "material.name", 'did you mean "RTV615"?'),
    ('name = "Hei-Cast 8400"', 'name = "gum"', "material.name", 'not in the library; use one of "Hei-Cast 8400"'),
    (
        'name = "Hei-Cast 8400"',
        'shear_modulus = "0.49 MPa"\nbulk_modulus = "-4.8 MPa"\ndensity = "1 g/cm^3"',
        "material.bulk_modulus",
        "not above zero",
    ),
    (
        'name = "Hei-Cast 8400"',
        'shear_modulus = "0 MPa"\nbulk_modulus = "4.8 MPa"\ndensity = "1 g/cm^3"',
        "material.shear_modulus",
        "not above zero",
    ),
    ('name = "Hei-Cast 8400"', 'shear_modulus = "1 MPa"', "material.bulk_modulus", "is missing"),
    (
        'name = "Hei-Cast 8400"',
        'model = "rubber"\nc10 = "1 MPa"',
        "material.model",
        "use one of neo-hookean, mooney-rivlin",
    ),
    ('name = "Hei-Cast 8400"', "model = 3", "material.model", "is not a known rubber model"),
    ('name = "Hei-Cast 8400"', f"{MOONEY}\nc10_ = '1 MPa'", "material.c10_", 'did you mean "c10"?'),
    ('name = "Hei-Cast 8400"', MOONEY.replace('"0.1 MPa"', '"0.1 mm"'), "material.c10", "not a unit of a modulus"),
    (
        'name = "Hei-Cast 8400"',
        MOONEY.replace('"0.1 MPa"', '"-0.1 MPa"'),
        "material.c10",
        "initial shear modulus -0.16 MPa",
    ),
    ('name = "Hei-Cast 8400"', MOONEY.replace("5 MPa", "-5 MPa"), "material.bulk_modulus", "not above zero"),
    ('name = "Hei-Cast 8400"', MOONEY + "\nvalid_stretch = 0.5", "material.valid_stretch", "greater than 1"),
    ('name = "Hei-Cast 8400"', 'model = "yeoh"\n' + BULK, "material.coefficients", "is missing; add coefficients ="),
    ('name = "Hei-Cast 8400"', 'model = "yeoh"\ncoefficients = []\n' + BULK, "material.coefficients", "is empty"),
    (
        'name = "Hei-Cast 8400"',
        f'model = "yeoh"\ncoefficients = ["1 MPa", 2]\n{BULK}',
        "material.coefficients[1]",
        "no unit",
    ),
    (
        'name = "Hei-Cast 8400"',
        f'model = "gent"\nshear_modulus = "1 MPa"\n{BULK}',
        "material.limit",
        "is missing; add limit =",
    ),
    (
        'name = "Hei-Cast 8400"',
        f'model = "gent"\nlimit = "30 MPa"\nshear_modulus = "1 MPa"\n{BULK}',
        "material.limit",
        "not a number",
    ),
    (
        'name = "Hei-Cast 8400"',
        f'model = "arruda-boyce"\nlocking_stretch = 0.9\nshear_modulus = "1 MPa"\n{BULK}',
        "material.locking_stretch",
        "greater than 1",
    ),
    (
        'name = "Hei-Cast 8400"',
        f'model = "ogden"\nterms = [{{ modulus = "1 MPa", exponent = 0 }}]\n{BULK}',
        "material.terms[0].exponent",
        "is zero",
    ),
    (
        'name = "Hei-Cast 8400"',
        f'model = "ogden"\nterms = [{{ modulus = "1 MPa" }}]\n{BULK}',
        "material.terms[0].exponent",
        "is missing",
    ),
    ('span = ["3 mm", "77 mm"]', 'span = ["3 mm", "85 mm"]', "body.chamber[0].span", "beyond the body"),
    ('span = ["3 mm", "77 mm"]', 'span = ["-3 mm", "77 mm"]', "body.chamber[0].span", "beyond the body"),
    ('span = ["3 mm", "77 mm"]', 'span = ["77 mm", "3 mm"]', "body.chamber[0].span", "lower end first"),
    ('span = ["3 mm", "77 mm"]', 'span = ["1 mm", "77 mm"]', "body.chamber[0].span", "at an end of the body"),
    ('span = ["3 mm", "77 mm"]', 'span = ["3 mm"]', "body.chamber[0].span[1]", "is missing"),
    ('span = ["3 mm", "77 mm"]', 'span = ["3 mm", "4 mm", "77 mm"]', "body.chamber[0].span", "too many"),
    ('span = ["3 mm", "77 mm"]', 'span = ["3 mm", 77]', "body.chamber[0].span[1]", "has no unit"),
    (
        'span = ["3 mm", "77 mm"]',
        'span = ["3 mm", "8 mm"]\nends = "pole"',
        "body.chamber[0].span",
        "shorter than its two hemispherical ends",
    ),
    ('center = ["5 mm", "0 mm"]', 'center = ["9 mm", "3 mm"]', "body.chamber[0].center", "outside the body"),
    ('center = ["5 mm", "0 mm"]', 'center = ["-1 mm", "0 mm"]', "body.chamber[1]", 'overlaps "A"'),
    ('name = "B"', 'name = "A"', "body.chamber[1].name", "used twice"),
    ('name = "B"', 'name = "B 2"', "body.chamber[1].name", "letters, digits"),
    ('name = "B"', 'name = ""', "body.chamber[1].name", "letters, digits"),
    ("[[body.chamber]]", "[body.chamber]", "problem", "not TOML"),
    (
        'ripple = { amplitude = "0.2 mm"',
        'ripple = { amplitude = "13 mm"',
        "body.ripple.amplitude",
        "is not smaller than the least radius of",
    ),
    ('period = "10 mm"', 'period = "2 mm"', "limits.curvature", "raise the limit"),
    ("title =", 'symmetry.mirror = ["xz"]\ntitle =', "symmetry", "unknown key"),
    ('radius = "12 mm"', 'radius = "12 mm"\nsymmetry = { mirror = ["zx"] }', "body.symmetry.mirror[0]", "zx"),
    ('radius = "12 mm"', 'radius = "12 mm"\nsymmetry = { rotation = 0 }', "body.symmetry.rotation", "1"),
    ('radius = "12 mm"', 'radius = "12 mm"\ncontrol_density = "60 /mm"', "body.control_density", "lower it"),
    ('radius = "12 mm"', 'radius = "12 mm"\ncontrol_density = "0.01 /mm"', "body.control_density", "raise it"),
    ('kind = "plate"', 'kind = "free"', "end_effector.spring", "needs a plate, but the tip is free"),
    ('axial = "4 N/mm"', 'axial = "-4 N/mm"', "end_effector.spring.axial", "below zero"),
    ('axial = "4 N/mm"', 'bending_y = "4 N/mm"', "end_effector.spring.bending_y", "not a unit of"),
    ("[0, 0, -1]", "[0, 0, 0]", "gravity.direction", "has length zero"),
    ("[0, 0, -1]", "[0, 0, nan]", "gravity.direction[2]", "not finite"),
    ("[0, 0, -1]", '[0, 0, "down"]', "gravity.direction[2]", "not a number"),
    ('A = "60 kPa"', 'C = "60 kPa"', "task[0].pressure.C", 'no chamber "C"; the chambers are A, B'),
    ('A = "60 kPa"', "A = 60", "task[0].pressure.A", "has no unit"),
    ('A = "60 kPa"', 'A = "60 KPa"', "task[0].pressure.A", "not a known unit"),
    ('start = "30 kPa"', 'start = "70 kPa"', "task[0].pressure.B.start", "between min and max"),
    ('min = "0 kPa"', 'min = "90 kPa"', "task[0].pressure.B.min", "above max"),
    ('min = "0 kPa", ', "", "task[0].pressure.B.min", 'is missing; add e.g. min = "0 kPa"'),
    ('motion = "bending_y"', 'motion = "bend"', "task[0].objective.motion", "extension"),
    ('"maximize", motion = "bending_y"', '"follow"', "task[0].objective.kind", "use one of maximize, minimize"),
    ('"maximize", motion = "bending_y"', '"reach", position = [0, 0, 9]', "task[0].objective.position[0]", "no unit"),
    (TARGET, curve("0 0 0", "9 0 3", *SOUND[2:]), "task[0].objective.control_points", "let it start along +z"),
    (TARGET, curve("0 0 0", "0 0 -9", *SOUND[2:]), "task[0].objective.control_points", "let it start along +z"),
    (TARGET, curve("0 0 0", "0 0 0", *SOUND[2:]), "task[0].objective.control_points", "the first two coincide"),
    (
        TARGET,
        curve(*SOUND[:3]),
        "task[0].objective.control_points",
        "too few for degree 3; give at least 4 or lower the degree",
    ),
    (TARGET, curve(SOUND[0]), "task[0].objective.control_points", "has too few entries; give at least 2"),
    (TARGET, curve(*SOUND).replace('"30 mm"', "30", 1), "task[0].objective.control_points[1][2]", "has no unit"),
    (
        TARGET,
        curve(*SOUND).replace('"0 mm", "0 mm"]', '"0 mm"]', 1),
        "task[0].objective.control_points[0][2]",
        "missing",
    ),
    (TARGET, curve(*SOUND, more=", degree = 6"), "task[0].objective.degree", "out of range"),
    (TARGET, curve(*SOUND, more=", sections = 1"), "task[0].objective.sections", "out of range"),
    (TARGET, curve(*SOUND, more=", sections = 41"), "task[0].objective.sections", "use at most 40 or a finer mesh"),
    (
        TARGET,
        curve(*SOUND, more=", orientation_weight = 0"),
        "task[0].objective.position_weight",
        "is zero, and so is orientation_weight",
    ),
    (TARGET, curve(*SOUND, more=", position_weight = -1"), "task[0].objective.position_weight", "out of range"),
    (TARGET, curve(*SOUND, more=", weigth = 1"), "task[0].objective.weigth", "unknown key"),
    (TARGET, '"match_curve"', "task[0].objective.control_points", "is missing; add e.g. control_points"),
    (
        TARGET,
        '"match_sections", rotations = [["0 deg", 9, "0 deg"], ["0 deg", "0 deg", "0 deg"]]',
        "task[0].objective.rotations[0][1]",
        "has no unit",
    ),
    (
        TARGET,
        '"match_sections", rotations = [["0 deg", "9 mm", "0 deg"], ["0 deg", "0 deg", "0 deg"]]',
        "task[0].objective.rotations[0][1]",
        "not a unit of an angle",
    ),
    (TARGET, '"match_sections"', "task[0].objective.rotations", "is missing; add e.g. rotations"),
    (TARGET, '"reach"', "task[0].objective.position", "is missing, and so is rotation"),
    (
        TARGET,
        '"reach", rotation = ["0 deg", "0 deg", "200 deg"]',
        "task[0].objective.rotation",
        "turn by 180° or more",
    ),
    (TARGET, '"reach", rotation = ["180 deg", "0 deg", "0 deg"]', "task[0].objective.rotation", "180° or more"),
    (
        TARGET,
        '"reach", position = ["0 mm", "0 mm", "90 mm"], position_weight = 0',
        "task[0].objective.position_weight",
        "leaves no target with a weight",
    ),
    (TARGET, '"motion"', "task[0].objective.bending_y", "is missing, and so is every other motion; give at least one"),
    (TARGET, '"motion", bending_y = "60 mm"', "task[0].objective.bending_y", "not a unit of an angle"),
    (TARGET, '"motion", shift_x = 3', "task[0].objective.shift_x", 'write e.g. "3 mm"'),
    (TARGET, '"motion", axial = "1 mm", extension = "2 mm"', "task[0].objective.axial", "is the same as extension"),
    (TARGET, '"motion", twist = "9 deg", rotation_weight = 0', "task[0].objective.rotation_weight", "no motion with a"),
    (TARGET, '"motion", bend_y = "60 deg"', "task[0].objective.bend_y", "unknown key"),
    (TARGET, '"custom", file = "none.py"', "task[0].objective.file", "none.py cannot be read"),
    (TARGET, "3", "task[0].objective.kind", "a int is not a known kind"),
    ("weight = 1.0", "weight = 0", "task[0].weight", "greater than 0"),
    ("weight = 1.0", "weight = inf", "task[0].weight", "not finite"),
    ("weight = 1.0", 'weight = "1"', "task[0].weight", "not a number"),
    ("weight = 1.0", "weight = true", "task[0].weight", "not a number"),
    ('wall = "2 mm"', 'wall = "4 mm"', "body.chamber[0].span", "thinner than limits.wall"),
    ('neighbourhood = "2 mm"', 'neighbourhood = "1 mm"', "limits.fold.neighbourhood", "make it larger"),
    ('curvature = "0.3 /mm^2"', 'curvature = "0.01 /mm^2"', "limits.curvature", "too far above the limit"),
    ('curvature = "0.3 /mm^2"', 'curvature = "0.3 /mm"', "limits.curvature", "not a unit of"),
    ('stretch = "0.1 /mm^2"', 'stretch = "0 /mm^2"', "limits.stretch", "not above zero"),
    ("skew = 0.2", "skew = 1.5", "limits.skew", "out of range"),
    ('size = "2 mm"', 'size = "20 mm"', "mesh.size", "make it smaller"),
    ('size = "2 mm"', 'size = "1 um"', "mesh.size", "make it larger"),
    ('element = "quadratic"', 'element = "linear"', "mesh.element", "use 'auto', 'quadratic' or 'mixed'"),
    ("iterations = 40", "iterations = 4.5", "optimizer.iterations", "whole number"),
    ("iterations = 40", "iterations = 0", "optimizer.iterations", "out of range"),
    ('method = "sqp"', 'method = "newton"', "optimizer.method", "use 'sqp' or 'dfp'"),
    ("[mesh]", "mesh = 2\n[mesh]", "limits.mesh", "unknown key"),
    ("iterations = 40", "iterations = 40\niterations = 50", "problem", "it is given twice; leave one of them out"),
    ('length = "80 mm"', "length = “80 mm”", "problem", "its quotes are curly; write straight ones"),
    ('length = "80 mm"', "length = 80 mm", "problem", 'quantities are in quotes; write "80 mm"'),
    ('length = "80 mm"', 'length = "8,5 cm"', "body.length", 'has a comma; write a decimal point, "8.5 cm"'),
    ('center = ["-5 mm"', "center = [-5 mm", "problem", 'quantities are in quotes; write "-5 mm"'),
]


def refusal(text: str) -> str:
    with pytest.raises(ProblemError) as caught:
        loads(text)
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "key", "reason"), WRONG, ids=[f"{key}-{i}" for i, (*_, key, _) in enumerate(WRONG)]
)
def test_one_line_names_the_key_and_the_fix(old, new, key, reason):
    assert old in GOOD
    message = refusal(GOOD.replace(old, new, 1))
    assert "\n" not in message
    assert message.startswith(f"{key}: ")
    assert reason in message


def test_the_good_one_is_good():
    assert loads(GOOD).title == "Two chambers"


@pytest.mark.parametrize("table", ["chamber", "task"])
def test_no_chamber_and_no_task(table):
    kept, skip = [], False
    for line in GOOD.splitlines():
        if line.startswith("["):
            skip = line.endswith(f"{table}]]")
        if not skip:
            kept.append(line)
    assert refusal("\n".join(kept)).startswith(f"{'task' if table == 'task' else 'body.chamber'}: is missing; add")
    empty = GOOD.split("[[body.chamber]]")[0] + "chamber = []\n" + GOOD[GOOD.index("[end_effector]") :]
    assert refusal(empty).startswith("body.chamber: is empty; ")


def test_a_free_tip_reaches_nothing():
    free = GOOD.replace('kind = "plate"\nspring = { axial = "4 N/mm" }', 'kind = "free"')
    message = refusal(free.replace(TARGET, '"reach", position = ["0 mm", "0 mm", "90 mm"]'))
    assert message.startswith("task[0].objective.kind: reach is a target for the plate, but the tip is free; use")


def test_too_many_sections_for_the_mesh():
    turns = ", ".join(['["0 deg", "0 deg", "0 deg"]'] * 5)
    message = refusal(
        GOOD.replace(TARGET, f'"match_sections", rotations = [{turns}]')
        .replace("80 mm", "9 mm")
        .replace("77 mm", "6 mm")
    )
    assert message.startswith("task[0].objective.rotations: 5 sections are thinner than the elements")


def test_several_faults_are_counted():
    text = GOOD.replace('length = "80 mm"', "length = 80").replace('wall = "2 mm"', "wall = 2")
    message = refusal(text)
    assert message.startswith("body.length: ")
    assert message.endswith("(and 1 more fault)")
    assert "more fault" not in refusal(GOOD.replace("weight = 1.0", "weight = 0"))


def test_all_faults_are_found_at_once():
    """Unknown, missing and wrong keys of one table, of others, and what does not fit together."""
    text = GOOD.replace('length = "80 mm"', 'lenght = "80 mm"').replace('radius = "12 mm"', "radius = 12")
    text = text.replace('wall = "2 mm"', 'wall = "2 mm"\nwalls = 1').replace('motion = "bending_y"', 'motion = "bend"')
    with pytest.raises(ProblemError) as caught:
        loads(text)
    assert [fault.split(": ")[0] for fault in caught.value.faults] == [
        "body.lenght", "body.length", "body.radius", "task[0].objective.motion", "limits.walls",
    ]  # fmt: skip
    assert str(caught.value) == f"{caught.value.faults[0]} (and 4 more faults)"
    text = GOOD.replace('span = ["3 mm", "77 mm"]', 'span = ["3 mm", "85 mm"]').replace("{ A =", "{ C =")
    with pytest.raises(ProblemError) as caught:
        loads(text.replace('size = "2 mm"', 'size = "20 mm"'))
    assert [fault.split(": ")[0] for fault in caught.value.faults] == [
        "body.chamber[0].span", "body.chamber[1].span", "task[0].pressure.C", "mesh.size",
    ]  # fmt: skip


def test_an_unknown_key_beside_a_name_of_the_library_is_the_only_fault():
    with pytest.raises(ProblemError) as caught:
        loads(GOOD.replace('name = "Hei-Cast 8400"', 'name = "Hei-Cast 8400"\ncolour = "red"'))
    (fault,) = caught.value.faults
    assert fault.startswith("material.colour: unknown key")


def test_files_that_are_no_problem_files(tmp_path):
    def answer(name: str, content: bytes | None) -> str:
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(ProblemError) as caught:
            load(path)
        message = str(caught.value)
        assert message.startswith(f"{path}: ")
        assert "\n" not in message
        return message

    assert "no such file" in answer("missing.toml", None)
    assert "is empty" in answer("empty.toml", b"")
    assert "is empty" in answer("comment.toml", b"# nothing\n")
    assert "not UTF-8" in answer("latin.toml", "title = 'Körper'".encode("latin-1"))
    assert "not TOML" in answer("picture.toml", b"\x00\x01\x02")
    assert "not TOML" in answer("yaml.toml", b"title: A\nbody:\n  - 1\n")
    assert "not TOML" in answer("deep.toml", b"a = " + b"[" * 100_000)
    assert "is a directory" in answer(".", None)
    assert 'file = "finger.STEP" under [body]' in answer("finger.STEP", b"ISO-10303-21;\n")
    assert "no such file" in answer("missing.step", None)


@given(
    st.integers(0, len(GOOD.splitlines()) - 1),
    st.sampled_from(["7", '"x"', "[]", "{}", "nan", "true", '"9 mm"', "[[1]]"]),
)
def test_any_value_in_any_place_is_read_or_refused_in_one_line(line, value):
    lines = GOOD.splitlines()
    if "=" in lines[line]:
        lines[line] = f"{lines[line].split('=')[0]}= {value}"
    try:
        loads("\n".join(lines))
    except ProblemError as error:
        assert "\n" not in str(error)
        assert ": " in str(error)
