"""Code in files from elsewhere runs only once somebody has agreed to it, and is then not asked about again."""

import os
from pathlib import Path

import pytest
import refused
from tiny import tiny

import pneumorph as pm
from pneumorph.errors import ProblemError
from pneumorph.problem import Code, loads
from pneumorph.run import create
from pneumorph.study import load_study

CODE = "def objective(f):\n    return -f.translation[2]\n"
FILE = tiny(objective='{ kind = "custom", file = "cost.py" }')


@pytest.fixture
def arm(tmp_path):
    """A problem file with its code, and what else is made of both."""
    (tmp_path / "cost.py").write_text(CODE)
    (tmp_path / "arm.toml").write_text(FILE)
    return tmp_path / "arm.toml"


def refusal(action, *arguments) -> str:
    message = refused.refusal(action, *arguments)
    assert "add --trust" in message
    return message


def trusted() -> Path:
    return Path(os.environ["XDG_CONFIG_HOME"]) / "pneumorph" / "trusted"


def test_code_in_a_file_is_refused_until_it_is_trusted(arm):
    assert refusal(pm.load, arm).startswith(f"{arm}: task[0].objective.code: is Python code of 2 lines")
    assert not trusted().exists()
    assert pm.load(arm, trust=True).task[0].objective.code == CODE
    assert pm.load(arm).task[0].objective.code == CODE
    assert trusted().read_text(encoding="utf-8").endswith(f"  {arm}\n")
    assert len(trusted().read_text(encoding="utf-8").splitlines()) == 1


def test_a_change_of_the_code_or_its_function_is_asked_about_again(arm):
    pm.load(arm, trust=True)
    arm.write_text(FILE.replace('"cost.py"', '"cost.py", function = "other"'))
    refusal(pm.load, arm)
    arm.write_text(FILE.replace('"6 mm"', '"5 mm"'))
    assert pm.load(arm).mesh.size == 5.0, "a change of anything else is not"
    (arm.parent / "cost.py").write_text(CODE + "import os\n")
    refusal(pm.load, arm)


def test_no_two_pairs_of_name_and_text_have_one_fingerprint(arm):
    """Of all ways to divide one text between the two, and of parts that look like what is between them."""
    whole = 'objective\n"""\nimport os\n#"""\n", "text": "\n'
    pairs = [(whole[:cut], whole[cut:].removeprefix("\n")) for cut in range(len(whole))]
    assert len({Code("key", *pair).fingerprint for pair in pairs}) == len(set(pairs))


@pytest.mark.parametrize("name", ["", "objective\\n", "a b", "f()", "class", "1a", "a.b", "\\u202ef"])
def test_functions_have_names_of_python(name, arm):
    arm.write_text(FILE.replace('"cost.py"', f'"cost.py", function = "{name}"'))
    with pytest.raises(ProblemError, match=r"task\[0\].objective.function: .* is not the name of a Python function"):
        pm.load(arm, trust=True)


def test_a_list_without_a_last_newline_is_kept(arm):
    trusted().parent.mkdir(parents=True)
    trusted().write_text("0" * 64 + "  somewhere")
    pm.load(arm, trust=True)
    pm.load(arm)
    assert [line[64:] for line in trusted().read_text().splitlines()] == ["  somewhere", f"  {arm}"]


def test_a_byte_order_mark_means_nothing(arm):
    for path in (arm, arm.parent / "cost.py"):
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert pm.load(arm, trust=True).task[0].objective.code == CODE


def test_who_is_asked_gets_the_code_that_is_new(arm):
    asked = []

    def answer(where, codes):
        asked.append((where, [(code.key, code.function, code.text) for code in codes]))
        return len(asked) > 1

    refusal(pm.load, arm, answer)
    pm.load(arm, answer)
    pm.load(arm, answer)
    assert asked == 2 * [(str(arm), [("task[0].objective.code", "objective", CODE)])]


def test_a_run_from_elsewhere_is_asked_about_and_one_of_ones_own_is_not(arm, tmp_path, monkeypatch):
    create(tmp_path / "run", loads(FILE, folder=tmp_path))
    assert pm.open_run(tmp_path / "run").problem.task[0].objective.code == CODE, "it was made here"
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "of another user"))
    assert refusal(pm.open_run, tmp_path / "run").startswith(f"{tmp_path / 'run'}: task[0].objective.code: ")
    assert pm.open_run(tmp_path / "run", trust=True).problem.task[0].objective.code == CODE
    assert pm.open_run(tmp_path / "run").latest is None


def test_designs_of_a_file_are_refused_too(arm, tmp_path):
    refusal(lambda: pm.design(arm, tmp_path / "run"))
    refusal(lambda: next(iter(pm.designs(arm))))
    assert not (tmp_path / "run").exists()


def test_problems_of_ones_own_need_no_question(arm):
    assert loads(FILE, folder=arm.parent).with_changes({"mesh.size": "5 mm"}).task[0].objective.code == CODE
    assert not trusted().exists()


def test_a_study_asks_once_for_all_its_members(arm, tmp_path):
    (tmp_path / "study.toml").write_text('base = "arm.toml"\n[grid]\n"mesh.size" = ["5 mm", "6 mm"]\n')
    refusal(load_study, tmp_path / "study.toml")
    asked = []
    load_study(tmp_path / "study.toml", lambda where, codes: bool(asked.append(len(codes)) or True))
    assert asked == [1]


def test_where_nothing_can_be_kept_it_is_asked_again(arm, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "file"))
    assert pm.load(arm, trust=True).title == "Tiny"
    refusal(pm.load, arm)


def test_damaged_and_strange_lists_trust_nothing(arm):
    trusted().parent.mkdir(parents=True)
    trusted().write_bytes(b"\xff\n\n  \n" + b"0" * 64 + b"\n")
    refusal(pm.load, arm)
    trusted().unlink()
    if hasattr(os, "mkfifo"):
        os.mkfifo(trusted())
        refusal(pm.load, arm)


def test_a_relative_place_for_configuration_is_not_used(arm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", "here")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    pm.load(arm, trust=True)
    assert not (tmp_path / "here").exists() and (tmp_path / "home" / ".config" / "pneumorph" / "trusted").exists()
