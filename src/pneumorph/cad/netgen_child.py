"""The process in which Netgen works: it reads calls from its standard input and writes what they return.

A program of its own, started by `netgen_process.py`, which ends when its input does. It imports nothing of pneumorph.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import sys
import threading
from functools import cache
from importlib import import_module
from queue import SimpleQueue
from typing import Any

import numpy as np

_SERIAL = {"parallel_meshing": False}
"""Netgen's threads, four by default, wait for each other by turning in circles: on two cores meshes of 2,000 elements
took four times as much processor time with them, of 11,000 elements 1.7 times; all meshes were the same."""


def fill(points: np.ndarray, triangles: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in mm, the given ones first, and the corners of tetrahedra (m, 4) inside closed surfaces.

    The surfaces are given by the corners of their triangles (nt, 3), normals outwards; `size` is the desired edge
    length in mm.
    """
    mesh = _mesh(points, triangles)
    mesh.GenerateVolumeMesh(maxh=size, optimize3d="", **_SERIAL)
    return _arrays(mesh)


def optimise(
    points: np.ndarray, tets: np.ndarray, triangles: np.ndarray, size: float, moves: str, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """A better mesh; letters name the optimiser's moves: c combine, d divide, m move points, s t u swap."""
    mesh = _mesh(points, triangles)
    mesh.AddElements(dim=3, index=1, data=np.ascontiguousarray(tets[:, [0, 2, 1, 3]], dtype=np.int32), base=0)
    mesh.SetMaterial(1, "solid")
    mesh.OptimizeVolumeMesh(_netgen().MeshingParameters(maxh=size, optimize3d=moves, optsteps3d=steps, **_SERIAL))
    return _arrays(mesh)


@cache
def _netgen() -> Any:
    # Compiled, without type information.
    module = import_module("netgen.meshing")
    module.SetMessageImportance(0)
    return module


def _mesh(points: np.ndarray, triangles: np.ndarray) -> Any:
    mesh = _netgen().Mesh()
    face = mesh.Add(_netgen().FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    mesh.AddPoints(np.ascontiguousarray(points))
    mesh.AddElements(dim=2, index=face, data=np.ascontiguousarray(triangles, dtype=np.int32), base=0)
    return mesh


def _arrays(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points and positively oriented corners, copied because Netgen's arrays are freed with its mesh."""
    tets = mesh.Elements3D().NumPy()["nodes"][:, :4].astype(np.int64) - 1
    return np.array(mesh.Coordinates()), tets[:, [0, 2, 1, 3]]


def _read(waiting: SimpleQueue[tuple[str, Any]]) -> None:
    """Take in calls, beside Netgen, and end the process once there will be no more: whoever asked is gone."""
    with contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            waiting.put(pickle.load(sys.stdin.buffer))
    os._exit(0)


def main() -> None:
    # Netgen prints from C++.
    answers, nowhere = os.fdopen(os.dup(1), "wb"), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    calls, waiting = {"fill": fill, "optimise": optimise}, SimpleQueue[tuple[str, Any]]()
    threading.Thread(target=_read, args=(waiting,), daemon=True).start()
    while True:
        name, arguments = waiting.get()
        try:
            answer = calls[name](*arguments)
        except Exception as error:  # Netgen has no specific error class here, and not all of its errors can be pickled
            answer = type(error).__name__, str(error)
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    main()
