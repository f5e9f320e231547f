"""Check independently that no deformed body of a run goes through itself or an obstacle, without using the package.

    python benchmarks/interpenetration.py RUN

For every design whose fields are stored and every task, the curved faces are divided into 16 flat triangles each.
Triangles without a common corner that intersect are counted (Möller and Trumbore 1997, edges of one through the other).
For obstacles there are the least distance of the triangles' corners, and the number of points on the obstacle that are
inside the body, by solid angles (Van Oosterom and Strackee 1983).

The exit status is 1 if anything interpenetrates, 2 if RUN cannot be read.
"""

import base64
import re
import sys
import tomllib
import zlib
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1e3, "µm": 1e-3, "um": 1e-3}
ANGLES = {"deg": np.pi / 180.0, "°": np.pi / 180.0, "rad": 1.0}
PARTS = 4
POINTS = 400
"""Divisions of an edge of a face; points on an obstacle, roughly."""
AT_ONCE = 4_000_000


def mm(text: str) -> float:
    """The value of "2 mm" in mm."""
    number, unit = re.fullmatch(r"\s*([-+0-9.eE]+)\s*(\S+)\s*", text).groups()
    return float(number) * UNITS[unit]


def place(texts: list[str]) -> np.ndarray:
    return np.array([mm(text) for text in texts])


def divided(x: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the flat triangles into which six-node faces are divided, (n, 3) once each, and triangles (T, 3)."""
    grid = [(i, j) for i in range(PARTS + 1) for j in range(PARTS + 1 - i)]
    number = {at: k for k, at in enumerate(grid)}
    b, c = np.array(grid).T / PARTS
    a = 1.0 - b - c
    shape = np.column_stack([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a])
    local = [[number[i, j], number[i + 1, j], number[i, j + 1]] for i, j in grid if i + j < PARTS]
    local += [[number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]] for i, j in grid if i + j < PARTS - 1]
    points = np.einsum("ka,fai->fki", shape, x[faces])
    triangles = (len(grid) * np.arange(len(faces))[:, None, None] + np.array(local)).reshape(-1, 3)
    # Corners that faces share are one: they are at the same place at rest and deformed.
    scale = 1e-7 * np.ptp(x, axis=0).max()
    _, first, same = np.unique(np.rint(points.reshape(-1, 3) / scale), axis=0, return_index=True, return_inverse=True)
    return points.reshape(-1, 3)[first], same.ravel()[triangles]


def near_pairs(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Pairs (P, 2) of boxes that overlap, found in a grid of cubes."""
    size = (high - low).max()
    first, last = np.floor(low / size).astype(np.int64), np.floor(high / size).astype(np.int64)
    cells, owners = [], []
    for step in np.ndindex(2, 2, 2):
        cell = first + step
        inside = (cell <= last).all(axis=1)
        cells.append(cell[inside])
        owners.append(np.flatnonzero(inside))
    cell, owner = np.concatenate(cells), np.concatenate(owners)
    _, cell = np.unique(cell, axis=0, return_inverse=True)
    order = np.argsort(cell.ravel(), kind="stable")
    groups = np.split(owner[order], np.flatnonzero(np.diff(cell.ravel()[order])) + 1)
    found = [np.array(list(combinations(group, 2))) for group in groups if len(group) > 1]
    pairs = np.unique(np.sort(np.concatenate([np.zeros((0, 2), int), *found]), axis=1), axis=0)
    one, other = pairs.T
    return pairs[((low[one] <= high[other]) & (low[other] <= high[one])).all(axis=1)]


def crossing(points: np.ndarray, triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Which pairs of triangles (P, 2) intersect; neighbours, with a common corner, do not count."""
    one, other = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    apart = ~(one[:, :, None] == other[:, None, :]).any(axis=(1, 2))
    hit = np.zeros(len(pairs), bool)
    for edges, faces in ((one, other), (other, one)):
        a, b, c = np.moveaxis(points[faces], 1, 0)
        for i, j in ((0, 1), (1, 2), (2, 0)):
            start, along = points[edges[:, i]], points[edges[:, j]] - points[edges[:, i]]
            h = np.cross(along, c - a)
            with np.errstate(all="ignore"):
                det = np.einsum("ti,ti->t", b - a, h)
                u = np.einsum("ti,ti->t", start - a, h) / det
                q = np.cross(start - a, b - a)
                v = np.einsum("ti,ti->t", q, along) / det
                t = np.einsum("ti,ti->t", c - a, q) / det
                hit |= (u > 0) & (v > 0) & (u + v < 1) & (t > 0) & (t < 1)
    return hit & apart


def winding(at: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """How often the closed surface goes around each point (n,): 1 inside, 0 outside."""
    found = []
    for part in np.array_split(at, max(1, len(at) * len(triangles) // AT_ONCE)):
        a, b, c = (points[triangles[:, k]] - part[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(each, axis=-1) for each in (a, b, c))
        above = np.einsum("pti,pti->pt", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("pti,pti->pt", *each) for each in ((a, b), (b, c), (c, a)))
        found.append(np.arctan2(above, la * lb * lc + ab * lc + bc * la + ca * lb).sum(axis=1) / (2 * np.pi))
    return np.concatenate(found)


def sphere_of_directions() -> np.ndarray:
    height = 1.0 - (2.0 * np.arange(POINTS) + 1.0) / POINTS
    angle, away = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(POINTS), np.sqrt(1.0 - height**2)
    return np.column_stack([away * np.cos(angle), away * np.sin(angle), height])


def obstacle(table: dict, moved: np.ndarray):
    """A function for the distances (n,) of places, and points (k, 3) on the surface, none on a plane."""
    around = sphere_of_directions()
    if table["kind"] == "plane":
        normal = np.array(table["normal"], float) / np.linalg.norm(table["normal"])
        point = place(table["point"]) + moved
        return lambda x: (x - point) @ normal, np.zeros((0, 3))
    if table["kind"] == "mesh":
        points, triangles = surface(table)
        points = points + moved
        return partial(distance_from, points, triangles), np.concatenate([points, points[triangles].mean(axis=1)])
    center = place(table["center"]) + moved
    if table["kind"] == "sphere":
        radius = mm(table["radius"])
        return lambda x: np.linalg.norm(x - center, axis=1) - radius, center + radius * around
    if table["kind"] == "cylinder":
        axis = np.array(table["axis"], float) / np.linalg.norm(table["axis"])
        radius, half = mm(table["radius"]), mm(table["length"]) / 2

        def beyond(x: np.ndarray) -> np.ndarray:
            along = (x - center) @ axis
            away = np.linalg.norm(x - center - along[:, None] * axis, axis=1)
            return np.column_stack([away - radius, np.abs(along) - half])
    else:
        size = place(table["size"]) / 2

        def beyond(x: np.ndarray) -> np.ndarray:
            return np.abs(x - center) - size

    def distance(x: np.ndarray) -> np.ndarray:
        past = beyond(x)
        return np.linalg.norm(np.maximum(past, 0.0), axis=1) + np.minimum(past.max(axis=1), 0.0)

    # The point on the surface in each direction, by bisection along the ray.
    low, high = np.zeros(len(around)), np.full(len(around), 1e4)
    for _ in range(80):
        middle = 0.5 * (low + high)
        inside = distance(center + middle[:, None] * around) < 0.0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return distance, center + low[:, None] * around


def surface(table: dict) -> tuple[np.ndarray, np.ndarray]:
    """Points (V, 3) and triangles (T, 3) of a body from a file, as they are stored: numbers of both, then both."""
    data = zlib.decompress(base64.b64decode(table["triangles"]))
    vertices, count = np.frombuffer(data, "<u4", 2)
    points = table["scale"] * np.frombuffer(data, "<f4", 3 * vertices, 8).reshape(-1, 3).astype(float)
    triangles = np.frombuffer(data, "<u4", 3 * count, 8 + 12 * vertices).reshape(-1, 3).astype(int)
    turn = np.array([float(text.split()[0]) * ANGLES[text.split()[1]] for text in table["rotation"]])
    angle = np.linalg.norm(turn)
    axis = turn / angle if angle else turn
    along = (points @ axis)[:, None] * axis
    turned = np.cos(angle) * (points - along) + np.sin(angle) * np.cross(axis, points) + along
    return turned + place(table["position"]), triangles


def distance_from(points: np.ndarray, triangles: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Distances of places x (n, 3) from a surface of triangles, negative inside; of its box where they are beside."""
    low, high = points.min(axis=0), points.max(axis=0)
    found = np.linalg.norm(np.maximum(0.0, np.maximum(low - x, x - high)), axis=1)
    near = np.flatnonzero(found <= 1.0)
    corners = points[triangles]
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for chunk in np.array_split(near, len(near) * len(triangles) // AT_ONCE + 1):
        away = x[chunk, None] - a
        inside, least = np.ones(away.shape[:2], bool), np.full(away.shape[:2], np.inf)
        for start, end in ((a, b), (b, c), (c, a)):
            side, off = end - start, x[chunk, None] - start
            share = np.clip(np.einsum("pti,ti->pt", off, side) / np.einsum("ti,ti->t", side, side), 0.0, 1.0)
            least = np.minimum(least, np.linalg.norm(off - share[..., None] * side, axis=-1))
            inside &= np.einsum("pti,ti->pt", off, np.cross(normal, side)) > 0.0
        above = np.abs(np.einsum("pti,ti->pt", away, normal))
        found[chunk] = np.where(inside, np.minimum(above, least), least).min(axis=1)
    found[near] *= np.where(np.abs(winding(x[near], points, triangles)) > 0.5, -1.0, 1.0)
    return found


def check(problem: dict, arrays, task: dict) -> list[str]:
    """What is wrong with the state of a task; its figures are printed."""
    x = arrays["points"] + arrays[f"u {task['name']}"]
    names = [key for key in arrays.files if key.startswith("face ")]
    part = any(key.startswith("face mirror ") for key in names)
    faces = np.concatenate([arrays[key] for key in names if not key.startswith("face mirror ")])
    points, triangles = divided(x, faces)
    corners = points[triangles]
    pairs = near_pairs(corners.min(axis=1), corners.max(axis=1))
    count = int(np.count_nonzero(crossing(points, triangles, pairs)))
    print(f"  {task['name']}: {len(triangles)} triangles, {count} pairs intersect")
    wrong = []
    if count and problem.get("contact", {}).get("self", False):
        wrong.append(f"{count} pairs of triangles intersect")
    elif count:
        print("    the body goes through itself, which a problem without [contact] allows")
    for table in problem.get("obstacle", []):
        moved = task.get("move", {}).get(table["name"])
        distance, on = obstacle(table, np.zeros(3) if moved is None else place(moved))
        least = float(distance(points).min())
        near = on[((on >= points.min(axis=0)) & (on <= points.max(axis=0))).all(axis=1)]
        inside = 0 if part or not len(near) else int(np.count_nonzero(np.abs(winding(near, points, triangles)) > 0.5))
        print(f"    {table['name']}: least distance {least:.4f} mm, {inside} of its points inside the body")
        if least <= 0.0 or inside:
            wrong.append(f"goes through {table['name']}")
    return wrong


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__)
        return 2
    run = Path(sys.argv[1])
    try:
        problem = tomllib.loads((run / "problem.toml").read_text(encoding="utf-8"))
        stored = sorted((run / "fields").glob("[0-9]*.npz"))
        wrong = []
        for path in stored:
            print(f"design {int(path.stem)}")
            with np.load(path) as arrays:
                for task in problem["task"]:
                    wrong += [f"design {int(path.stem)}, {task['name']}: {why}" for why in check(problem, arrays, task)]
    except (OSError, KeyError, ValueError) as error:
        print(f"{run}: cannot be read ({error})")
        return 2
    if not stored:
        print(f"{run}: has no stored fields")
        return 2
    print("\n".join(wrong) if wrong else "nothing interpenetrates that must not")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
