"""A small study on a cluster of processes: killed workers, finished members, the summary."""

import csv
import os
import signal
import threading

import pytest
from designing import BRIEFLY
from tiny import tiny
from typer.testing import CliRunner

from pneumorph.cli import app
from pneumorph.run import open_run
from pneumorph.study import load_study, write_summary
from pneumorph.study.cluster import connected, run_members
from pneumorph.study.members import finished

BASE = tiny(pressure='{ A = "20 kPa" }')


@pytest.mark.slow
def test_a_killed_workers_member_goes_on_and_a_finished_one_is_not_run_again(tmp_path):
    (tmp_path / "base.toml").write_text(BASE)
    path = tmp_path / "study.toml"
    # A chamber that balloons: its member fails and is kept apart.
    path.write_text('base = "base.toml"\n[grid]\n"task[0].pressure.A" = ["20 kPa", "2000 kPa"]\n')
    asked, out = load_study(path), tmp_path / "out"
    members = {member.name: member for member in asked.members}
    briefly = [(member, BRIEFLY) for member in asked.members]
    killed = threading.Event()

    def hear(name, entry):
        if entry.iteration == 1 and not killed.is_set():
            killed.set()
            os.kill(worker, signal.SIGKILL)

    with connected(None, 1) as client:
        (worker,) = client.run(os.getpid).values()
        ends = {end.name: end for end in run_members(client, briefly, out, hear)}
        assert worker not in client.run(os.getpid).values()
    assert killed.is_set()
    assert ends["A-20-kPa"].completed
    assert [entry.iteration for entry in open_run(out / "A-20-kPa").history()] == [0, 1, 2]
    assert not ends["A-2000-kPa"].completed
    assert "no stable state" in ends["A-2000-kPa"].reason

    assert finished(out / "A-20-kPa", members["A-20-kPa"].problem)
    assert not finished(out / "A-2000-kPa", members["A-2000-kPa"].problem)
    with write_summary(asked, out).open() as file:
        rows = {row["member"]: row for row in csv.DictReader(file)}
    assert rows["A-20-kPa"]["state"] == "finished"
    assert float(rows["A-20-kPa"]["extend extension (mm)"]) > 0
    assert float(rows["A-20-kPa"]["task[0].pressure.A (kPa)"]) == 20.0
    assert rows["A-2000-kPa"]["state"] == "begun"


def test_no_scheduler_is_said_in_one_line(tmp_path):
    (tmp_path / "base.toml").write_text(BASE)
    path = tmp_path / "study.toml"
    path.write_text('base = "base.toml"\n[[member]]\n')
    for address, said in (("slurm", "needs dask-jobqueue"), ("nonsense://x", "no scheduler answers there")):
        ended = CliRunner().invoke(app, ["study", str(path), "--out", str(tmp_path / "o"), "--cluster", address])
        assert ended.exit_code == 2
        assert said in ended.output
        assert len(ended.output.strip().splitlines()) == 1
