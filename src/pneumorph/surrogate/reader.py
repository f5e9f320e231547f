"""Reads the fast model of a soft robot that `pneumorph model` has written. It needs NumPy alone: this one file may be
copied into any other program.

    from reader import Model
    model = Model("arm.npz")
    pose = model.pose({"A": 0.03, "B": 0.01})                          # MPa; chambers that are not named have none
    pose.translation, pose.rotation, pose.inside, pose.error           # mm, rad
    model.jacobian({"A": 0.03, "B": 0.01})                             # (6, C) by the pressures
    model.pressures_for({"shift_x": 5.0, "bending_y": 0.3}).pressures  # mm, rad -> MPa

Values are polynomials Σ_k a_k Π_c T_n(k,c)(x_c) with Chebyshev's T_n; x_c goes from -1 to 1 over the range of input c.
Inputs are pressures, and then loads if there are some: the force on the tip (force_x, …, N), gravity in parts of its
acceleration (gravity_x, …). The domain is a union of boxes, each from zero to a corner: beyond it no stable state is
known. `errors` were measured at exact states that were not fitted to. What is wrong raises a `ModelError` of one line.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

FORMAT, VERSIONS = "pneumorph-model", (1, 2)
ERRORS = ("translation_mm", "rotation_rad")
ARRAYS = ("bounds", "corners", "index", "coefficients", "soft_index", "soft_coefficients")
Inputs = Mapping[str, float] | Sequence[float] | np.ndarray
MOTIONS = ("shift_x", "shift_y", "extension", "bending_x", "bending_y", "twist")
"""Motions of the tip: along x, y, z in mm, and the components of its rotation vector in rad."""
PER_RADIAN = math.degrees(1.0)  # mm that count as much as a radian where a motion cannot be reached
EFFORT = 1e-4  # weight of pressures, as parts of their ranges, against distances as parts of the reach
STEPS, STARTS, SEEDS = 25, 4, 512  # most steps from a start, most starts, and poses among which they are chosen
LARGEST = 1e9  # of motions that are sought, mm or rad


class ModelError(ValueError):
    """A model file or a question to it is wrong; the message says in one line what, and how to correct it."""


@dataclass(frozen=True)
class Pose:
    """Translation (mm) and rotation vector (rad) of the tip, whether it is in the domain, largest errors (mm, rad)."""

    translation: np.ndarray
    rotation: np.ndarray
    inside: bool
    error: tuple[float, float]


@dataclass(frozen=True)
class Found:
    """The pressures {chamber: MPa} for a motion, the pose there, what is missed (mm; 1° counts as 1 mm), and whether
    that is less than the error of the model."""

    pressures: dict[str, float]
    pose: Pose
    missed: float
    reached: bool


class Model:
    """A fast model, from the path of a file that `pneumorph model` has written.

    `header` is what the file says of itself, see docs/how_to/model.md; `chambers` and then `loads` are the inputs in
    their order, `usual` {load: value} those of the task. `bounds` (C, 2) and the `corners` (K, C) of the boxes that are
    the domain are in MPa, and N or parts of gravity; `errors` {name: largest error measured}. `index` (t, C) and
    `coefficients` (t, m) are those of the outputs, `soft_index` and `soft_coefficients` of the compliance's triangle.
    """

    def __init__(self, path: str | Path) -> None:
        arrays = _read(Path(path))
        self.header = arrays.pop("header")
        self.chambers: tuple[str, ...] = tuple(self.header["chambers"])
        self.loads: tuple[str, ...] = tuple(self.header.get("loads", ()))
        self.usual: dict[str, float] = dict(zip(self.loads, self.header.get("usual", ()), strict=True))
        self.outputs: tuple[str, ...] = tuple(self.header["outputs"])
        self.errors: dict[str, float] = dict(self.header["errors"])
        self.bounds, self.corners = arrays["bounds"], arrays["corners"]
        self._lower, self._range = self.bounds[:, 0], np.ptp(self.bounds, axis=1)
        self.index, self.coefficients = arrays["index"].astype(np.intp), arrays["coefficients"]
        self.soft_index, self.soft_coefficients = arrays["soft_index"].astype(np.intp), arrays["soft_coefficients"]
        self._order = np.arange(1 + max(self.index.max(), self.soft_index.max()), dtype=float)[:, None]
        self._columns = np.arange(len(self.bounds))
        slopes = [_derivative(self.index, self.coefficients, c) * 2.0 / self._range[c] for c in self._columns]
        self._slopes = np.stack(slopes, axis=-1)
        # All six motions and their slopes at once.
        self._tip = np.hstack([self.coefficients[:, :6], self._slopes[:, :6].reshape(len(self.index), -1)])
        self._spread(np.array(list(self.usual.values())))

    def pose(self, pressures: Inputs) -> Pose:
        """The pose of the tip at pressures (MPa) and loads, by name or in order; other chambers have none."""
        motion = self._basis(p := self._given(pressures), self.index) @ self.coefficients[:, :6]
        return Pose(motion[:3], motion[3:], self.inside(p), (self.errors[ERRORS[0]], self.errors[ERRORS[1]]))

    def values(self, pressures: np.ndarray) -> np.ndarray:
        """All outputs (n, m) at many inputs (n, C); not checked against the bounds."""
        return self._basis(np.asarray(pressures, float), self.index) @ self.coefficients

    def volumes(self, pressures: Inputs) -> dict[str, float]:
        """The volumes of the chambers in mm³."""
        return dict(zip(self.chambers, self.values(self._given(pressures))[6:].tolist(), strict=False))

    def jacobian(self, pressures: Inputs) -> np.ndarray:
        """Derivatives (6, C) of the tip's motions by the pressures, mm/MPa and rad/MPa, and by the loads."""
        return self.jacobians(self._given(pressures))

    def jacobians(self, pressures: np.ndarray) -> np.ndarray:
        """The same (n, 6, C) at many inputs (n, C); not checked against the bounds."""
        return np.tensordot(self._basis(np.asarray(pressures, float), self.index), self._slopes[:, :6], axes=1)

    def compliance(self, pressures: Inputs) -> np.ndarray:
        """Motions (6, 6) of the tip by small forces (N) and moments (N·mm) on it, mm and rad, in axes of space."""
        return self.compliances(self._given(pressures)[None])[0]

    def compliances(self, pressures: np.ndarray) -> np.ndarray:
        """The same (n, 6, 6) at many inputs (n, C); not checked against the bounds."""
        packed = self._basis(np.asarray(pressures, float), self.soft_index) @ self.soft_coefficients
        full = np.zeros((len(packed), 6, 6))
        row, column = np.tril_indices(6)
        full[:, row, column] = full[:, column, row] = packed
        return full

    def inside(self, pressures: Inputs) -> bool:
        """Whether pressures and loads are in the domain."""
        return bool(self.all_inside(self._given(pressures)[None])[0])

    def all_inside(self, pressures: np.ndarray) -> np.ndarray:
        """The same (n,) for many inputs (n, C)."""
        p, tiny = np.asarray(pressures, float)[:, None], 1e-9 * self._range
        low = np.maximum(np.minimum(self.corners, 0.0), self._lower) - tiny
        high = np.minimum(np.maximum(self.corners, 0.0), self.bounds[:, 1]) + tiny
        return np.any(np.all((p >= low) & (p <= high), axis=2), axis=1)

    def pressures_for(
        self, wanted: Mapping[str, float], near: Inputs | None = None, loads: Mapping[str, float] | None = None
    ) -> Found:
        """The pressures in the domain with which the tip moves as wanted {motion: mm or rad}, or as near to it as it
        can; motions that are not named are free. The search begins near given pressures, such as those of the pose
        before, or else near the nearest pose that is known. Loads that are not given have their usual values."""
        acting = self._given({**dict(zip(self.chambers, self._lower, strict=False)), **(loads or {})})
        if not np.array_equal(acting := acting[len(self.chambers) :], self._acting):
            self._spread(acting)
        for name, value in (wanted if isinstance(wanted, Mapping) and wanted else {"motion": 0.0}).items():
            if name not in MOTIONS:
                raise ModelError(f"{name}: give motions of {', '.join(MOTIONS)}")
            if not (isinstance(value, int | float | np.number) and abs(value) < LARGEST):
                raise ModelError(f"{name}: {value} is no number below {LARGEST:g}; give mm, or rad for turns")
        rows = [MOTIONS.index(name) for name in wanted]
        scale, goal = np.where(np.array(rows) < 3, 1.0, PER_RADIAN), np.array(list(wanted.values()), float)
        away = np.linalg.norm((self._seed_motions[:, rows] - goal) * scale, axis=1)
        error = math.hypot(self.errors[ERRORS[0]], PER_RADIAN * self.errors[ERRORS[1]])
        # First from what is nearest in every box, then from elsewhere.
        nearest = np.argsort(away)
        first = self._seeds[nearest[0]] if near is None else self._under(self._given(near))
        others = [self._seeds[k] for k in nearest[4 : 4 * STARTS : 4]]
        best, least = first, math.inf
        for start, box in [(start, box) for start in (first, *others) for box in self._boxes(first)]:
            p, missed = self._descend(start, box, rows, scale, goal)
            if missed < least:
                best, least = p, missed
            if least <= 0.1 * error:
                break
        return Found(dict(zip(self.chambers, best.tolist())), self.pose(best), least, least <= error)  # noqa: B905

    def _descend(self, p: np.ndarray, box: np.ndarray, rows: list[int], scale: np.ndarray, goal: np.ndarray):
        """Levenberg's and Marquardt's method from p in a box: the pressures (C,) there, and what is missed."""
        (low, high), damping, effort = box, 1e-3, EFFORT * self._reach
        off, slope = self._off(p := np.clip(p, low, high), rows, scale, goal)
        merit = off @ off + effort**2 * np.sum((p / self._range) ** 2)
        for _ in range(STEPS):
            gradient = slope.T @ off + effort**2 * p / self._range
            hessian = slope.T @ slope + effort**2 * np.eye(len(p))
            q_low, q_high = (low - p) / self._range, (high - p) / self._range
            free = ~(((q_low >= -1e-12) & (gradient > 0)) | ((q_high <= 1e-12) & (gradient < 0)))
            if not free.any() or damping > 1e9:
                break
            own = hessian[np.ix_(free, free)]
            step = np.zeros(len(p))
            step[free] = np.linalg.solve(own + damping * np.diag(np.diag(own)), -gradient[free])
            step = np.clip(step, q_low, q_high)
            new_off, new_slope = self._off(there := p + step * self._range, rows, scale, goal)
            new = new_off @ new_off + effort**2 * float(np.sum((there / self._range) ** 2))
            if not new < merit:
                damping *= 10
                continue
            gained, least = merit - new, 1e-10 * merit + 1e-18 * self._reach**2
            p, off, slope, merit, damping = there, new_off, new_slope, new, damping / 10
            if gained < least:
                break
        return p, float(np.linalg.norm(off))

    def _off(self, p: np.ndarray, rows: list[int], scale: np.ndarray, goal: np.ndarray):
        """What is missed, mm, and its derivatives by the pressures as parts of their ranges."""
        both = self._basis(p, self.index) @ self._tip
        slope = both[6:].reshape(6, -1)[rows] * self._range
        return (both[rows] - goal) * scale, slope * scale[:, None]

    def _boxes(self, p: np.ndarray) -> list[np.ndarray]:
        """The boxes (2, C) of the domain at the loads that act, those nearest to p first."""
        low = np.maximum(np.minimum(self.corners, 0.0), self._lower)
        high = np.minimum(np.maximum(self.corners, 0.0), self.bounds[:, 1])
        held = np.all((low <= self._under(low)) & (self._under(high) <= high), axis=1)
        low, high = self._under(low[held]), self._under(high[held])
        outside = np.sum(np.maximum(np.maximum(low - p, p - high), 0.0) / self._range, axis=1)
        return [np.array([low[k], high[k]]) for k in np.argsort(outside, kind="stable")]

    def _under(self, inputs: np.ndarray) -> np.ndarray:
        """Inputs (…, C) with the loads that act."""
        inputs = inputs.copy()
        inputs[..., len(self.chambers) :] = self._acting
        return inputs

    def _spread(self, acting: np.ndarray) -> None:
        """Pressures all over the domain where these loads act: a lattice of Korobov's kind, clipped to it."""
        self._acting = acting
        phases = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0][: len(self.bounds)])
        parts = self._lower + np.modf(np.arange(1, SEEDS + 1)[:, None] * phases)[0] * self._range
        points = self._under(np.vstack([parts, self.corners, np.clip(0.0 * self.corners, *self.bounds.T)]))
        self._seeds = points = points[self.all_inside(points)]
        self._seed_motions = self.values(points)[:, :6]
        if not len(points):
            raise ModelError("loads: no stable state is known under these loads; give smaller ones")
        self._reach = float(np.linalg.norm(np.ptp(self._seed_motions[:, :3], axis=0))) or 1.0

    def _basis(self, p: np.ndarray, index: np.ndarray) -> np.ndarray:
        """The polynomials (t,) or (n, t) at pressures (C,) or (n, C)."""
        angle = np.arccos(np.clip(2.0 * (p - self._lower) / self._range - 1.0, -1.0, 1.0))
        return np.cos(self._order * angle[..., None, :])[..., index, self._columns].prod(axis=-1)

    def _given(self, pressures: Inputs) -> np.ndarray:
        """Inputs (C,)."""
        names = self.chambers + self.loads
        if isinstance(pressures, Mapping):
            for name in pressures:
                if name not in names:
                    raise ModelError(f"{name}: there is no such chamber or load; the model has {', '.join(names)}")
            pressures = [pressures.get(name, self.usual.get(name, 0.0)) for name in names]
        try:
            p = np.array([float(value) for value in pressures])
        except (TypeError, ValueError):
            raise ModelError(f"{pressures}: give a number for each of {', '.join(names)}") from None
        p = np.append(p, [*self.usual.values()]) if len(p) == len(self.chambers) else p
        if len(p) != len(names):
            raise ModelError(f"{len(p)} values are given; the model has {len(names)}: {', '.join(names)}")
        beyond = ~((p >= self._lower - 1e-9 * self._range) & (p <= self.bounds[:, 1] + 1e-9 * self._range))
        if beyond.any():
            k = int(np.argmax(beyond))
            size, unit = (1e3, " kPa") if k < len(self.chambers) else (1.0, " N" if "force" in names[k] else "")
            ends = " to ".join(f"{size * end:g}" for end in self.bounds[k])
            raise ModelError(f"{names[k]}: {size * p[k]:g}{unit} is not in the model's range, {ends}{unit}")
        return p


def _derivative(index: np.ndarray, coefficients: np.ndarray, c) -> np.ndarray:
    """The coefficients of the derivative by x_c: T_n' = 2n (T_{n-1} + T_{n-3} + …), where T_0 counts half."""
    place = {tuple(row): k for k, row in enumerate(index.tolist())}
    found = np.zeros_like(coefficients)
    for k, row in enumerate(index.tolist()):
        for lower in range(row[c] - 1, -1, -2):
            found[place[(*row[:c], lower, *row[c + 1 :])]] += (1.0 if lower == 0 else 2.0) * row[c] * coefficients[k]
    return found


def _read(path: Path) -> dict:
    """The arrays of a file, and its header."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        kind, version = (header := json.loads(bytes(arrays["header"])))["format"], header["version"]
        known = kind == FORMAT and version in VERSIONS
        sound = not known or _sound(header, *(arrays[name] for name in ARRAYS))
    except Exception as error:  # zipfile has errors of its own
        said = "there is no such file" if isinstance(error, FileNotFoundError) else "is no model file, or damaged"
        raise ModelError(f"{path}: {said}; write one with pneumorph model") from None
    if not known:
        raise ModelError(f"{path}: is {kind} {version}, this reader reads {FORMAT} 1 and 2; write the model again")
    if not sound:
        raise ModelError(f"{path}: is damaged, its parts do not fit together; write the model again")
    return {**arrays, "header": header}


def _sound(header: dict, bounds, corners, index, coefficients, soft_index, soft_coefficients) -> bool:
    """Whether numbers are finite and what a header and arrays say fits together."""
    names, rows = [*header["chambers"], *header.get("loads", ())], set(map(tuple, index.tolist()))
    shapes = [(len(coefficients), len(names)), (len(soft_coefficients), len(names)), (len(names), 2)]
    numbers = [*header.get("usual", ()), *(header["errors"][name] for name in ERRORS)]
    return (
        all(isinstance(name, str) for name in names)
        and all(np.isfinite(part).all() for part in (bounds, corners, coefficients, soft_coefficients, numbers))
        and [index.shape, soft_index.shape, bounds.shape] == shapes
        and coefficients.shape[1] == len(header["outputs"]) >= 6 + len(header["chambers"])
        and (len(corners) > 0, corners.shape[1:], soft_coefficients.shape[1:]) == (True, (len(names),), (21,))
        and len(header.get("usual", ())) == len(header.get("loads", ()))
        and bool((bounds[:, 0] < bounds[:, 1]).all() and min(index.min(), soft_index.min()) >= 0)
        # Their derivatives are polynomials of the same kinds.
        and all(n == 0 or (*row[:c], n - 1, *row[c + 1 :]) in rows for row in rows for c, n in enumerate(row))
    )
