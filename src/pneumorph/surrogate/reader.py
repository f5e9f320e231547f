"""Reads the fast model of a soft robot that `pneumorph model` has written. It needs NumPy alone: this one file may be
copied into any other program.

    from reader import Model
    model = Model("arm.npz")
    pose = model.pose({"A": 0.03, "B": 0.01})                          # MPa; chambers that are not named have none
    pose.translation, pose.rotation, pose.inside, pose.error           # mm, rad
    model.jacobian({"A": 0.03, "B": 0.01})                             # (6, C) by the pressures
    model.pressures_for({"shift_x": 5.0, "bending_y": 0.3}).pressures  # mm, rad -> MPa

Values are polynomials Σ_k a_k Π_c T_n(k,c)(x_c) with Chebyshev's T_n; x_c goes from -1 to 1 over the range of input c.
Inputs are pressures, and then loads if the model has some: the force on the tip (force_x, …, N), and gravity in parts
of its acceleration (gravity_x, …). Loads that are not named have their `usual` values. The domain is a union of boxes,
each from zero to a corner: beyond it no stable state is known. `errors` were measured at exact states that were not
fitted to. Whatever is wrong raises a `ModelError` of one line.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

FORMAT, VERSIONS = "pneumorph-model", (1, 2)
Inputs = Mapping[str, float] | Sequence[float] | np.ndarray

MOTIONS = ("shift_x", "shift_y", "extension", "bending_x", "bending_y", "twist")
"""Motions of the tip: along x, y, z in mm, and the components of its rotation vector in rad."""
PER_RADIAN = math.degrees(1.0)
"""Millimetres that count as much as a radian where a motion cannot be reached."""

EFFORT = 1e-4
"""Weight of the pressures, as parts of their ranges, against distances as parts of the reach: the least are found."""
STEPS, STARTS, SEEDS = 25, 4, 512
"""Most steps from a start, most starts, and poses among which they are chosen."""


class ModelError(ValueError):
    """A model file or a question to it is wrong; the message says in one line what, and how to correct it."""


@dataclass(frozen=True)
class Pose:
    """The pose of the tip: translation (mm), rotation vector (rad). `inside` says whether it is in the domain, and
    `error` by how much (mm, rad) the pose was wrong at most where that was measured."""

    translation: np.ndarray
    rotation: np.ndarray
    inside: bool
    error: tuple[float, float]


@dataclass(frozen=True)
class Found:
    """The pressures {chamber: MPa} for a motion, the pose there, by how much the motion is missed (mm, where 1° counts
    as 1 mm), and whether that is less than the error of the model."""

    pressures: dict[str, float]
    pose: Pose
    missed: float
    reached: bool


class Model:
    """A fast model, from the path of a file that `pneumorph model` has written.

    Attributes
    ----------
    header : what the file says of itself, see docs/how_to/model.md.
    chambers, loads : names, in the order of inputs.
    usual : {load: value}; index, coefficients : (t, C), (t, m) of the polynomials of the outputs
    bounds : (C, 2) MPa, and N or parts of gravity.
    corners : (K, C) of the boxes that are the domain.
    errors : {"translation_mm", "rotation_rad", "volume_mm3", …: largest error measured}
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
        self._soft_index, self._soft = arrays["soft_index"].astype(np.intp), arrays["soft_coefficients"]
        self._order = np.arange(1 + max(self.index.max(), self._soft_index.max()), dtype=float)[:, None]
        self._columns = np.arange(len(self.bounds))
        self._slopes = np.stack(
            [_derivative(self.index, self.coefficients, c) * 2.0 / self._range[c] for c in self._columns], axis=-1
        )
        # All six motions and their slopes at once.
        self._tip = np.hstack([self.coefficients[:, :6], self._slopes[:, :6].reshape(len(self.index), -1)])
        self._spread(np.array(list(self.usual.values())))

    def pose(self, pressures: Inputs) -> Pose:
        """The pose of the tip at pressures (MPa) and loads, by name or in order; other chambers have none."""
        motion = self._basis(p := self._given(pressures), self.index) @ self.coefficients[:, :6]
        return Pose(
            motion[:3], motion[3:], self.inside(p), (self.errors["translation_mm"], self.errors["rotation_rad"])
        )

    def values(self, pressures: np.ndarray) -> np.ndarray:
        """All outputs (n, m) at many inputs (n, C); not checked against the bounds."""
        return self._basis(np.asarray(pressures, float), self.index) @ self.coefficients

    def volumes(self, pressures: Inputs) -> dict[str, float]:
        """The volumes of the chambers in mm³."""
        values = self.values(self._given(pressures))[6 : 6 + len(self.chambers)]
        return dict(zip(self.chambers, values.tolist(), strict=True))

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
        packed = self._basis(np.asarray(pressures, float), self._soft_index) @ self._soft
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
        low, high = np.minimum(self.corners, 0.0) - tiny, np.maximum(self.corners, 0.0) + tiny
        boxed = np.all((p >= self._lower - tiny) & (p <= self.bounds[:, 1] + tiny), axis=(1, 2))
        return boxed & np.any(np.all((p >= low) & (p <= high), axis=2), axis=1)

    def pressures_for(
        self, wanted: Mapping[str, float], near: Inputs | None = None, loads: Mapping[str, float] | None = None
    ) -> Found:
        """The pressures in the domain with which the tip moves as wanted, or as near to it as it can.

        Parameters
        ----------
        wanted : {motion: mm or rad}
            Of `MOTIONS`; those that are not named are free.
        near : pressures from which to begin, such as those of the pose before; by default those of the nearest pose.
        loads : those that act; the others have their usual values.
        """
        if not np.array_equal(acting := self._given(loads or {})[len(self.chambers) :], self._acting):
            self._spread(acting)
        for name, value in (wanted or {"motion": 0.0}).items():
            if name not in MOTIONS:
                raise ModelError(f"{name}: give motions of {', '.join(MOTIONS)}")
            if not (isinstance(value, int | float | np.number) and math.isfinite(value)):
                raise ModelError(f"{name}: {value} is no finite number; give mm, or rad for turns")
        rows = [MOTIONS.index(name) for name in wanted]
        scale, goal = np.where(np.array(rows) < 3, 1.0, PER_RADIAN), np.array(list(wanted.values()), float)
        away = np.linalg.norm((self._seed_motions[:, rows] - goal) * scale, axis=1)
        error = math.hypot(self.errors["translation_mm"], PER_RADIAN * self.errors["rotation_rad"])
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
        low, high = box
        p, damping = np.clip(p, low, high), 1e-3
        off, slope = self._off(p, rows, scale, goal)
        effort = EFFORT * self._reach
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
            there = p + step * self._range
            new_off, new_slope = self._off(there, rows, scale, goal)
            new = new_off @ new_off + effort**2 * float(np.sum((there / self._range) ** 2))
            if new < merit:
                gained, least = merit - new, 1e-10 * merit + 1e-18 * self._reach**2
                p, off, slope, merit, damping = there, new_off, new_slope, new, damping / 10
                if gained < least:
                    break
            else:
                damping *= 10
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
        if len(pressures) == len(self.chambers):
            pressures = [*pressures, *self.usual.values()]
        if len(pressures) != len(names):
            raise ModelError(f"{len(pressures)} values are given; the model has {len(names)}: {', '.join(names)}")
        p = np.asarray(pressures, float)
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
    except Exception as error:  # zipfile has errors of its own
        said = "there is no such file" if isinstance(error, FileNotFoundError) else "is no model file, or damaged"
        raise ModelError(f"{path}: {said}; write one with pneumorph model") from None
    if kind != FORMAT or version not in VERSIONS:
        raise ModelError(f"{path}: is {kind} {version}, this reader reads {FORMAT} 1 and 2; write the model again")
    shapes = {"bounds", "corners", "index", "coefficients", "soft_index", "soft_coefficients"}
    missing = sorted(shapes - arrays.keys())
    if missing or not all(np.isfinite(arrays[name]).all() for name in shapes):
        raise ModelError(f"{path}: has no finite {missing[0] if missing else 'numbers'}; write the model again")
    return {**arrays, "header": header}
