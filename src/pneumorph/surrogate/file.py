"""Writes fast models as files: arrays of NumPy and a header in JSON, which `reader.py` reads without this package."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph import atomic
from pneumorph.geometry import Body
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.problem.components import MOTIONS
from pneumorph.surrogate.build import Built
from pneumorph.surrogate.reader import FORMAT, VERSION
from pneumorph.surrogate.states import Sample

AXES = ("x", "y", "z")


def outputs_of(chambers: Sequence[str], sections: int) -> list[str]:
    """Names of the values of a model, with units."""
    names = [f"{motion} ({'mm' if number < 3 else 'rad'})" for number, motion in enumerate(MOTIONS)]
    names += [f"volume {chamber} (mm3)" for chamber in chambers]
    for number in range(1, sections + 1):
        names += [f"section {number} {axis} (mm)" for axis in AXES]
        names += [f"section {number} about {axis} (rad)" for axis in AXES]
    return names


def fingerprint(problem: Problem, body: Body) -> str:
    """What identifies a body under the loads of the first task of a problem: shape, rubber, loads and mesh."""
    given = problem.model_dump(
        mode="json", include={"material", "end_effector", "reinforcement", "obstacle", "contact", "mesh"}
    )
    first = problem.task[0]
    loads = repr((acting(problem, first), sorted(first.poses.items())))
    digest = hashlib.sha256(json.dumps(given, sort_keys=True).encode() + loads.encode())
    digest.update((np.round(np.asarray(body.control_points(), float), 6) + 0.0).tobytes())
    return digest.hexdigest()


def write(
    path: Path, built: Built, chambers: Sequence[str], sections: int, about: Mapping[str, Any], tolerance: float
) -> None:
    """Write a model.

    Parameters
    ----------
    path : Path
    built : Built
    chambers : names, in the order of its pressures.
    sections : how many it has.
    about : what else the header says: title, task, body, made_with.
    tolerance : which error was asked for, relative to ranges.
    """
    fit = built.fit
    header = {
        "format": FORMAT,
        "version": VERSION,
        **about,
        "chambers": list(chambers),
        "outputs": outputs_of(chambers, sections),
        "errors": built.errors,
        "ranges": built.ranges,
        "tolerance": tolerance,
        "states": len(built.samples),
        "held_out": len(built.held_out),
        "degree": int(fit.index.sum(axis=1).max()),
        "dofs": built.dofs,
        "missing": [{"pressure_MPa": each.pressures.tolist(), "reason": each.reason} for each in built.missing],
    }
    data = io.BytesIO()
    arrays = {
        "header": np.frombuffer(json.dumps(header, indent=1, allow_nan=False).encode(), np.uint8),
        "bounds": fit.domain.bounds,
        "corners": fit.domain.corners,
        "index": fit.index.astype(np.int16),
        "coefficients": fit.coefficients,
        "soft_index": fit.soft_index.astype(np.int16),
        "soft_coefficients": fit.soft_coefficients,
        **_stored("state", built.samples),
        **_stored("held_out", built.held_out),
    }
    np.savez(data, **arrays)
    atomic.write_bytes(path, data.getvalue())


def _stored(name: str, samples: list[Sample]) -> dict[str, np.ndarray]:
    """What was solved, from which the model can be fitted again."""
    return {
        f"{name}_pressures": np.array([each.pressures for each in samples]),
        f"{name}_values": np.array([each.values for each in samples]),
        f"{name}_slopes": np.array([each.slopes for each in samples]),
        f"{name}_compliances": np.array([each.compliance for each in samples]),
    }
