"""The planes across a body where another rubber begins: six-node triangles between the rings of its surfaces.

Of half or a quarter of a body they are bounded by straight edges in mirror planes too, which the faces there have in
common with them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.geometry.tube.level import Level
from pneumorph.mesh.cut import IN_PLANE, filled, line, open_edges
from pneumorph.mesh.tets import TURNED
from pneumorph.problem.regions import REST
from pneumorph.symmetry.operations import NORMALS


def with_sections(
    solids: dict[str, np.ndarray], nodes: np.ndarray, levels: Sequence[Level], mirrors: tuple[str, ...], size: float
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Cut what is of the body's own rubber at planes, into the regions that begin there.

    Parameters
    ----------
    solids : dict of (n, 6) int
        Triangles that bound each region, normals outwards; open in mirror planes. No triangle crosses a plane.
    nodes : (n, 3) float
    levels : sequence of Level, from the lowest to the highest
    mirrors : tuple of "xz" and "yz"
    size : float
        Desired edge length away from the surfaces, mm.

    Returns
    -------
    solids : dict of (n, 6) int
        With a region for each plane, which reaches to the next one.
    nodes : (n + added, 3) float
        The given ones first; those of rings are moved into the planes exactly.

    Raises
    ------
    MeshError
        If rings cross.
    """
    if not levels:
        return solids, nodes
    nodes = nodes.copy()
    others = {name: triangles for name, triangles in solids.items() if name not in ("", REST)}
    name, rest = REST, solids.get(REST, solids.get(""))
    assert rest is not None, "a body has a rubber of its own"
    parts = {REST: rest} | others
    for level in levels:
        above = nodes[rest[:, :3], 2].mean(axis=1) > level.height
        section, nodes = _section(rest[above], nodes, level.height, mirrors, size)
        parts[name] = np.concatenate([rest[~above], section[:, TURNED]])
        name, rest = level.region, np.concatenate([rest[above], section])
        parts[name] = rest
    return parts, nodes


def _section(
    above: np.ndarray, nodes: np.ndarray, height: float, mirrors: tuple[str, ...], size: float
) -> tuple[np.ndarray, np.ndarray]:
    """The triangles (nf, 6) that close what is above a plane, seen from below, and all nodes with those added."""
    edges = open_edges({"": above})
    rim = edges[(np.abs(nodes[edges][..., 2] - height) < IN_PLANE).all(axis=1)]
    nodes[np.unique(rim), 2] = height
    straight, nodes = _in_mirrors(rim, nodes, height, mirrors, size)
    return filled(np.concatenate([rim, *straight]), nodes, 2, size)


def _in_mirrors(
    rim: np.ndarray, nodes: np.ndarray, height: float, mirrors: tuple[str, ...], size: float
) -> tuple[list[np.ndarray], np.ndarray]:
    """Edges (n, 3) in each mirror plane between the ends of the rim, and all nodes with those added."""
    corners, count = np.unique(rim[:, :2], return_counts=True)
    ends = corners[count == 1]
    if not len(ends):
        return [], nodes
    nearest = np.abs(nodes[ends][:, [NORMALS[plane] for plane in mirrors]]).argmin(axis=1)
    own = [ends[nearest == number] for number in range(len(mirrors))]
    if len(own[0]) % 2:
        # The axis is in the solid: both lines of a quarter begin there.
        own = [np.append(each, len(nodes)) for each in own]
        nodes = np.concatenate([nodes, [[0.0, 0.0, height]]])
    in_planes = []
    for plane, each in zip(mirrors, own, strict=True):
        nodes[each, NORMALS[plane]] = 0.0
        edges, nodes = line(each, nodes, size, 1 - NORMALS[plane])
        # Seen from below, the solid is to the left going along x backwards and along y forwards.
        in_planes.append(edges[:, [1, 0, 2]] if plane == "xz" else edges)
    return in_planes, nodes
