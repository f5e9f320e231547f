"""The run directory: what is written reads back, and a kill at any moment loses at most the iteration in progress."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from records import ENTRY, entry, one_element
from refused import refusal

from pneumorph import atomic
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import load
from pneumorph.results import FineResult, HistoryEntry, to_json
from pneumorph.run import StoredDesign, create, open_run, resume

EXAMPLES = Path(__file__).parents[2] / "examples"
PROBLEM = load(EXAMPLES / "linear.toml")
OTHER = load(EXAMPLES / "linear_spring.toml")


def design(iteration: int) -> StoredDesign:
    rng, start = np.random.default_rng(iteration), starting_body(PROBLEM.tubes)
    nets = [surface.net + 0.1 * rng.random(surface.net.shape) for surface in start.surfaces]
    return StoredDesign(nets[0], {"A": nets[1]}, {"extend": {"A": 0.06}})


def line(iteration: int) -> HistoryEntry:
    return entry(
        iteration, objective=float(np.float64(0.1 * iteration)), limits=ENTRY.limits | {"wall_mm": float("inf")}
    )


def state(iteration: int) -> dict:
    return {"phi": np.arange(3.0) + iteration, "step": 0.1 + iteration, "mesh": {"seed": iteration}, "tried": [1, None]}


def run_of(path: Path, iterations: int):
    run = create(path, PROBLEM)
    for iteration in range(iterations):
        run.record(line(iteration), design(iteration), one_element(), state(iteration))
    return run


def test_what_is_written_reads_back(tmp_path):
    run_of(tmp_path / "run", 3)
    run = open_run(tmp_path / "run")
    assert run.problem == PROBLEM
    assert run.latest() == 2
    assert [entry.iteration for entry in run.history()] == [0, 1, 2]
    assert run.history()[2].objective == 0.2
    assert run.history()[2].limits["wall_mm"] is None
    stored, written = run.load_design(1), design(1)
    np.testing.assert_array_equal(stored.exterior, written.exterior)
    np.testing.assert_array_equal(stored.chambers["A"], written.chambers["A"])
    assert stored.pressures == written.pressures
    iteration, back = run.checkpoint()
    assert iteration == 2
    np.testing.assert_array_equal(back.pop("phi"), [2.0, 3.0, 4.0])
    assert back == {"step": 2.1, "mesh": {"seed": 2}, "tried": [1, None]}
    fields = run.fields(2)
    np.testing.assert_array_equal(fields.mesh.tets, one_element().mesh.tets)
    np.testing.assert_array_equal(fields.u["extend"], one_element().u["extend"])
    assert fields.sag is None and set(fields.mesh.faces) == {"base"}
    assert run.fields(1) is None, "only the first and the last design keep theirs"


def test_the_last_design_of_the_history_gets_its_estimates_at_the_end(tmp_path):
    run, finer = run_of(tmp_path / "run", 3), {"extend": FineResult(-0.11, {}, (0.0, 0.0, 0.11), (0.0, 0.0, 0.0), {})}
    before = run.history()
    run.amend(finer)
    assert run.history() == [*before[:2], replace(before[2], finer=finer)]
    assert run.latest() == 2


def test_a_body_comes_back_as_it_was_stored(tmp_path):
    start = starting_body(PROBLEM.tubes)
    body = start.with_control_points(start.control_points() + 0.1)
    run = create(tmp_path, PROBLEM)
    run.record(line(0), StoredDesign.of(body, {"extend": {"A": 0.06}}), one_element(), {})
    back = run.load_design(0).body(PROBLEM)
    np.testing.assert_array_equal(back.control_points(), body.control_points())


def test_names_in_the_design_file(tmp_path):
    run_of(tmp_path, 1)
    with np.load(tmp_path / "designs" / "0000.npz") as stored:
        assert {name: stored[name].shape for name in stored.files} == {
            "exterior": design(0).exterior.shape,
            "chamber_A": design(0).chambers["A"].shape,
            "pressures": (1, 1),
        }


class Killed(BaseException):
    """Stands for the moment at which the process ends."""


@pytest.mark.parametrize("moment", range(4))
def test_a_kill_at_any_moment_of_recording(tmp_path, monkeypatch, moment):
    """Design 2 is being recorded when the process ends before one of its four writes takes effect, or after them."""
    run = run_of(tmp_path, 2)
    calls = 0
    replace, append = atomic.os.replace, atomic.append_line

    def counted(action, torn):
        def called(*arguments, **options):
            nonlocal calls
            calls += 1
            if calls == moment + 1:
                torn(*arguments)
                raise Killed
            action(*arguments, **options)

        return called

    def half_a_line(path, text):
        with path.open("a") as file:
            file.write(text[: len(text) // 2])

    with monkeypatch.context() as patch:
        patch.setattr(atomic.os, "replace", counted(replace, lambda *_: None))
        patch.setattr(atomic, "append_line", counted(append, half_a_line))
        try:
            run.record(line(2), design(2), one_element(), state(2))
        except Killed:
            expected = 1
        else:
            expected = 2
    assert expected == (1 if moment < 4 else 2)
    assert open_run(tmp_path).latest() == expected

    again = resume(tmp_path, PROBLEM)
    again.begin()
    assert again.latest() == expected
    assert [entry.iteration for entry in again.history()] == list(range(expected + 1))
    assert sorted(path.name for path in (tmp_path / "designs").glob("[!.]*")) == [
        f"{i:04d}.npz" for i in range(expected + 1)
    ]
    again.record(line(expected + 1), design(expected + 1), one_element(), state(expected + 1))
    assert again.latest() == expected + 1
    assert [entry.iteration for entry in again.history()] == list(range(expected + 2))


def test_ctrl_c_in_a_program_leaves_no_temporary_file(tmp_path, monkeypatch):
    atomic.write_bytes(tmp_path / "file", b"old")

    def interrupted(handle):
        raise KeyboardInterrupt

    monkeypatch.setattr(atomic.os, "fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        atomic.write_bytes(tmp_path / "file", b"new")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"old"]


@pytest.mark.parametrize("cut", [1, 10, 40])
def test_a_torn_last_line_is_ignored_and_trimmed(tmp_path, cut):
    run_of(tmp_path, 2)
    history = tmp_path / "history.jsonl"
    whole = history.read_bytes()
    history.write_bytes(whole + whole.splitlines(keepends=True)[-1][:cut])
    assert [entry.iteration for entry in open_run(tmp_path).history()] == [0, 1]
    torn = history.read_bytes()
    again = resume(tmp_path, PROBLEM)
    assert history.read_bytes() == torn, "nothing is changed before it goes on"
    again.begin()
    assert history.read_bytes() == whole


def test_resume_before_the_first_design(tmp_path):
    """Killed before there was anything, or with the problem alone written, or in the first record."""
    assert resume(tmp_path / "none", PROBLEM).latest() is None
    empty = tmp_path / "empty"
    empty.mkdir()
    assert resume(empty, PROBLEM).latest() is None
    run = create(tmp_path / "begun", PROBLEM)
    atomic.append_line(run.path / "history.jsonl", json.dumps(to_json(line(0))))
    again = resume(run.path, PROBLEM)
    again.begin()
    assert again.latest() is None and run.history() == []


def test_resume_may_change_the_number_of_iterations(tmp_path):
    run_of(tmp_path, 2)
    longer = PROBLEM.model_copy(update={"optimizer": PROBLEM.optimizer.model_copy(update={"iterations": 100})})
    again = resume(tmp_path, longer)
    assert again.latest() == 1 and open_run(tmp_path).problem == PROBLEM
    again.begin()
    assert open_run(tmp_path).problem.optimizer.iterations == 100


def test_runs_from_before_a_limit_by_default_go_on_without_it(tmp_path):
    asked = load(EXAMPLES / "small.toml")
    run = create(tmp_path / "run", asked)
    text = (run.path / "problem.toml").read_text()
    old = "".join(line for line in text.splitlines(True) if not line.startswith(("margin", "strain")))
    assert old.count("\n") == text.count("\n") - 2
    (run.path / "problem.toml").write_text(old)
    without = asked.with_changes({"limits.margin": 1, "limits.strain": "off"})
    assert open_run(run.path).problem == without
    assert resume(run.path, asked).problem == without
    with pytest.raises(ProblemError, match=r"limits\.margin"):
        resume(run.path, asked.with_changes({"limits.margin": 1.3}))


def test_refusals(tmp_path):
    run_of(tmp_path / "run", 1)
    assert "add --resume" in refusal(create, tmp_path / "run", PROBLEM)
    assert "end_effector.spring.axial, end_effector.hold" in refusal(
        resume, tmp_path / "run", OTHER.model_copy(update={"title": PROBLEM.title, "optimizer": PROBLEM.optimizer})
    )
    assert "name another --out" in refusal(create, tmp_path / "run" / "problem.toml", PROBLEM)
    assert "not a run directory" in refusal(open_run, tmp_path)
    assert "no such file" in refusal(open_run(tmp_path / "run").load_design, 7)
    strange = tmp_path / "strange"
    strange.mkdir()
    (strange / "thesis.tex").touch()
    assert "is not empty" in refusal(resume, strange, PROBLEM)
    assert (strange / "thesis.tex").exists()


def test_damage_is_told(tmp_path):
    run_of(tmp_path / "run", 2)
    for name in ("checkpoint.npz", "designs/0001.npz", "history.jsonl"):
        damaged = tmp_path / "copy"
        shutil.copytree(tmp_path / "run", damaged)
        (damaged / name).write_bytes(b"no\n")
        run = open_run(damaged)
        assert "is damaged" in refusal(lambda run=run: (run.latest(), run.load_design(1)))
        shutil.rmtree(damaged)
    for name, content in (("checkpoint.npz", {"phi": np.zeros(3)}), ("designs/0001.npz", {"exterior": np.zeros(3)})):
        shutil.copytree(tmp_path / "run", tmp_path / "copy")
        atomic.write_arrays(tmp_path / "copy" / name, content)
        run = open_run(tmp_path / "copy")
        assert "is damaged" in refusal(lambda run=run: (run.latest(), run.load_design(1)))
        shutil.rmtree(tmp_path / "copy")
    shutil.copytree(tmp_path / "run", tmp_path / "copy")
    (tmp_path / "copy" / "history.jsonl").write_text("3\n")
    assert "is damaged" in refusal(open_run(tmp_path / "copy").history)
    (tmp_path / "run" / "designs" / "0001.npz").unlink()
    assert "restore the files" in refusal(open_run(tmp_path / "run").latest)
