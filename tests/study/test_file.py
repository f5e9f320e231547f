"""Study files: grids, lists and what is wrong with them."""

from typing import cast

import pytest
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem
from pneumorph.study import load_study
from pneumorph.study.file import Member
from pneumorph.study.summary import captions

RIPPLE = '{ amplitude = "0.2 mm", period = "10 mm" }'
BASE = tiny(control_density=f'"0.4 /mm"\nripple = {RIPPLE}', pressure='{ A = "20 kPa" }', size='"5 mm"')


@pytest.fixture
def study(tmp_path):
    """A study file beside its base problem."""
    (tmp_path / "base.toml").write_text(BASE)
    (tmp_path / "long.toml").write_text(BASE.replace('"24 mm"', '"34 mm"').replace('"21 mm"', '"31 mm"'))

    def write(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        return path

    return write


def test_a_grid_is_every_combination(study):
    found = load_study(
        study(
            'title = "Both"\nbase = "base.toml"\n[grid]\n"task[0].pressure.A" = ["20 kPa", "30 kPa"]\n'
            '"end_effector.spring.axial" = ["0 N/mm", "1 N/mm", "2 N/mm"]\n'
        )
    )
    assert found.title == "Both"
    pairs = [(m.problem.task[0].pressure["A"].start, m.problem.end_effector.spring.axial) for m in found.members]
    assert pairs == [(p, k) for p in (0.02, 0.03) for k in (0.0, 1.0, 2.0)]
    assert found.members[1].name == "A-20-kPa_axial-1-N-mm"


def test_members_have_bases_and_changes_of_their_own(study):
    found = load_study(
        study(
            'base = "base.toml"\n[grid]\n"body.ripple" = [{ amplitude = "0.1 mm", period = "8 mm" }, false]\n'
            '[[member]]\nname = "short"\n[[member]]\nname = "long"\nbase = "long.toml"\nset = { "mesh.size" = "4 mm" }'
        )
    )
    assert [m.problem.body.length for m in found.members] == [24.0, 24.0, 34.0, 34.0]
    assert [m.problem.mesh.size for m in found.members] == [5.0, 5.0, 4.0, 4.0]
    assert [m.problem.body.ripple is None for m in found.members] == [False, True, False, True]
    assert found.members[3].name == "long_no-ripple"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('base = "base.toml"', "has neither a [grid] nor a [[member]]"),
        ('base = "none.toml"\n[grid]\n"mesh.size" = ["4 mm"]', "none.toml: there is no such file"),
        ('[grid]\n"mesh.size" = ["4 mm"]', "base: is missing"),
        ('base = "base.toml"\n[grid]\n"mesh.size" = "4 mm"', "grid: needs a list of values"),
        ('base = "base.toml"\n[grid]\n"mesh.sizes" = ["4 mm"]', "sizes-4-mm: mesh.sizes: "),
        ('base = "base.toml"\n[grid]\n"mesh.size" = ["4 kPa"]', "mesh.size"),
        (
            'base = "base.toml"\n[grid]\n"task[3].weight" = [2.0]',
            '"task[3].weight": there is no entry [3]; the list',
        ),
        ('base = "base.toml"\n[grid]\n"title.x" = [1]\n', 'there is no table to hold "x"'),
        (
            'base = "base.toml"\n[grid]\n"task.pressure.A" = ["9 kPa"]\n',
            '"task.pressure.A": task is a list; say which entry, of the first it is "task[0].pressure.A"',
        ),
        (
            'base = "base.toml"\n[grid]\n"body.chamber.radius" = ["3 mm"]\n',
            'body.chamber is a list; say which entry, of the first it is "body.chamber[0].radius"',
        ),
        ('base = "base.toml"\nbases = 1\n[[member]]', "bases: is not a key of a study"),
        ('base = "base.toml"\n[[member]]\nname = "a"\n[[member]]\nname = "a"', 'two members are called "a"'),
        ('base = "base.toml"\n[[member]]\nchange = 1', "member[0].change: is not a key of a member"),
        ("base = ", "is not TOML"),
        ('base = "base.toml"\n[grid]\n"task[0].weight" = [' + "1.0," * 2000 + "]", "asks for 2000 designs"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(study, text, said):
    with pytest.raises(ProblemError) as caught:
        load_study(study(text))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_are_what_every_file_system_takes(study):
    long = "x" * 300
    text = f'base = "base.toml"\n[[member]]\nname = "{long}1"\n[[member]]\nname = "{long}2"\n[[member]]\nname = "nul"\n'
    names = [member.name for member in load_study(study(text)).members]
    assert names == [member.name for member in load_study(study(text)).members]
    assert len(set(names)) == 3 and all(len(name) <= 120 for name in names) and names[2] == "_nul"
    with pytest.raises(ProblemError, match="two members are called"):
        load_study(study('base = "base.toml"\n[[member]]\nname = "a"\n[[member]]\nname = "A"\n'))


@pytest.mark.parametrize(
    "text",
    [
        'base = "base.toml"\n[grid]\n"' + "a." * 100_000 + 'b" = [1]\n',
        'base = "base.toml"\n[grid]\n"task[' + "9" * 5000 + '].weight" = [1.0]\n',
        'base = "base.toml"\n[grid]\n"mesh.size" = [0x' + "f" * 50_000 + "]\n",
        'base = "base.toml"\n[grid]\n"mesh.size" = [' + 300 * "[" + 300 * "]" + "]\n",
        'base = "base.toml"\n' + "k" * 1_000_000 + " = 1\n[[member]]\n",
        'base = "base.toml"\n[[member]]\nname = "' + "k" * 1_000_000 + '"\nset = { "mesh.size" = "x" }\n',
        'base = "/dev/zero"\n[[member]]\n',
        "x = 1\n" * 500_000,
    ],
    ids=lambda text: text[18:60],
)
def test_files_without_measure_are_refused_in_a_short_line(study, text):
    path = study(text)
    with pytest.raises(ProblemError) as caught:
        load_study(path)
    message = str(caught.value)
    assert len(message) - len(str(path)) <= 300 and message.isprintable()


def test_captions_tell_what_members_do_not_share():
    def members(*changes):
        return [Member(f"m{number}", each, cast(Problem, None)) for number, each in enumerate(changes)]

    assert captions(members({"mesh.size": "3 mm", "a.k": "1 N"}, {"mesh.size": "3 mm", "a.k": "2 N"})) == [
        "k: 1 N",
        "k: 2 N",
    ]
    # Members of other base problems may have the same changes.
    assert captions(members({"mesh.size": "3 mm"}, {"mesh.size": "3 mm"})) == ["m0", "m1"]
    assert captions(members({"body.ripple": False}, {})) == ["ripple: none", "m1"]
    changes = {"end_effector.force": ["0 N", "1 N", "0 N"], "body.symmetry": {"mirror": ["xz"]}}
    assert captions(members(changes, {}))[0] == "force: 0 N, 1 N, 0 N\nsymmetry: xz"
