"""Local repair of a straight tetrahedral mesh: no element may have two faces on one smooth surface.

Once the surface nodes go from their chords to the curve, such faces meet at 180° and the element is singular along the edge
they share. Its opposite edge is taken out of the mesh (the ring of elements around it is filled anew) or, where no filling is
good, split by a vertex that is then moved into the solid. The surface triangulation and its symmetries stay as they are.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations, count

import numpy as np

from pneumorph.mesh.tets import TET_EDGES, TET_FACES

_GOOD = 0.15  # straight quality of a filling below which splitting is tried as well
_DEPTHS = np.linspace(0.0, 0.8, 17)  # how far a splitting vertex may go, in mean lengths of the edges around it

Corners = tuple[int, int, int, int]


def mend(
    points: np.ndarray, tets: np.ndarray, triangles: np.ndarray, sheets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rebuild the surroundings of flat elements.

    Parameters
    ----------
    points : (n, 3) float
    tets : (M, 4) int
        Straight, positively oriented.
    triangles : (nt, 3) int
        The surface triangles.
    sheets : (nt,) int
        The smooth piece of surface each of them lies on.

    Returns
    -------
    points : (n + added, 3) float
    tets : (M', 4) int
    """
    places = list(points)
    surface = {frozenset(corners): sheet for corners, sheet in zip(triangles.tolist(), sheets.tolist(), strict=True)}
    elements: dict[int, Corners] = dict(enumerate(map(tuple, tets.tolist())))
    numbers = count(len(tets))
    around = defaultdict(set)
    for number, corners in elements.items():
        for corner in corners:
            around[corner].add(number)

    for a, b, c, d in flat_elements(tets, triangles, sheets).tolist():
        ring = sorted(around[c] & around[d])
        if not around[a].intersection(around[b], ring):
            continue  # an earlier repair has taken it away
        loop = _loop([elements[k] for k in ring], c, d)
        if loop is None:
            continue
        quality, filling = _without_edge(places, loop, c, d, surface)
        if quality < _GOOD:
            split_quality, split, place = _split_edge(places, loop, (a, b, c, d))
            if split_quality > quality:
                filling = split
                places.append(place)
        for k in ring:
            for corner in elements.pop(k):
                around[corner].discard(k)
        for corners in filling:
            k = next(numbers)
            elements[k] = corners
            for corner in corners:
                around[corner].add(k)
    return np.array(places), np.array(list(elements.values()))


def flat_elements(tets: np.ndarray, triangles: np.ndarray, sheets: np.ndarray) -> np.ndarray:
    """Corners (a, b, c, d), (n, 4), of the elements whose faces abc and abd lie on one sheet."""
    n = int(tets.max()) + 1

    def key(faces: np.ndarray) -> np.ndarray:
        a, b, c = np.sort(faces.reshape(-1, 3), axis=1).T
        return (a * n + b) * n + c

    surface = key(triangles)
    order = np.argsort(surface)
    faces = key(tets[:, TET_FACES])
    at = order[np.minimum(np.searchsorted(surface[order], faces), len(order) - 1)]
    sheet = np.where(surface[at] == faces, sheets[at], -1).reshape(-1, 4)
    opposite = [({0, 1, 2, 3} - set(face)).pop() for face in TET_FACES.tolist()]
    flat = []
    for i, j in TET_EDGES:
        both = (sheet[:, i] >= 0) & (sheet[:, i] == sheet[:, j])
        c, d = opposite[j], opposite[i]
        a, b = {0, 1, 2, 3} - {c, d}
        flat.append(tets[both][:, [a, b, c, d]])
    return np.concatenate(flat)


def straight_quality(corners: np.ndarray) -> np.ndarray:
    """Quality of straight tetrahedra with corners (..., 4, 3): that of `quality.scaled_jacobian`."""
    sides = corners[..., 1:, :] - corners[..., :1, :]
    all_sides = corners[..., TET_EDGES[:, 1], :] - corners[..., TET_EDGES[:, 0], :]
    return np.sqrt(2) * np.linalg.det(sides) / ((all_sides**2).sum((-1, -2)) / 6) ** 1.5


def _loop(ring: list[Corners], c: int, d: int) -> list[int] | None:
    """The vertices around the edge cd, anticlockwise seen from d; None if the edge lies on the surface."""
    following = {}
    for corners in ring:
        at_c, at_d = corners.index(c), corners.index(d)
        x, y = (k for k in range(4) if k not in (at_c, at_d))
        if _odd((at_c, at_d, x, y)):
            x, y = y, x
        following[corners[x]] = corners[y]
    loop = [next(iter(following))]
    while (step := following.get(loop[-1])) is not None and step != loop[0]:
        loop.append(step)
    return loop if step == loop[0] and len(loop) == len(ring) else None


def _odd(permutation: tuple[int, ...]) -> bool:
    return sum(i > j for i, j in combinations(permutation, 2)) % 2 == 1


def _without_edge(
    places: list[np.ndarray], loop: list[int], c: int, d: int, surface: dict[frozenset[int], int]
) -> tuple[float, list[Corners]]:
    """The best filling of the ring without its edge cd, and the quality of its worst element (-1: there is none)."""
    chosen = list(combinations(range(len(loop)), 3))
    pairs = [
        ((loop[i], loop[j], loop[k], d), (loop[i], loop[k], loop[j], c)) for i, j, k in chosen
    ]
    quality = straight_quality(_corners(places, pairs)).min(axis=1)
    value = {
        triple: -1.0 if any(_is_flat(corners, surface) for corners in pair) else q
        for triple, pair, q in zip(chosen, pairs, quality.tolist(), strict=True)
    }
    # Best triangulation of the loop's polygon from i to k, by the apex j of the triangle on the side ik.
    best: dict[tuple[int, int], tuple[float, int]] = {}
    for span in range(1, len(loop)):
        for i in range(len(loop) - span):
            k = i + span
            options = (
                (min(value[i, j, k], best[i, j][0], best[j, k][0]), j) for j in range(i + 1, k)
            )
            best[i, k] = max(options, default=(1.0, -1))

    def filled(i: int, k: int) -> list[Corners]:
        if k == i + 1:
            return []
        j = best[i, k][1]
        return [*pairs[chosen.index((i, j, k))], *filled(i, j), *filled(j, k)]

    return best[0, len(loop) - 1][0], filled(0, len(loop) - 1)


def _split_edge(
    places: list[np.ndarray], loop: list[int], corners: Corners
) -> tuple[float, list[Corners], np.ndarray]:
    """Split the edge cd of the ring at a vertex moved away from ab, into the solid, to where its worst element is best."""
    a, b, c, d = (places[k] for k in corners)
    inward = np.cross(d - c, b - a)
    inward *= np.sign(inward @ (c + d - a - b)) / np.linalg.norm(inward)
    reach = np.mean([np.linalg.norm(places[k] - (c + d) / 2) for k in loop])
    trials = (c + d) / 2 + _DEPTHS[:, None] * reach * inward
    m, around = len(places), list(zip(loop, [*loop[1:], loop[0]], strict=True))
    split = [(corners[2], m, x, y) for x, y in around] + [(m, corners[3], x, y) for x, y in around]
    quality = [straight_quality(_corners([*places, trial], split)).min() for trial in trials]
    best = int(np.argmax(quality))
    return float(quality[best]), split, trials[best]


def _corners(places: list[np.ndarray], numbers: list) -> np.ndarray:
    numbers = np.array(numbers)
    return np.array([places[k] for k in numbers.ravel()]).reshape(*numbers.shape, 3)


def _is_flat(corners: Corners, surface: dict[frozenset[int], int]) -> bool:
    """Whether two faces lie on one sheet."""
    sheets = [sheet for face in combinations(corners, 3) if (sheet := surface.get(frozenset(face))) is not None]
    return len(sheets) != len(set(sheets))
