"""Checks of the written files, which are read back and compared with the design."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import manifold3d
import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.Geom import Geom_BSplineSurface, Geom_Plane
from OCP.gp import gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shape

from pneumorph.cad.boxes import boxes_of, nearest
from pneumorph.geometry.tube.surface import TubeSurface, cap_points, enclosed_volume
from pneumorph.make.printing import read_3mf, read_stl
from pneumorph.make.step import read_step
from pneumorph.make.triangles import Triangles

VOLUME = 1e-6
"""Largest allowed relative error of the volume in a STEP file."""

DISTANCE = 1e-6
"""Largest allowed distance in mm of a point of the design from the surfaces in a STEP file."""

_QUADRATURE = 1e-9
"""Relative accuracy to which OpenCASCADE integrates volumes: far below `VOLUME`."""

_PER_SPAN = 5
"""Sample points per knot span and direction: one more than a cubic polynomial has coefficients."""


@dataclass(frozen=True)
class Check:
    """One measured quantity and its limit.

    Attributes
    ----------
    file : str
        The file that was read.
    what : str
        What was measured.
    value, limit : float
        The measured value, and the largest allowed one. For defects it is their number.
    unit : str
        Unit of both.
    """

    file: str
    what: str
    value: float
    limit: float
    unit: str = ""

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return bool(self.value <= self.limit)  # for JSON also where NumPy computed it


def volume_inside(surfaces: Sequence[TubeSurface]) -> float:
    """Exact volume in mm³ of the solid bounded by surfaces: that inside the first minus those inside the others."""
    first, *others = (enclosed_volume(surface) for surface in surfaces)
    return first - sum(others)


def check_step(path: Path, surfaces: Sequence[TubeSurface]) -> Iterator[Check]:
    """Check a STEP file against the surfaces of its only solid.

    Parameters
    ----------
    path : Path
        File written by `write_body_step` or `write_chamber_step`.
    surfaces : sequence of TubeSurface
        Those of the body, or one chamber from `fill_chamber`.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    shape, name = read_step(path), path.name
    shells = list(map(TopoDS.Shell, parts_of(shape, TopAbs_ShapeEnum.TopAbs_SHELL)))
    closed = shells_are(name, shape, 1, len(surfaces))
    yield closed
    if not closed.passed:
        return
    yield validity(name, shape)
    error = abs(volume_of(shape, _QUADRATURE) / volume_inside(surfaces) - 1.0)
    yield Check(name, "relative volume error", error, VOLUME)
    furthest = max(_distance(shell, surface) for shell, surface in zip(shells, surfaces, strict=True))
    yield Check(name, "distance of the design's points from the surfaces", furthest, DISTANCE, "mm")


def check_mesh(path: Path, surfaces: Sequence[TubeSurface], chord: float) -> Iterator[Check]:
    """Check the part in an STL file, or the one built from a 3MF file, against the surfaces that bound it.

    Parameters
    ----------
    path : Path
        File written by `write_3mf` or `write_stl`.
    surfaces : sequence of TubeSurface
        Those of the body, or one chamber from `fill_chamber`.
    chord : float
        The requested chord error in mm.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    points = np.concatenate([surface.sample(*_samples(surface)).reshape(-1, 3) for surface in surfaces])
    yield from check_triangles(path, points, volume_inside(surfaces), chord)


def check_triangles(
    path: Path, points: NDArray[np.float64], volume: float, chord: float, part: str = ""
) -> Iterator[Check]:
    """Check the part in an STL file, or the one built from a 3MF file.

    Parameters
    ----------
    path : Path
        File written by `write_3mf` or `write_stl`.
    points : (n, 3) array
        Of the surfaces that bound the part, mm.
    volume : float
        Within these, mm³.
    chord : float
        The requested chord error in mm.
    part : str
        Name of the part in a 3MF file; by default its first one.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    name = path.name
    if path.suffix == ".stl":
        found = read_stl(path)
    else:
        parts = read_3mf(path)
        found = parts[part or next(iter(parts))]
    solid, of = manifold(found), f" of {part}" if part else ""
    closed = closure(name, found, solid)
    yield closed
    if not closed.passed:
        return
    yield Check(name, f"edges{of} that pass through triangles", crossings(found, solid), 0)
    yield Check(name, f"chord error{of}", float(distances(found, points).max()), chord, "mm")
    # Surfaces that differ by at most the chord error enclose volumes that differ by at most that times their area.
    yield Check(name, f"volume error{of}", abs(found.volume - volume), chord * solid.surface_area(), "mm³")


def crossings(part: Triangles, solid: manifold3d.Manifold) -> int:
    """Number of edges that pass through a triangle; if two triangles cross, an edge of one passes through the other."""
    edges = np.unique(np.sort(part.corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    points = part.points.tolist()
    # Hits at the ends of an edge are those of the triangles around its vertices.
    return sum(
        any(1e-9 < hit.distance < 1.0 - 1e-9 for hit in solid.ray_cast(points[start], points[stop]))
        for start, stop in edges.tolist()
    )


def shells_are(name: str, shape: TopoDS_Shape, solids: int, shells: int) -> Check:
    """Whether a shape from a file has so many solids, and so many shells, which are closed.

    Parameters
    ----------
    name : str
        Of the file.
    shape : TopoDS_Shape
    solids, shells : int
        How many there should be.
    """
    of_shape = list(map(TopoDS.Shell, parts_of(shape, TopAbs_ShapeEnum.TopAbs_SHELL)))
    wrong = abs(len(parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID)) - solids) + abs(len(of_shape) - shells)
    wrong += sum(not BRep_Tool.IsClosed_s(shell) for shell in of_shape)
    return Check(name, "open, missing or surplus shells", wrong, 0)


def volume_of(shape: TopoDS_Shape, accuracy: float) -> float:
    """The volume of a shape, mm³, to a relative accuracy."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties, accuracy)
    return float(properties.Mass())


def validity(name: str, shape: TopoDS_Shape) -> Check:
    """Whether OpenCASCADE finds a shape from a file valid."""
    return Check(name, "invalid shapes (BRepCheck)", int(not BRepCheck_Analyzer(shape).IsValid()), 0)


def manifold(part: Triangles) -> manifold3d.Manifold:
    """The triangles in manifold3d; empty if they are not closed."""
    return manifold3d.Manifold(manifold3d.Mesh64(part.points, part.corners.astype(np.uint64)))


def closure(name: str, part: Triangles, solid: manifold3d.Manifold) -> Check:
    """Whether triangles are closed and consistently oriented, and manifold3d accepts them."""
    wrong = _open_edges(part) or int(solid.status() != manifold3d.Error.NoError)
    return Check(name, "open or inconsistently oriented edges", wrong, 0)


def distances(part: Triangles, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances (n,) in mm of points (n, 3) from the nearest triangle."""
    return np.linalg.norm(nearest(boxes_of(part.points, part.corners), points).place - points, axis=1)


def _open_edges(part: Triangles) -> int:
    """Number of edges that triangles do not use exactly once in each direction."""
    ways = part.corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    one, other = np.sort(ways @ (len(part.points), 1)), np.sort(ways[:, ::-1] @ (len(part.points), 1))
    return int(len(np.setxor1d(one, other)) // 2 + len(one) - len(np.unique(one)))


def parts_of(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> list[TopoDS_Shape]:
    """All parts of a kind in a shape."""
    explorer, parts = TopExp_Explorer(shape, kind), []
    while explorer.More():
        parts.append(explorer.Current())
        explorer.Next()
    return parts


def _samples(surface: TubeSurface) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Parameters q and r of sample points, which include the knots."""
    counts = surface.basis_q.spans, surface.basis_r.spans
    q, r = (np.linspace(0.0, 1.0, _PER_SPAN * spans + 1) for spans in counts)
    return q, r


def _distance(shell: TopoDS_Shape, surface: TubeSurface) -> float:
    """Largest distance in mm of sample points of a surface, including its ends, from the faces of a shell.

    Each point is compared with the one at the same parameters, whose distance is an upper bound of the true one.
    """
    faces = [BRep_Tool.Surface_s(TopoDS.Face(each)) for each in parts_of(shell, TopAbs_ShapeEnum.TopAbs_FACE)]
    q, r = _samples(surface)
    points = surface.sample(q, r)
    nearest = np.full(points.shape[:2], np.inf)
    for face in faces:
        if not isinstance(face, Geom_BSplineSurface):
            continue
        q_start, q_stop, r_start, r_stop = face.Bounds()
        rows = np.flatnonzero((r >= r_start - 1e-12) & (r <= r_stop + 1e-12))
        columns = np.flatnonzero((q >= q_start - 1e-12) & (q <= q_stop + 1e-12))
        for row in rows:
            values = [face.Value(q[column], r[row]) for column in columns]
            away = np.array([(point.X(), point.Y(), point.Z()) for point in values]) - points[row, columns]
            nearest[row, columns] = np.minimum(nearest[row, columns], np.linalg.norm(away, axis=1))
    planes = [face.Pln() for face in faces if isinstance(face, Geom_Plane)]
    flat = [bool(tip) for tip, pole in enumerate(surface.poles) if not pole]
    discs = [point for tip in flat for s in (0.0, 0.5, 1.0) for point in cap_points(surface, tip, q, s).tolist()]
    ends = [min(plane.Distance(gp_Pnt(*point)) for plane in planes) for point in discs]
    return float(max([nearest.max(), *ends]))
