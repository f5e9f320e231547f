"""The server: what it serves, and to whom not."""

import json
import socket
from pathlib import Path

import pytest
from runs import analysed, line, waving_run
from tiny import tiny

from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.output.packed import unpack
from pneumorph.problem import loads
from pneumorph.run import StoredDesign, create
from pneumorph.serve.live import sliders_of
from pneumorph.serve.server import MOST_RUNS, Server


def test_the_page_may_ask_this_server_alone(run, serving, asked):
    with serving(run.path) as server:
        status, page = asked(server)
    assert status == 200 and "default-src 'none'; connect-src 'self'; script-src 'sha256-" in page.decode()
    assert '<script type="application/octet-stream" id="block"></script>' in page.decode()


def test_the_runs_and_what_they_show(run, serving, asked):
    with serving(run.path) as server:
        assert server.server_address[0] == "127.0.0.1"
        ((told,),) = [json.loads(asked(server, "runs")[1])]
        assert (told["name"], told["title"]) == ("run", "Tiny") and told["stamp"]
        facts, arrays = unpack(asked(server, "runs/0")[1])
    assert [entry["iteration"] for entry in facts["history"]] == [0, 1, 2]
    assert facts["result"]["reason"] == "it is a test"
    assert facts["sliders"] == [{"chamber": "A", "least": 0.0, "most": pytest.approx(0.075)}]
    assert arrays["net chamber A"].shape[0] == 3


def test_other_hosts_origins_and_paths_get_nothing(run, serving, asked):
    with serving(run.path) as server:
        port = server.server_address[1]
        assert asked(server, "runs", Host=f"localhost:{port}")[0] == 200
        for refused in (
            {"Host": "evil.example"},
            {"Host": f"127.0.0.1.evil.example:{port}"},
            {"Origin": "https://evil.example"},
            {"Origin": "null"},
            {"Sec_Fetch_Site": "cross-site"},
        ):
            assert asked(server, "runs", **refused)[0] == 403, refused
        for path in ("/", "/runs", "/wrong/runs", "/../../etc/passwd"):
            assert asked(server, path=path)[0] == 404, path
        for name in (
            "../runs",
            "runs/1",
            "runs/-1",
            "runs/0/problem.toml",
            "runs/..%2f..",
            "runs/%c2%b2",
            "runs/9999999",
        ):
            status, content = asked(server, name)
            assert status == 404 and list(json.loads(content)) == ["error"], name
        assert asked(server, "runs", method="DELETE")[0] == 501


def test_demands_must_make_sense(run, serving, asked):
    with serving(run.path) as server:

        def answer(design, body, **headers):
            status, content = asked(server, f"runs/0/designs/{design}/state", method="POST", body=body, **headers)
            return status, json.loads(content)["error"]

        assert answer(0, {"A": 1.0}, Content_Type="text/plain")[0] == 415
        assert answer(0, [1.0]) == (400, "the request must be a JSON object")
        assert answer(0, {"B": 1.0}) == (409, "pressures: need a number in kPa for each of A")
        for strange in (True, "1", None, [1.0], {"kPa": 1.0}):
            assert answer(0, {"A": strange}) == (409, "pressures: are not numbers in kPa")
        for absurd in (float("nan"), 1e4, -1e9, 10**400):
            assert answer(0, {"A": absurd}) == (409, "pressures: A must be between -3.75 and 78.75 kPa")
        nested = "[" * 9000 + "]" * 9000
        assert answer(0, nested) == (400, "the request must be a JSON object")
        assert answer(7, {"A": 1.0})[1].startswith("design 7: ")
        assert answer(0, {"A": "x" * 30_000})[0] == 413
        assert server.solver._process is None, "nothing was asked of the solver"


def test_new_designs_change_the_stamp(tmp_path, serving, asked):
    problem = loads(tiny())
    run = create(tmp_path / "run", problem)
    with serving(run.path) as server:

        def stamp():
            return json.loads(asked(server, "runs")[1])[0]["stamp"]

        assert stamp() is None
        seen = set()
        fields = analysed(problem, 0.0)
        for number in range(2):
            stored = StoredDesign.of(starting_body(problem.tubes), {"extend": {"A": 0.06}})
            run.record(line(problem, number, {"extend": {"A": 0.06}}), stored, fields, {})
            seen.add(stamp())
            facts, _ = unpack(asked(server, "runs/0")[1])
            assert len(facts["history"]) == number + 1 and facts["result"] is None
        assert len(seen) == 2 and None not in seen
        (run.path / "designs" / "0001.npz").write_bytes(b"no")
        (run.path / "history.jsonl").touch()
        status, content = asked(server, "runs/0")
        assert status == 409 and "0001.npz: is damaged" in json.loads(content)["error"]


def test_a_result_of_before_the_run_was_resumed_is_no_end(run, serving, asked, tmp_path):
    problem = loads(tiny())
    again = waving_run(tmp_path / "again", problem, 3, {0: analysed(problem, 0.0)})
    result = json.loads((run.path / "result.json").read_text(encoding="utf-8")) | {"iterations": 1}
    (again.path / "result.json").write_text(json.dumps(result))
    with serving(again.path) as server:
        assert unpack(asked(server, "runs/0")[1])[0]["result"] is None


def test_runs_are_told_apart_by_their_paths(tmp_path, serving, asked):
    problem, fields = loads(tiny()), None
    for name in ("a", "b"):
        fields = fields or analysed(problem, 0.0)
        waving_run(tmp_path / name / "run", problem, 1, {0: fields})
    with serving(tmp_path / "a/run", tmp_path / "b/run") as server:
        assert [told["name"] for told in json.loads(asked(server, "runs")[1])] == ["a/run", "b/run"]


def test_what_cannot_be_served(run, tmp_path):
    with pytest.raises(ProblemError, match="is not a run directory"):
        Server([tmp_path])
    with pytest.raises(ProblemError, match=f"at most {MOST_RUNS} are shown"):
        Server([run.path] * (MOST_RUNS + 1))
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(ProblemError, match=r"--port \d+: cannot be used \(Address already in use\)"):
            Server([run.path], taken.getsockname()[1])
    with pytest.raises(ProblemError, match="--port 70000: cannot be used"):
        Server([run.path], 70000)


def test_sliders_go_beyond_the_tasks():
    problem = loads(Path("examples/arm_parallel.toml").read_text(encoding="utf-8"))
    for slider in sliders_of(problem, {}):
        ends = [
            end
            for task in problem.task
            for end in (task.pressure[slider.chamber].min, task.pressure[slider.chamber].max)
        ]
        assert slider.least <= min(0.0, *ends) <= max(0.0, *ends) < slider.most
