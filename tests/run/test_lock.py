"""Two runs in one directory, a changed problem, a full disk: one line, and what there is stays whole."""

import errno
import os
import subprocess
import sys

import pytest
from records import entry, one_element
from refused import refusal
from tiny import tiny

from pneumorph.errors import ComputationError, NotWritten, ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.optimize import DesignAccepted
from pneumorph.problem import loads
from pneumorph.run import RunDirectory, StoredDesign, complete, create, lock, locked, open_run, resume

PROBLEM = loads(tiny())
START = starting_body(PROBLEM.tubes)
PRESSURES = {"extend": {"A": 0.06}}
HOLDER = """
import pathlib, sys
from pneumorph.run import locked
with locked(pathlib.Path(sys.argv[1])):
    print(1, flush=True)
    input()
"""


def record(run: RunDirectory, number: int) -> None:
    run.record(entry(number), StoredDesign.of(START, PRESSURES), one_element(), {"number": number})


@pytest.fixture
def run(tmp_path):
    run = create(tmp_path / "run", PROBLEM)
    for number in range(2):
        record(run, number)
    return run


def contents(run):
    return {path: path.read_bytes() for path in sorted(run.path.rglob("*")) if path.is_file()}


def test_a_second_run_is_refused_before_it_changes_anything(run):
    # What the first one is about to store.
    (run.path / "designs" / "0002.npz").write_bytes(b"half")
    with locked(run.path):
        before = contents(run)
        for action in (
            lambda: create(run.path, PROBLEM),
            lambda: resume(run.path, PROBLEM),
            lambda: complete.complete(run, lambda event: None),
        ):
            message = refusal(action)
            assert message.startswith(f"{run.path}: another run goes on in it (process {os.getpid()} on ")
            assert message.endswith("; wait until it ends, or name another --out")
        assert open_run(run.path).latest() == 1, "it can be read"
        assert contents(run) == before
    assert resume(run.path, PROBLEM).latest() == 1


def test_a_dead_process_leaves_no_lock(run):
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(run.path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert holder.stdout is not None and holder.stdout.readline() == b"1\n"
    assert "another run goes on in it" in refusal(resume, run.path, PROBLEM)
    holder.kill()
    holder.communicate()
    assert resume(run.path, PROBLEM).latest() == 1


@pytest.mark.parametrize("error", [OSError(errno.ENOLCK, "none"), NotImplementedError()])
def test_where_there_are_no_locks_it_goes_on(run, monkeypatch, error):
    def unknown(*_, **__):
        raise error

    monkeypatch.setattr(lock.FileLock, "acquire", unknown)
    with locked(run.path), locked(run.path):
        assert resume(run.path, PROBLEM).latest() == 1


def test_other_directories_get_no_file(tmp_path):
    (tmp_path / "thesis.tex").touch()
    assert "is not empty" in refusal(create, tmp_path, PROBLEM)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_changes_that_are_harmless_and_that_are_not(run):
    same = PROBLEM.with_changes({"optimizer.iterations": 9, "title": "Longer", "make.chord": False, "make.wall": False})
    again = resume(run.path, same)
    again.begin()
    assert again.latest() == 1 and open_run(run.path).problem == same
    before = contents(run)
    changed = PROBLEM.with_changes({"mesh.size": "5 mm", "task[0].pressure.A": "50 kPa", "limits.skew": 0.1})
    message = refusal(resume, run.path, changed)
    assert "contains a run of another problem (task[0].pressure.A, limits.skew, mesh.size differ)" in message
    many = {f"end_effector.spring.{name}": "1 N/mm" for name in ("shift_x", "shift_y", "axial")}
    turning = {f"end_effector.spring.{name}": "1 N*mm/rad" for name in ("bending_x", "bending_y", "torsion")}
    assert "and 1 more differ)" in refusal(resume, run.path, PROBLEM.with_changes(many | turning))
    assert contents(run) == before


def full(monkeypatch, calls: int, number: int = errno.ENOSPC):
    """A disk that is full from the given call on."""
    made = [0]
    sync = os.fsync

    def fsync(handle):
        made[0] += 1
        if made[0] > calls:
            raise OSError(number, os.strerror(number))
        sync(handle)

    monkeypatch.setattr(os, "fsync", fsync)


@pytest.mark.parametrize("calls", range(4))
def test_a_full_disk_leaves_what_there_is_whole(run, monkeypatch, calls):
    with monkeypatch.context() as patch:
        full(patch, calls)
        message = refusal(record, run, 2, kind=NotWritten)
        assert message.startswith(f"{run.path}: cannot be written (No space left on device); what is in it is whole")
    assert open_run(run.path).latest() == 1
    assert not list(run.path.rglob(".*.new"))
    again = resume(run.path, PROBLEM)
    again.begin()
    record(again, 2)
    assert [entry.iteration for entry in again.history()] == [0, 1, 2] and again.latest() == 2


def test_a_line_that_does_not_fit_is_taken_back(run, monkeypatch):
    path = run.path / "history.jsonl"
    before, write = path.read_bytes(), os.write
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda handle, content: write(handle, content[: len(content) // 2]))
        refusal(record, run, 2, kind=NotWritten)
    assert path.read_bytes() == before


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES])
def test_directories_that_cannot_be_written(run, monkeypatch, number):
    before = contents(run)

    def refused(*_, **__):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(lock.os, "open", refused)
        with pytest.raises(NotWritten, match="make it writable"):
            complete.complete(run, lambda event: None)
    with monkeypatch.context() as patch:
        full(patch, 0, number)
        again = resume(run.path, PROBLEM)
        assert f"cannot be written ({os.strerror(number)})" in refusal(again.begin, kind=NotWritten)
        assert "cannot be a run directory" in refusal(create, run.path.parent / "new", PROBLEM)
    assert contents(run) == before and open_run(run.path).latest() == 1


def test_a_run_ends_in_one_line_when_the_disk_is_full(run, monkeypatch):
    def accepted(problem, state, settings, begin):
        yield DesignAccepted(0, entry(0), START, PRESSURES, one_element(), {})

    monkeypatch.setattr(complete, "design", accepted)
    new = create(run.path.parent / "new", PROBLEM)
    full(monkeypatch, 2)
    message = refusal(complete.complete, new, lambda event: None, kind=NotWritten)
    assert "No space left on device" in message and new.latest() is None


def test_a_state_that_cannot_be_resumed_from_changes_nothing(run, monkeypatch):
    """Whether it is refused as it is read, or by the loop, with an unfinished design and another number of designs."""
    (run.path / "designs" / "0002.npz").write_bytes(b"half")
    with (run.path / "history.jsonl").open("a") as history:
        history.write('{"iteration": 2')
    longer = PROBLEM.with_changes({"optimizer.iterations": 9})
    before = contents(run)
    refusal(lambda: complete.complete(resume(run.path, longer), lambda event: None))
    assert contents(run) == before
    monkeypatch.setattr(RunDirectory, "resumable", lambda self: {})
    for kind in (ComputationError, ProblemError):

        def refused(problem, state, settings, begin, kind=kind):
            raise kind("its equilibrium is not found again")
            yield

        monkeypatch.setattr(complete, "design", refused)
        refusal(lambda: complete.complete(resume(run.path, longer), lambda event: None), kind=kind)
        assert contents(run) == before


def test_links_in_a_run_lead_nowhere(run, tmp_path):
    """Nothing outside is written or removed, whether links are in place of files, temporary ones or folders."""
    outside = tmp_path / "outside"
    outside.mkdir()
    for name in ("0000.npz", "0001.npz", "0002.npz", "0007.npz", "file"):
        (outside / name).write_bytes(b"precious")
    before = {path: path.read_bytes() for path in outside.iterdir()}

    def untouched():
        return {path: path.read_bytes() for path in outside.iterdir()} == before

    for name in ("problem.toml", "history.jsonl", "checkpoint.npz"):
        (run.path / f".{name}.new").symlink_to(outside / "file")
        (run.path / name).rename(run.path / f"own {name}")
        (run.path / name).symlink_to(run.path / f"own {name}")
    (run.path / "designs" / "0002.npz").symlink_to(outside / "0002.npz")
    again = resume(run.path, PROBLEM)
    again.begin()
    record(again, 2)
    assert untouched() and not (run.path / "problem.toml").is_symlink()
    assert again.latest() == 2 and not (run.path / "designs" / "0002.npz").is_symlink()
    # A history may not be appended to through a link either.
    (run.path / "history.jsonl").rename(outside / "history.jsonl")
    (run.path / "history.jsonl").symlink_to(outside / "history.jsonl")
    lines = (outside / "history.jsonl").read_bytes()
    refusal(record, again, 3, kind=NotWritten)
    assert (outside / "history.jsonl").read_bytes() == lines
    (run.path / "history.jsonl").unlink()
    (outside / "history.jsonl").rename(run.path / "history.jsonl")
    for folder in ("designs", "fields"):
        (run.path / folder).rename(run.path / f"own {folder}")
        (run.path / folder).symlink_to(outside)
        assert f"{folder} is a link" in refusal(resume, run.path, PROBLEM)
        assert f"{folder} is a link" in refusal(again.begin, kind=NotWritten)
        assert f"{folder} is a link" in refusal(record, again, 3, kind=NotWritten)
        (run.path / folder).unlink()
        (run.path / f"own {folder}").rename(run.path / folder)
        assert untouched()
