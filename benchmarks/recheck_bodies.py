"""Check all limits on the shape of every design of a body from a CAD file independently of its certificates.

    python benchmarks/recheck_bodies.py RUN

Of the package are the faces in six-node triangles, the boxes of the lattices with their control points, and an STL
file of every design; all else is computed here. The wall is the least distance of the triangles of two closed
surfaces of the STL file, and the envelope is that of its points. Both may differ from the exact surfaces by the chord
error of the file, which is verified by samples of these, displaced by splines from the Cox–de Boor recurrence. Folds
are the distances of samples that are no neighbours in the file, about 1 % too large. Scalings are the singular values
of the map's gradient at the samples, where its determinant must be positive. Reach into obstacles is that of samples,
into the room that samples of the body at the start leave. Bodies with ports are not covered.

The exit status is 1 if a value is worse than in the history, which has certified ones, 2 if RUN cannot be read.
"""

import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path

import numpy as np
from recheck import pieces
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from pneumorph.errors import PneumorphError
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.starting import body_of
from pneumorph.make.faces.triangles import triangulated
from pneumorph.make.printing import write_stl
from pneumorph.make.triangles import Triangles
from pneumorph.problem import Limits
from pneumorph.problem.contact import ObstacleSpec
from pneumorph.run import open_run

CHORD = 0.02  # mm
SPACING = 0.35  # of samples, mm
LONGEST = 1.5  # edges of triangles between which distances are measured, mm
FAR = 1.2  # folds wider than this are not measured, relative to the limit
SINGLE = 1e-5  # rounding of coordinates in STL files, mm
ROUNDING = 1e-6  # of values in histories, relative
SIGN = {"wall_mm": 1.0, "fold_mm": 1.0, "scaling_least": 1.0, "scaling_largest": -1.0, "envelope_mm": -1.0}
SIGN["obstacles_mm"] = -1.0
AT_ONCE = 200_000


# --- surfaces as they are in the file and as they are displaced -------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a surface: in the file, displaced, the gradients of the map, and the six-node triangle of each."""

    file: np.ndarray
    now: np.ndarray
    gradients: np.ndarray
    patch: np.ndarray
    patches: np.ndarray

    @cached_property
    def beside(self) -> sparse.csr_array:
        """Which six-node triangles have a corner in common."""
        count = len(self.patches)
        at = sparse.csr_array((np.ones(3 * count), (np.repeat(np.arange(count), 3), self.patches[:, :3].ravel())))
        return sparse.csr_array(at @ at.T)


def sampled(surface: LatticeSurface) -> Samples:
    """Samples no farther apart than `SPACING` along the edges of every six-node triangle."""
    nodes = surface.outline[surface.patches]
    edges = np.linalg.norm(nodes[:, :3] - np.roll(nodes[:, :3], -1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(np.ceil(edges / SPACING).astype(int), 2)
    file, patch = [], []
    for count in np.unique(parts):
        some = np.flatnonzero(parts == count)
        a, b = (each.ravel() / count for each in np.meshgrid(np.arange(count + 1), np.arange(count + 1)))
        a, b = a[a + b <= 1 + 1e-9], b[a + b <= 1 + 1e-9]
        c = 1.0 - a - b
        shape = np.stack([c * (2 * c - 1), a * (2 * a - 1), b * (2 * b - 1), 4 * c * a, 4 * a * b, 4 * b * c])
        file.append(np.einsum("fq,pfd->pqd", shape, nodes[some]).reshape(-1, 3))
        patch.append(np.repeat(some, len(a)))
    places = np.concatenate(file)
    return Samples(places, *displaced(surface, places), np.concatenate(patch), surface.patches)


def displaced(surface: LatticeSurface, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where places (n, 3) in the file are, and the gradients (n, 3, 3) of that, by the control points of a lattice."""
    lattice = surface.lattice
    spans = np.array(lattice.spans)
    net = surface.net.reshape(*(spans + 3), 3)
    first, values, slopes = [], [], []
    for axis in range(3):
        width = lattice.upper[axis] - lattice.lower[axis]
        t = np.clip((places[:, axis] - lattice.lower[axis]) / width, 0.0, 1.0) * spans[axis]
        cell = np.minimum(t.astype(int), spans[axis] - 1)
        own, s = pieces(np.arange(-3, spans[axis] + 4) / spans[axis])[cell], t - cell
        powers = s[:, None] ** np.arange(4)
        raised = np.column_stack([np.zeros_like(s), np.ones_like(s), 2 * s, 3 * s**2])
        first.append(cell)
        values.append(np.einsum("nfp,np->nf", own, powers))
        slopes.append(np.einsum("nfp,np->nf", own, raised) * spans[axis] / width)
    found, gradients = np.empty_like(places), np.empty((len(places), 3, 3))
    for k in range(0, len(places), AT_ONCE):
        some = slice(k, k + AT_ONCE)
        i, j, l = (cell[some, None] + np.arange(4) for cell in first)  # noqa: E741
        near = net[i[:, :, None, None], j[:, None, :, None], l[:, None, None, :]]
        x, y, z = (each[some] for each in values)
        found[some] = np.einsum("ni,nj,nl,nijlc->nc", x, y, z, near, optimize=True)
        for axis in range(3):
            by = [slopes[m][some] if m == axis else values[m][some] for m in range(3)]
            gradients[some, :, axis] = np.einsum("ni,nj,nl,nijlc->nc", *by, near, optimize=True)
    return found, gradients


# --- triangles of the STL file ----------------------------------------------------------------------------------------


def closed_surfaces(body: Body, chord: float) -> list[np.ndarray]:
    """Corners (n, 3, 3) of the triangles of every closed surface in the STL file of a body, the largest one first."""
    parts = triangulated(body.surfaces, chord)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "design.stl"
        write_stl(path, Triangles(parts[0].points, np.concatenate([each.corners for each in parts])))
        data = path.read_bytes()
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(data, record, offset=84)["corners"].astype(float)
    _, number = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    number = number.reshape(-1, 3)
    edges = np.concatenate([number[:, [k, (k + 1) % 3]] for k in range(3)])
    directed = set(map(tuple, edges.tolist()))
    if len(directed) < len(edges) or any((b, a) not in directed for a, b in directed):
        raise ValueError("the STL file is not closed")
    count, part = connected_components(sparse.coo_array((np.ones(len(edges)), tuple(edges.T)), (number.max() + 1,) * 2))
    found = [corners[part[number[:, 0]] == each] for each in range(count)]
    return sorted(found, key=lambda each: -abs(np.linalg.det(each).sum()))


def divided(corners: np.ndarray) -> np.ndarray:
    """Triangles (n, 3, 3) with the longest edge halved until none is longer than `LONGEST`."""
    done = []
    while len(corners):
        lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        longest = lengths.argmax(axis=1)
        long = lengths.max(axis=1) > LONGEST
        done.append(corners[~long])
        turned = np.take_along_axis(corners, (longest[:, None, None] + np.arange(3)[:, None]) % 3, axis=1)[long]
        a, b, c = np.moveaxis(turned, 1, 0)
        corners = np.concatenate([np.stack([a, (a + b) / 2, c], axis=1), np.stack([(a + b) / 2, b, c], axis=1)])
    return np.concatenate(done)


def from_points(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Distances (n,) of points (n, 3) from triangles (n, 3, 3): from the inside if that is where they project to."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(area, 1e-300)[:, None]
    inside = area > 1e-12
    for one, other in ((a, b), (b, c), (c, a)):
        inside &= np.einsum("nd,nd->n", np.cross(other - one, points - one), unit) >= 0.0
    found = np.min([segments(points, points, one, other) for one, other in ((a, b), (b, c), (c, a))], axis=0)
    return np.where(inside, np.minimum(found, np.abs(np.einsum("nd,nd->n", points - a, unit))), found)


def segments(p: np.ndarray, q: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Distances (n,) of segments pq and rs: from the inside of both, or from one of the four ends."""
    d, e, w = q - p, s - r, p - r
    dd, ee, de = (np.einsum("nd,nd->n", *pair) for pair in ((d, d), (e, e), (d, e)))
    dw, ew = np.einsum("nd,nd->n", d, w), np.einsum("nd,nd->n", e, w)
    tiny = 1e-300
    found = np.full(len(p), np.inf)
    whole = dd * ee - de**2
    t = np.clip((de * ew - ee * dw) / np.where(whole > 1e-12 * dd * ee, whole, np.inf), 0.0, 1.0)
    for start in (t, np.zeros_like(t), np.ones_like(t)):
        u = np.clip((ew + start * de) / np.maximum(ee, tiny), 0.0, 1.0)
        again = np.clip((u * de - dw) / np.maximum(dd, tiny), 0.0, 1.0)
        for v in (start, again):
            found = np.minimum(found, np.linalg.norm(w + v[:, None] * d - u[:, None] * e, axis=1))
    return found


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """The least distance of two sets of triangles that do not cross."""
    here, there = one.mean(axis=1), other.mean(axis=1)
    least = float(KDTree(other.reshape(-1, 3)).query(one.reshape(-1, 3))[0].min())
    sizes = [np.linalg.norm(each - each.mean(axis=1)[:, None], axis=2).max(axis=1) for each in (one, other)]
    found = KDTree(there).query_ball_point(here, least + sizes[0] + sizes[1].max())
    i = np.repeat(np.arange(len(one)), [len(each) for each in found])
    j = np.concatenate([np.asarray(each, int) for each in found])
    some = np.linalg.norm(here[i] - there[j], axis=1) <= least + sizes[0][i] + sizes[1][j]
    i, j = i[some], j[some]
    for k in range(0, len(i), AT_ONCE):
        a, b = one[i[k : k + AT_ONCE]], other[j[k : k + AT_ONCE]]
        least = min(
            least,
            *(float(from_points(a[:, v], b).min()) for v in range(3)),
            *(float(from_points(b[:, v], a).min()) for v in range(3)),
            *(
                float(segments(a[:, v], a[:, (v + 1) % 3], b[:, w], b[:, (w + 1) % 3]).min())
                for v in range(3)
                for w in range(3)
            ),
        )
    return least


def off(points: np.ndarray, triangles: np.ndarray) -> float:
    """The largest distance of points from triangles, each from the nearest of those around the nearest centroids."""
    near = KDTree(triangles.mean(axis=1)).query(points, k=min(12, len(triangles)))[1]
    distance = np.full(len(points), np.inf)
    for k in range(near.shape[1]):
        distance = np.minimum(distance, from_points(points, triangles[near[:, k]]))
    return float(distance.max())


# --- limits -----------------------------------------------------------------------------------------------------------


def folds(samples: Samples, neighbourhood: float, reach: float) -> float:
    """The least distance below `reach` of samples that are no neighbours in the file; infinite if there is none."""
    least, known = reach, {}
    tree = KDTree(samples.now)
    for k in range(0, len(samples.now), 20_000):
        here = np.arange(k, min(k + 20_000, len(samples.now)))
        found = KDTree(samples.now[here]).sparse_distance_matrix(tree, least, output_type="coo_matrix")
        i, j, distance = here[found.row], found.col, found.data
        far = np.linalg.norm(samples.file[i] - samples.file[j], axis=1) >= neighbourhood
        least = min(least, float(distance[far].min(initial=np.inf)))
        # Others count where the way along the surface is long, as across a slot.
        i, j, distance = (part[~far & (distance < least)] for part in (i, j, distance))
        count = len(samples.patches)
        pairs, which = np.unique(samples.patch[i] * count + samples.patch[j], return_inverse=True)
        across = [pair % count not in _reached(samples, pair // count, neighbourhood, known) for pair in pairs.tolist()]
        least = min(least, float(distance[np.array(across, bool)[which]].min(initial=np.inf)))
    return least if least < reach else np.inf


def _reached(samples: Samples, a: int, neighbourhood: float, known: dict[int, set[int]]) -> set[int]:
    """The triangles that are reached from one by triangles no farther from it in the file than the neighbourhood."""
    if a not in known:
        own = samples.file[samples.patch == a]
        box = np.stack([own.min(axis=0), own.max(axis=0)]) + (neighbourhood + SPACING) * np.array([[-1.0], [1.0]])
        some = np.flatnonzero(((samples.file >= box[0]) & (samples.file <= box[1])).all(axis=1))
        close = KDTree(own).query(samples.file[some])[0] <= neighbourhood + SPACING
        near = set(samples.patch[some[close]].tolist())
        known[a], front = {a}, [a]
        while front:
            b = front.pop()
            beside = samples.beside.indices[samples.beside.indptr[b] : samples.beside.indptr[b + 1]]
            new = near.intersection(beside.tolist()) - known[a]
            known[a] |= new
            front += new
    return known[a]


def envelope(limits: Limits, points: np.ndarray) -> float | None:
    """How far points are beyond the envelope, mm; of a cylinder alone their distance from its axis."""
    asked = limits.envelope
    if asked is None:
        return None
    radial = float(np.hypot(points[:, 0], points[:, 1]).max())
    beyond = [float((points @ np.array(each.normal) - np.dot(each.point, each.normal)).max())
              for each in asked.half_space]  # fmt: skip
    if asked.box is not None:
        lower, upper = np.sort(np.array(asked.box), axis=0)
        beyond += [float((points - upper).max()), float((lower - points).max())]
    if asked.radius is not None and not beyond:
        return radial
    return max(beyond + ([] if asked.radius is None else [radial - asked.radius]))


def beside(obstacle: ObstacleSpec, points: np.ndarray) -> np.ndarray:
    """Distances (n,) of points (n, 3) from an obstacle in its place, mm; negative within it."""
    if obstacle.kind == "plane":
        return (points - np.array(obstacle.point)) @ np.array(obstacle.normal)
    if obstacle.kind == "mesh":
        corners, triangles = obstacle.surface
        placed = Rotation.from_rotvec(obstacle.rotation).apply(obstacle.scale * corners) + np.array(obstacle.position)
        return _beside_triangles(placed[triangles], points)
    away = points - np.array(obstacle.center)
    if obstacle.kind == "sphere":
        return np.linalg.norm(away, axis=1) - obstacle.radius
    if obstacle.kind == "box":
        beyond = np.abs(away) - np.array(obstacle.size) / 2.0
    else:
        along = away @ np.array(obstacle.axis)
        radial = np.linalg.norm(away - along[:, None] * np.array(obstacle.axis), axis=1)
        beyond = np.column_stack([radial - obstacle.radius, np.abs(along) - obstacle.length / 2.0])
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)


def _beside_triangles(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The same for a closed surface, within which its triangles fill the whole sphere of directions."""
    found = np.empty(len(points))
    for k in range(0, len(points), 2000):
        some = points[k : k + 2000]
        distance, angle = np.full(len(some), np.inf), np.zeros(len(some))
        for triangle in triangles:
            distance = np.minimum(distance, from_points(some, np.broadcast_to(triangle, (len(some), 3, 3))))
            # The solid angle of a triangle by Van Oosterom and Strackee (1983).
            a, b, c = np.moveaxis(triangle - some[:, None], 1, 0)
            la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
            ab, bc, ca = (np.einsum("nd,nd->n", *pair) for pair in ((a, b), (b, c), (c, a)))
            volume = np.einsum("nd,nd->n", a, np.cross(b, c))
            angle += 2.0 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
        found[k : k + 2000] = np.where(np.abs(angle) > 2.0 * np.pi, -distance, distance)
    return found


def reach(start: np.ndarray, now: np.ndarray, obstacles: Iterable[ObstacleSpec], contact: float) -> float | None:
    """How far points are within half of the contact distance, or of the gap at the start, from an obstacle, mm."""
    found = []
    for each in obstacles:
        room = 0.5 * min(contact, max(float(beside(each, start).min()), 0.0))
        found.append(room - float(beside(each, now).min()))
    return max(found, default=None)


def measured(body: Body, limits: Limits, chord: float = CHORD) -> dict[str, float | None]:
    """The values of the limits of a body alone, the least determinant, and how far samples are from the STL file."""
    samples = [sampled(surface) for surface in body.surfaces]
    surfaces = closed_surfaces(body, chord)
    if len(surfaces) != len(samples):
        raise ValueError(f"the STL file has {len(surfaces)} closed surfaces, not {len(samples)}")
    fine = [divided(each) for each in surfaces]
    everything = np.concatenate(fine)
    gradients = np.concatenate([each.gradients for each in samples])
    values = np.linalg.svd(gradients, compute_uv=False)
    reach = FAR * limits.fold.distance
    return {
        "wall_mm": min(apart(one, other) for one, other in combinations(fine, 2)),
        "fold_mm": min(folds(each, limits.fold.neighbourhood, reach) for each in samples),
        "scaling_least": float(values[:, 2].min()),
        "scaling_largest": float(values[:, 0].max()),
        "envelope_mm": envelope(limits, surfaces[0].reshape(-1, 3)),
        "determinant": float(np.linalg.det(gradients).min()),
        "off": off(np.concatenate([each.now for each in samples]), everything),
    }


def worse(found: dict[str, float | None], claimed: dict[str, float | None], chord: float = CHORD) -> Iterator[str]:
    """What of a design is worse than in the history."""
    deviation = chord + SINGLE
    slack = {"wall_mm": 2.0 * deviation, "envelope_mm": deviation, "obstacles_mm": deviation}
    for key, sign in SIGN.items():
        claim, value = claimed.get(key), found.get(key)
        if claim is None or value is None:
            continue
        if (claim - value) * sign > slack.get(key, 0.0) + ROUNDING * abs(claim):
            yield key
    if not found["determinant"] > 0.0:
        yield "determinant"
    if not found["off"] <= deviation:
        yield "STL file"


def main(folder: Path) -> int:
    try:
        stored = open_run(folder)
        problem, entries = stored.problem, stored.history()
    except (PneumorphError, OSError) as error:
        print(f"{folder}: cannot be read as a run directory ({error})", file=sys.stderr)
        return 2
    if problem.solid is None or any(each.port for each in problem.body.chamber):
        print(f"{folder}: its body is not from a file, or has ports; see recheck.py for tubes", file=sys.stderr)
        return 2
    print(f"{folder}: measured value (value in the history)")
    print("design", *(f"{key:>22s}" for key in SIGN), "  least determinant")
    bad = 0
    start = np.concatenate([sampled(surface).now for surface in body_of(problem).surfaces])
    for entry in entries:
        body = stored.load_design(entry.iteration).body(problem)
        found = measured(body, problem.limits)
        now = np.concatenate([sampled(surface).now for surface in body.surfaces])
        found["obstacles_mm"] = reach(start, now, problem.obstacle, problem.contact_distance)
        claimed = {key: entry.limits.get(key) for key in SIGN}
        wrong = list(worse(found, claimed))
        bad += bool(wrong)
        cells = [f"{_shown(found[key]):>10s} ({_shown(claimed[key]):>8s}) " for key in SIGN]
        print(
            f"{entry.iteration:6d} " + " ".join(cells) + f" {found['determinant']:10.4f}",
            f" worse than reported: {', '.join(wrong)}" if wrong else "",
            flush=True,
        )
    print(f"{len(entries)} designs, {bad} of them worse than in the history")
    return int(bad > 0)


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.4f}"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
