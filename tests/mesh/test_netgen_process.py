"""Netgen in a process of its own: what it does to that process is nothing to this one."""

import os
import subprocess
import sys

import numpy as np
import pytest

from pneumorph.errors import MeshError
from pneumorph.geometry import starting_body
from pneumorph.mesh import mesh_body, netgen_process, scaled_jacobian
from pneumorph.problem import load

# A tetrahedron with an edge of 2 mm.
CORNERS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


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
    netgen_process._process().kill()
    with pytest.raises(MeshError, match=r"Netgen, crashed \(status -?\d+\)"):
        filled()
    assert len(filled()[1])


def test_a_body_whose_mesh_crashes_is_meshed_at_the_next_attempt():
    problem = load("examples/small.toml")
    crashed = netgen_process._process()
    crashed.kill()
    mesh = mesh_body(starting_body(problem.body), problem.mesh.size).mesh
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
from pneumorph.mesh import netgen_process
from tests.mesh.test_netgen_process import filled
filled()
print(netgen_process._process().pid)
"""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stderr == ""
    with pytest.raises(ProcessLookupError):
        os.kill(int(done.stdout), 0)
