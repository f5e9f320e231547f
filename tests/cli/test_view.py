"""`pneumorph view` as a process: it says where it is, ends with Ctrl-C, and refuses in one line."""

import json
import signal
import urllib.request

import pytest
from runs import analysed, waving_run
from signals import POSIX, heard, interrupted, start
from tiny import tiny

from pneumorph.problem import loads


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    problem = loads(tiny())
    return waving_run(tmp_path_factory.mktemp("runs") / "run", problem, 1, {0: analysed(problem, 0.0)}).path


@POSIX
@pytest.mark.parametrize(
    ("number", "status", "words"), [(signal.SIGINT, 0, ""), (signal.SIGTERM, 143, "pneumorph: stopped\n")]
)
def test_it_serves_until_it_is_interrupted(path, number, status, words):
    process = start(["-m", "pneumorph", "view", str(path), "--no-browser"])
    said = heard(process, str(path))
    assert said.startswith(f"{path} at http://127.0.0.1:") and said.endswith("(Ctrl-C ends it)\n")
    address = said.removeprefix(f"{path} at ").split()[0]
    with urllib.request.urlopen(f"{address}runs", timeout=60) as answer:
        assert [told["title"] for told in json.load(answer)] == ["Tiny"]
    # While it solves, too.
    body = json.dumps({"start": True}).encode()
    asked = urllib.request.Request(f"{address}runs/0/designs/0/sweep", body, {"Content-Type": "application/json"})
    with urllib.request.urlopen(asked, timeout=60) as answer:
        assert json.load(answer)["left"] == 7
    ended = interrupted(process, number)
    assert (ended.status, ended.out, ended.err) == (status, "", words)


def test_it_opens_a_browser_unless_asked_not_to(path, monkeypatch, run):
    from pneumorph.cli import view as module

    opened = []
    monkeypatch.setattr(module.webbrowser, "open", lambda address: bool(opened.append(address)) or True)
    monkeypatch.setattr(module.Server, "serve_until_interrupted", lambda server: server.close())
    monkeypatch.setenv("BROWSER", "some")
    said = run("view", path)
    assert said.exit_code == 0 and opened == [said.stdout.split()[2]]
    run("view", path, "--no-browser")
    assert len(opened) == 1
    for name in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(module.sys, "platform", "linux")
    assert "no browser could be opened here" in run("view", path).stdout and len(opened) == 1


def test_refusals_are_one_line(path, tmp_path, run):
    for arguments, words in (
        ((tmp_path,), "is not a run directory (no problem.toml in it)"),
        ((path, "--port", "70000"), "--port 70000: cannot be used"),
        ((path,) * 9, "9 runs: at most 8 are shown in one view; name fewer"),
    ):
        refused = run("view", *arguments, "--no-browser")
        assert refused.exit_code == 2 and words in refused.stderr and refused.stderr.count("\n") == 1
