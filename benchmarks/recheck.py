"""Check wall, envelope and curvature of every design of a run independently, without using the package.

    python benchmarks/recheck.py RUN

The surfaces are evaluated by polynomials from the Cox–de Boor recurrence. The wall is the distance between dense
samples of every two surfaces, end discs included, refined by Newton's method on the closest pairs; envelope and
curvature are those of dense samples, refined around the worst. The curvature is half the squared Frobenius norm of the
shape operator in an orthonormal frame; a sixteenth of a knot span beside a pole is excluded. A tip that is a dome is a
pole of the exterior, and has no plane.

The exit status is 1 if a value is worse than in the history, which has certified ones, 2 if RUN cannot be read.
"""

import json
import re
import sys
import tomllib
from itertools import combinations, product
from pathlib import Path

import numpy as np

ROUNDING = 1e-6  # of values in histories, relative
SIGN = {"wall_mm": 1.0, "envelope_mm": -1.0, "curvature": -1.0}
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1e3, "/mm^2": 1.0, "/mm**2": 1.0, "/mm²": 1.0, "1/mm^2": 1.0, "/cm^2": 1e-2}
PAIRS_AT_ONCE = 4_000_000


def quantity(text: str) -> float:
    """The value of "2 mm" in mm, of "0.3 /mm^2" in 1/mm²."""
    number, unit = re.fullmatch(r"\s*([-+0-9.eE]+)\s*(.*?)\s*", text).groups()
    return float(number) * UNITS[unit.replace(" ", "")]


def pieces(knots: np.ndarray) -> np.ndarray:
    """Coefficients of a cubic B-spline basis: (spans, 4 functions, 4 powers of the fraction of the span, ascending)."""
    coefficients = []
    for k in range(3, len(knots) - 4):
        low, wide = knots[k], knots[k + 1] - knots[k]
        now = {k: np.array([1.0, 0.0, 0.0, 0.0])}
        for degree in (1, 2, 3):
            higher = {i: np.zeros(4) for i in range(k - degree, k + 1)}
            for i, part in now.items():
                # B_i contributes (t - t_i)/length of itself to function i and the rest to i - 1, with t = low + wide s.
                length = knots[i + degree] - knots[i]
                rising = ((low - knots[i]) * part + wide * np.roll(part, 1)) / length
                for j, share in ((i, rising), (i - 1, part - rising)):
                    higher[j] += share
            now = higher
        coefficients.append([now[i] for i in range(k - 3, k + 1)])
    return np.array(coefficients)


class Patch:
    """A surface with control net (n_r, n_q, 3), clamped in r and periodic in q; column i is centred at q = i / n_q."""

    def __init__(self, net: np.ndarray):
        rows, columns = net.shape[:2]
        self.net = net
        self.spans = rows - 3
        self.along = pieces(np.r_[[0.0] * 3, np.linspace(0.0, 1.0, self.spans + 1), [1.0] * 3])
        self.around = pieces(np.arange(-3, columns + 4) / columns)

    def at(self, q: np.ndarray, r: np.ndarray, orders: list[tuple[int, int]]) -> list[np.ndarray]:
        """Derivatives (n, 3) of each order (dq, dr) at parameters q, r (n,)."""
        columns = self.net.shape[1]
        turns = (q % 1.0) * columns
        j = np.minimum(turns.astype(int), columns - 1)
        heights = np.clip(r, 0.0, 1.0) * self.spans
        i = np.minimum(heights.astype(int), self.spans - 1)
        window = self.net[(i[:, None] + np.arange(4))[:, :, None], ((j[:, None] + np.arange(-1, 3)) % columns)[:, None]]
        found = []
        for dq, dr in orders:
            across = _weights(self.around[j], turns - j, dq) * float(columns) ** dq
            along = _weights(self.along[i], heights - i, dr) * float(self.spans) ** dr
            found.append(np.einsum("na,nac->nc", along, np.einsum("nb,nabc->nac", across, window)))
        return found

    def grid(self, per_q: int, per_r: int) -> tuple[np.ndarray, np.ndarray]:
        """Parameters of equally spaced samples, each (rows, columns)."""
        q = np.arange(per_q * self.net.shape[1]) / (per_q * self.net.shape[1])
        return tuple(np.meshgrid(q, np.linspace(0.0, 1.0, per_r * self.spans + 1)))


def _weights(coefficients: np.ndarray, s: np.ndarray, order: int) -> np.ndarray:
    """Derivatives (n, 4) of the four functions by the fraction s (n,) of their spans."""
    powers = np.zeros((len(s), 4))
    for power in range(order, 4):
        factor = np.prod(np.arange(power - order + 1, power + 1)) if order else 1.0
        powers[:, power] = factor * s ** (power - order)
    return np.einsum("nfp,np->nf", coefficients, powers)


def disc(rim: np.ndarray) -> Patch:
    """A flat end as a patch with one span, linear from its centre to the rim."""
    centre = np.broadcast_to(rim.mean(axis=0), rim.shape)
    return Patch(np.stack([centre + s * (rim - centre) for s in (0.0, 1 / 3, 2 / 3, 1.0)]))


def largest(patch: Patch, value, low: float = 0.0, high: float = 1.0, per: int = 5) -> float:
    """The largest value(patch, q, r) (n,) for r between bounds, on a dense grid that is refined around the largest."""
    q, r = (part.ravel() for part in patch.grid(per, per))
    r = np.clip(r, low, high)
    step = np.array([1 / (per * patch.net.shape[1]), 1 / (per * patch.spans)])
    values = np.concatenate([value(patch, q[k : k + 20000], r[k : k + 20000]) for k in range(0, len(q), 20000)])
    best = np.argsort(-values)[:150]
    q, r, found = q[best], r[best], float(values.max())
    around, up = (part.ravel() for part in np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-1, 1, 7)))
    for _ in range(5):
        near_q = q[:, None] + step[0] * around
        near_r = np.clip(r[:, None] + step[1] * up, low, high)
        values = value(patch, near_q.ravel(), near_r.ravel()).reshape(near_q.shape)
        chosen = np.arange(len(q)), values.argmax(axis=1)
        q, r, found = near_q[chosen], near_r[chosen], max(found, float(values.max()))
        step = step / 3
    return found


def bending(patch: Patch, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """(k1² + k2²)/2, half of ‖W‖² with the shape operator W in the orthonormal frame of Gram and Schmidt."""
    x_q, x_r, x_qq, x_qr, x_rr = patch.at(q, r, [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)])
    a = np.linalg.norm(x_q, axis=1)
    e = x_q / a[:, None]
    b = np.einsum("nc,nc->n", e, x_r)
    c = np.linalg.norm(x_r - b[:, None] * e, axis=1)
    normal = np.cross(e, (x_r - b[:, None] * e) / c[:, None])
    qq, qr, rr = (np.einsum("nc,nc->n", normal, part) for part in (x_qq, x_qr, x_rr))
    # The frame is e = x_q/a and f = (x_r - b e)/c.
    ee, ef = qq / a**2, (qr - b * qq / a) / (a * c)
    ff = (rr - 2 * b * qr / a + b**2 * qq / a**2) / c**2
    return 0.5 * (ee**2 + 2 * ef**2 + ff**2)


def distance(one: Patch, other: Patch) -> float:
    """The least distance of two patches, over samples and then by Newton's method from the local minima."""
    (qa, ra), (qb, rb) = (patch.grid(2, 2 if patch.spans > 1 else 8) for patch in (one, other))
    a, b = one.at(qa.ravel(), ra.ravel(), [(0, 0)])[0], other.at(qb.ravel(), rb.ravel(), [(0, 0)])[0]
    chunk = max(1, PAIRS_AT_ONCE // len(b))
    least, near = np.empty(len(a)), np.empty(len(a), int)
    for k in range(0, len(a), chunk):
        part = a[k : k + chunk]
        squared = (part**2).sum(1)[:, None] + (b**2).sum(1) - 2 * part @ b.T
        near[k : k + chunk] = squared.argmin(axis=1)
        least[k : k + chunk] = np.linalg.norm(part - b[near[k : k + chunk]], axis=1)
    field = least.reshape(qa.shape)
    padded = np.pad(np.pad(field, ((0, 0), (1, 1)), mode="wrap"), ((1, 1), (0, 0)), mode="edge")
    rows, columns = field.shape
    around = np.min([padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)], axis=0)
    nets = [points.reshape(*q.shape, 3) for points, q in ((a, qa), (b, qb))]
    reach = max(np.linalg.norm(np.diff(net, axis=axis), axis=2).max() for net in nets for axis in (0, 1))
    chosen = np.flatnonzero((field <= around).ravel() & (least <= least.min() + reach))
    chosen = np.union1d(chosen[np.argsort(least[chosen])][:3000], np.argsort(least)[:200])
    start = [qa.ravel()[chosen], ra.ravel()[chosen], qb.ravel()[near[chosen]], rb.ravel()[near[chosen]]]
    return min(float(least.min()), float(np.sqrt(closest(one, other, np.column_stack(start)).min())))


def gap(one: np.ndarray, other: np.ndarray) -> float:
    """Distance between the bounding boxes of two nets, which contain their patches."""
    apart = np.maximum(one.min((0, 1)) - other.max((0, 1)), other.min((0, 1)) - one.max((0, 1)))
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


def closest(one: Patch, other: Patch, t: np.ndarray) -> np.ndarray:
    """Squared distances (n,) after damped Newton steps from parameters t (n, 4): q, r on `one`, then on `other`."""
    first, second = [(0, 0), (1, 0), (0, 1)], [(2, 0), (1, 1), (0, 2)]
    damping, best = np.full(len(t), 1e-3), np.full(len(t), np.inf)
    step, kept = np.zeros_like(t), None
    for _ in range(14):
        trial = t + step
        trial[:, [1, 3]] = np.clip(trial[:, [1, 3]], 0.0, 1.0)
        A, B = one.at(trial[:, 0], trial[:, 1], first + second), other.at(trial[:, 2], trial[:, 3], first + second)
        d = A[0] - B[0]
        squared = (d**2).sum(axis=1)
        better = squared < best
        damping = np.where(better, np.maximum(damping / 5, 1e-8), damping * 8)
        t, best = np.where(better[:, None], trial, t), np.minimum(squared, best)
        J = np.stack([A[1], A[2], -B[1], -B[2]], axis=2)
        scale = np.maximum(np.linalg.norm(J, axis=1), 0.1)  # zero at poles and centres
        H = np.einsum("nci,ncj->nij", J, J)
        for corner, (qq, qr, rr) in ((0, A[3:]), (2, [-part for part in B[3:]])):
            H[:, corner : corner + 2, corner : corner + 2] += np.einsum("nc,ijnc->nij", d, [[qq, qr], [qr, rr]])
        # A step without improvement is repeated from its start, shorter.
        fresh = [np.einsum("nci,nc->ni", J, d) / scale, H / scale[:, :, None] / scale[:, None, :], scale]
        pairs = zip(fresh, kept or fresh, strict=True)
        kept = [np.where(better.reshape(-1, *[1] * (new.ndim - 1)), new, old) for new, old in pairs]
        g, H = kept[0].copy(), kept[1].copy()
        for r in (1, 3):  # a parameter at its bound stays there if the gradient points beyond
            stuck = ((t[:, r] <= 0.0) & (g[:, r] > 0)) | ((t[:, r] >= 1.0) & (g[:, r] < 0))
            H[stuck, r, :], H[stuck, :, r], g[stuck, r] = 0.0, 0.0, 0.0
            H[stuck, r, r] = 1.0
        shift = np.maximum(1e-6 - np.linalg.eigvalsh(H)[:, 0], 0.0) + damping
        step = -np.linalg.solve(H + shift[:, None, None] * np.eye(4), g[:, :, None])[:, :, 0] / kept[2]
    return best


def normal(row: np.ndarray) -> np.ndarray:
    """Unit normal of the plane of an end row, from base to tip; q runs counter-clockwise on the exterior."""
    area = np.cross(row - row.mean(axis=0), np.roll(row, -1, axis=0) - row).sum(axis=0)
    return area / np.linalg.norm(area)


def measured(nets: dict[str, np.ndarray], ends: dict[str, str], domed: bool = False) -> dict[str, float]:
    """Wall, envelope and curvature of a body, whose tip may be a dome."""
    exterior = Patch(nets["exterior"])
    # The planes of the flat ends, from their rims: base and tip, with normals into the body.
    flat = ((0, -1.0),) if domed else ((0, -1.0), (-1, 1.0))
    planes = [(nets["exterior"][k, 0], -way * normal(nets["exterior"][k])) for k, way in flat]
    chambers = {name: Patch(nets[f"chamber_{name}"]) for name in ends}
    last = 1.0 - 1 / (16 * exterior.spans) if domed else 1.0
    walls, bends, closed = [], [largest(exterior, bending, 0.0, last)], [[exterior]]
    for name, patch in chambers.items():
        margin = 1 / (16 * patch.spans) if ends[name] == "pole" else 0.0
        bends.append(largest(patch, bending, margin, 1.0 - margin))
        for place, inwards in planes:
            walls.append(-largest(patch, lambda p, q, r, at=place, n=inwards: (at - p.at(q, r, [(0, 0)])[0]) @ n))
        closed.append([patch] + [disc(patch.net[k]) for k in (0, -1) if ends[name] == "flat"])
    for some, others in combinations(closed, 2):
        for one, other in product(some, others):
            if gap(one.net, other.net) < min(walls):
                walls.append(distance(one, other))
    radius = largest(exterior, lambda p, q, r: np.hypot(*p.at(q, r, [(0, 0)])[0][:, :2].T))
    return {"wall_mm": min(walls), "envelope_mm": radius, "curvature": max(bends)}


def main(folder: Path) -> int:
    try:
        problem = tomllib.loads((folder / "problem.toml").read_text(encoding="utf-8"))
        lines = (folder / "history.jsonl").read_text(encoding="utf-8").splitlines()
        claims = {line["iteration"]: line["limits"] for line in map(json.loads, lines)}
    except (OSError, ValueError) as error:
        print(f"{folder}: cannot be read as a run directory ({error})", file=sys.stderr)
        return 2
    limits = problem["limits"]
    wide = quantity(limits["envelope"]["radius"]) if "envelope" in limits else np.inf
    bounds = (
        f"wall {quantity(limits['wall']):g} mm, envelope {wide:g} mm, curvature {quantity(limits['curvature']):g} /mm²"
    )
    print(f"{folder}: measured value (value in the history); limits: {bounds}")
    ends = {chamber["name"]: chamber.get("ends", "flat") for chamber in problem["body"]["chamber"]}
    print("design", *(f"{key:>22s}" for key in SIGN))
    worse = 0
    for number, claimed in claims.items():
        with np.load(folder / "designs" / f"{number:04d}.npz") as nets:
            found = measured(dict(nets), ends, "dome" in problem["body"])
        cells, bad = [], []
        for key, sign in SIGN.items():
            claim = claimed.get(key)
            cells.append(f"{found[key]:10.4f} ({'–' if claim is None else format(claim, '.4f'):>8s}) ")
            if claim is not None and (claim - found[key]) * sign > ROUNDING * abs(claim):
                bad.append(key)
        worse += bool(bad)
        print(f"{number:6d} " + " ".join(cells), f" worse than reported: {', '.join(bad)}" if bad else "", flush=True)
    print(f"{len(claims)} designs, {worse} of them worse than in the history")
    return int(worse > 0)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
