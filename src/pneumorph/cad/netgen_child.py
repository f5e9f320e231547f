"""The process in which Netgen works: it reads calls from its standard input and writes what they return.

A program of its own, started by `netgen_process.py`, which ends when its input does. It imports nothing of pneumorph.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import sys
import threading
from collections.abc import Iterator
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
    """A better mesh of straight tetrahedra: its points (N, 3) and tetrahedra (M, 4).

    Parameters
    ----------
    points : (N, 3) array
        Places of the vertices, mm.
    tets : (M, 4) int
        Tetrahedra by their vertices.
    triangles : (T, 3) int
        The surface, which stays.
    size : float
        Edge length, mm.
    moves : str
        Kinds of moves, in their order: c combine, d divide, m move points, s t u swap.
    steps : int
        How often they are gone through.
    """
    mesh = _mesh(points, triangles)
    mesh.AddElements(dim=3, index=1, data=np.ascontiguousarray(tets[:, [0, 2, 1, 3]], dtype=np.int32), base=0)
    mesh.SetMaterial(1, "solid")
    mesh.OptimizeVolumeMesh(_netgen().MeshingParameters(maxh=size, optimize3d=moves, optsteps3d=steps, **_SERIAL))
    return _arrays(mesh)


class Unsuitable(Exception):
    """What is wrong with a file, as a sentence without its subject."""


def solids(
    path: str, key: str, scale: float, size: float, most: int, cuts: tuple[int, ...] = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str], np.ndarray]:
    """The meshed faces of all solids in a STEP or BREP file, whose coordinates are multiplied by `scale`.

    Returns points (n, 3), six-node triangles (m, 6), the face of each (m,) from 0, the names of the faces, and the
    solids (m, 2) that the normal of each triangle points from and to, −1 for none.

    Parameters
    ----------
    path : of the file.
    key : that no file of another content has.
    scale : mm per unit of the file as it is read, in which STEP has mm.
    size : desired edge length, mm; 0 for a coarse outline.
    most : faces that a file may have.
    cuts : axes, 0 to 2; of the solids only what is at positive coordinates along these is meshed, and left open there.
    """
    shape = _shape(path, key)
    if not len(shape.solids):
        found = f"{len(shape.faces)} faces that are not closed to a solid" if len(shape.faces) else "no faces"
        raise Unsuitable(f"has {found}; save a solid")
    if len(shape.faces) > most:
        raise Unsuitable(f"has {len(shape.faces)} faces, more than {most}; simplify it in CAD")
    shape = _whole(shape, scale)
    lower, upper = np.array([list(corner) for corner in shape.bounding_box])
    size = size or float(np.linalg.norm(upper - lower)) / _COARSE
    shape = _cut(shape, cuts, lower, upper)
    with _limited():
        step = _netgen().MeshingStep.MESHSURFACE
        mesh = (
            _occ()
            .OCCGeometry(shape)
            .GenerateMesh(maxh=size, perfstepsend=step, curvaturesafety=_CURVATURE, grading=_GRADING, **_SERIAL)
        )
        mesh.SecondOrder()
    elements = mesh.Elements2D().NumPy()
    if not len(elements) or not elements["nodes"][:, :6].all():
        raise Unsuitable("has a face that cannot be meshed; repair it in CAD")
    descriptors = mesh.FaceDescriptors()
    names = ["" if each.bcname == "default" else each.bcname for each in descriptors]
    domains = np.array([[each.domin, each.domout] for each in descriptors]) - 1
    face = elements["index"].astype(np.int64) - 1
    # Netgen's fourth to sixth node are opposite to the corners.
    triangles = elements["nodes"][:, [0, 1, 2, 5, 3, 4]].astype(np.int64) - 1
    points = np.array(mesh.Coordinates())
    in_cut = np.abs(points[:, list(cuts)]) <= _IN_PLANE * np.linalg.norm(upper - lower)
    kept = ~np.any(np.all(in_cut[triangles], axis=1), axis=1)
    return points, triangles[kept], face[kept], names, domains[face[kept]]


def distances(path: str, key: str, scale: float, places: np.ndarray, face: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n,) in mm of places (n, 3) from faces (n,), as `solids` numbers them, and these.

    Parameters
    ----------
    path, key, scale
        See `solids`.
    places : (n, 3) array
        mm.
    face : (n,) int
        The face of each.
    """
    occ, found = _occ(), np.empty(len(places))
    faces = occ.OCCGeometry(_whole(_shape(path, key), scale)).faces
    for number, (place, own) in enumerate(zip(places.tolist(), face.tolist(), strict=True)):
        found[number] = occ.Vertex(occ.Pnt(*place)).Distance(faces[own])
    return found, face


def triangles(path: str, size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The surface in an STL file, remeshed: points (n, 3), triangles (m, 3), and the smooth part of each from 0."""
    with _limited():
        geometry = import_module("netgen.stl").STLGeometry(path)
        mesh = geometry.GenerateMesh(maxh=size, perfstepsend=_netgen().MeshingStep.MESHSURFACE, **_SERIAL)
    elements = mesh.Elements2D().NumPy()
    corners = elements["nodes"][:, :3].astype(np.int64) - 1
    return np.array(mesh.Coordinates()), corners, elements["index"].astype(np.int64) - 1


def fill_voids(path: str, key: str, centres: np.ndarray, out: str) -> tuple[list[str], list[str]]:
    """Write a BREP file with the solid of a STEP or BREP file, of which closed voids are filled.

    Parameters
    ----------
    path, key
        See `solids`.
    centres : (n, 3) array
        Near the centroids of the voids, in the unit of the file.
    out : the file.
    """
    occ, body = _occ(), _shape(path, key)
    if len(body.solids) != 1:
        raise Unsuitable(f"has {len(body.solids)} solids; fill their voids in CAD")
    # The faces of a void point into it, so that the solid within them has less than no volume.
    voids = [each for each in map(occ.Solid, body.shells) if each.mass < 0.0]
    middles = np.array([list(each.center) for each in voids]).reshape(-1, 3)
    for centre in centres:
        body = body + voids[int(np.linalg.norm(middles - centre, axis=1).argmin())].Reversed()
    body.WriteBrep(out)
    return [out], [out]


def compose(parts: list[tuple[bool, str, tuple[float, ...], float]], path: str) -> tuple[list[str], list[str]]:
    """Write a STEP or BREP file with a body, of which parts are added or cut out in order, see `bodies.parts.Part`.

    A BREP file of the same parts has the same bytes, while one in STEP has the time in it.
    """
    occ = _occ()
    kinds = {
        "box": lambda a, b, c, d, e, f: occ.Box(occ.Pnt(a, b, c), occ.Pnt(d, e, f)),
        "cylinder": lambda x, y, z, radius, height: occ.Cylinder(occ.Pnt(x, y, z), occ.Z, radius, height),
        "ball": lambda x, y, z, radius: occ.Sphere(occ.Pnt(x, y, z), radius),
        "turned": _turned,
    }
    axis = occ.Axis(occ.Pnt(0, 0, 0), occ.Z)
    first, *others = (
        (added, kinds[kind](*numbers).Rotate(axis, turn) if turn else kinds[kind](*numbers))
        for added, kind, numbers, turn in parts
    )
    body = first[1]
    for added, part in others:
        body = body + part if added else body - part
    (body.WriteBrep if path.endswith(".brep") else body.WriteStep)(path)
    if not os.path.exists(path):
        raise Unsuitable(f"{path} cannot be written; give another name")
    return [path], [path]


def _turned(*numbers: float) -> Any:
    """What a polygon of radii and z sweeps about z."""
    occ = _occ()
    (first, *others) = zip(numbers[::2], numbers[1::2], strict=True)
    pen = occ.WorkPlane(occ.Axes(occ.Pnt(0, 0, 0), n=-occ.Y, h=occ.X)).MoveTo(*first)
    for corner in others:
        pen.LineTo(*corner)
    return pen.Close().Face().Revolve(occ.Axis(occ.Pnt(0, 0, 0), occ.Z), 360.0)


_COARSE = 25.0
"""Edges of a coarse outline along the diagonal of a body."""

_CURVATURE = 1.0
"""Edges are no longer than the radius of curvature divided by this; curved elements follow so much of a circle."""

_GRADING = 0.5
"""How fast elements grow away from small ones: Netgen's own 0.3 makes twice as many where a part has fine details."""

_IN_PLANE = 1e-7
"""How far nodes in a plane are from it, relative to the diagonal of the body."""

_MOST_BYTES = 3 << 30
"""Memory that reading and meshing a file may take."""

_shapes: dict[str, Any] = {}
"""The last shape that was read, by its key: it is meshed several times."""


def _shape(path: str, key: str) -> Any:
    if key not in _shapes:
        _shapes.clear()
        occ = _occ()
        try:
            with _limited():
                _shapes[key] = occ.OCCGeometry(path).shape
        except MemoryError:
            raise
        except Exception as error:
            raise Unsuitable("cannot be read: it is not what its suffix says, or damaged; export it again") from error
    return _shapes[key]


def _whole(shape: Any, scale: float) -> Any:
    """All solids of a shape in mm; faces where they meet become common to both."""
    if len(shape.solids) > 1:
        shape = _occ().Glue(list(shape.solids))
    return shape if scale == 1.0 else shape.Scale(_occ().Pnt(0, 0, 0), scale)


def _cut(shape: Any, cuts: tuple[int, ...], lower: np.ndarray, upper: np.ndarray) -> Any:
    """What of all solids in a box is at positive coordinates along some axes."""
    if not cuts:
        return shape
    occ, margin = _occ(), float(np.linalg.norm(upper - lower))
    low, high = lower - margin, upper + margin
    low[list(cuts)] = 0.0
    half = occ.Box(occ.Pnt(*low.tolist()), occ.Pnt(*high.tolist()))
    parts = [part for solid in shape.solids for part in (solid * half).solids]
    return occ.Glue(parts) if len(parts) > 1 else parts[0]


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    """Bound the memory that is taken in addition, where the system can do that."""
    try:
        import resource

        with open("/proc/self/statm") as file:
            used = int(file.read().split()[0]) * resource.getpagesize()
    except (ImportError, OSError):
        yield
        return
    kept = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + _MOST_BYTES, kept[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, kept)


@cache
def _occ() -> Any:
    return import_module("netgen.occ")


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
    elements = mesh.Elements3D().NumPy()["nodes"]
    if not len(elements):
        raise RuntimeError("Netgen found none")
    tets = elements[:, :4].astype(np.int64) - 1
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
    calls, waiting = (
        {each.__name__: each for each in (fill, optimise, solids, distances, triangles, compose, fill_voids)},
        SimpleQueue[tuple[str, Any]](),
    )
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
