"""Netgen in a process of its own: what it does to that process is nothing to this one."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from signals import LINUX, ends, heard, interrupted, start

from pneumorph.cad import netgen_process
from pneumorph.errors import ComputationError, MeshError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mesh import scaled_jacobian
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import load

# A tetrahedron with an edge of 2 mm.
CORNERS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


FOLDERS = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
"""For programs that import this module."""


def volume(points, tets):
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    return np.linalg.det(edges) / 6


def filled(size=1.0):
    return netgen_process.call("fill", CORNERS, FACES, size)


def test_it_fills_and_improves():
    points, tets = filled()
    np.testing.assert_array_equal(points[:4], CORNERS)
    assert volume(points, tets).min() > 0
    assert volume(points, tets).sum() == pytest.approx(8 / 6, rel=1e-12)
    points, tets = netgen_process.call("optimise", points, tets, FACES, 1.0, "m", 1)
    assert volume(points, tets).sum() == pytest.approx(8 / 6, rel=1e-12)


def test_calls_share_a_process():
    filled()
    before = netgen_process._process().pid
    filled()
    assert netgen_process._process().pid == before != os.getpid()


def test_what_cannot_be_filled_is_said():
    with pytest.raises(MeshError, match="could not be filled"):
        netgen_process.call("fill", CORNERS, FACES[:2], 1.0)
    filled()


def test_a_crash_ends_a_mesh_and_not_the_program():
    filled()
    netgen_process._process().send_signal(signal.SIGABRT)
    with pytest.raises(MeshError, match=r"Netgen, crashed \(status -6\)"):
        filled()
    assert len(filled()[1])


def test_one_that_is_killed_for_its_memory_is_not_tried_again_on_finer_meshes():
    problem = load("examples/small.toml")
    filled()
    netgen_process._process().kill()
    with pytest.raises(ComputationError, match=r"killed, perhaps for want of memory; make mesh\.size larger$"):
        mesh_body(starting_body(problem.tubes), problem.mesh.size)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (("ModuleNotFoundError", "No module named 'netgen'"), "cannot be loaded (No module named 'netgen'); install"),
        (("MemoryError", ""), "has not enough memory; make mesh.size larger"),
        (("Exception", "surfaces are\noverlapping"), "could not be filled with tetrahedra (surfaces are overlapping)"),
    ],
)
def test_why_it_failed_is_said_in_a_line(monkeypatch, answer, said):
    monkeypatch.setattr(netgen_process.pickle, "load", lambda _: answer)
    with pytest.raises(ComputationError) as caught:
        filled()
    assert said in str(caught.value) and "\n" not in str(caught.value)
    monkeypatch.undo()
    netgen_process._end()  # its own answer was not read


def test_one_that_cannot_be_started_is_said_in_a_line(monkeypatch):
    netgen_process._end()
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(ComputationError, match=r"cannot be started \(.*\); .*: /nowhere/python$"):
        filled()


def test_a_body_whose_mesh_crashes_is_meshed_at_the_next_attempt():
    problem = load("examples/small.toml")
    crashed = netgen_process._process()
    crashed.send_signal(signal.SIGABRT)
    mesh = mesh_body(starting_body(problem.tubes), problem.mesh.size).mesh
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.1
    assert netgen_process._process().pid != crashed.pid


def test_an_interrupted_call_leaves_no_answer_to_the_next(monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(netgen_process.pickle, "load", interrupted)
        with pytest.raises(KeyboardInterrupt):
            filled(0.3)
    points, tets = filled(2.0)
    assert len(tets) < 20 and volume(points, tets).min() > 0


def test_it_ends_with_the_program_and_prints_nothing():
    code = """
import numpy as np
from pneumorph.cad import netgen_process
from tests.cad.test_netgen_process import filled
filled()
print(netgen_process._process().pid)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | FOLDERS, check=True, capture_output=True, text=True
    )
    assert done.stderr == ""
    with pytest.raises(ProcessLookupError):
        os.kill(int(done.stdout), 0)


@LINUX
def test_it_ends_at_once_with_a_command_that_is_interrupted():
    code = """
from pneumorph.interrupts import install
from pneumorph.cad import netgen_process
from tests.cad.test_netgen_process import FACES, filled
install()
points, tets = filled()
print("process", netgen_process._process().pid, flush=True)
netgen_process.call("optimise", points, tets, FACES, 1.0, "m", 10**9)  # would take most of an hour
"""
    command = start(["-c", code], env=os.environ | FOLDERS)
    child = os.pidfd_open(int(heard(command, "process").split()[1]))
    ended = interrupted(command, signal.SIGTERM)
    assert (ended.status, ended.err) == (143, "pneumorph: stopped\n")
    assert ends(child), "Netgen goes on"
