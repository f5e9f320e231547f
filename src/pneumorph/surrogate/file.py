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
from pneumorph.surrogate.modes import Faces, Modes
from pneumorph.surrogate.reader import FORMAT, ModelError
from pneumorph.surrogate.states import Sample

FACE = "shape_face "
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
    path: Path,
    built: Built,
    chambers: Sequence[str],
    sections: int,
    about: Mapping[str, Any],
    tolerance: float,
    faces: Faces | None = None,
    loads: Mapping[str, float] | None = None,
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
    faces : the surfaces at rest, if it has modes of them.
    loads : the loads that vary, after the pressures, and their usual values.
    """
    fit = built.fit
    header = {
        "format": FORMAT,
        # Files without loads are read by the readers of version 1 too.
        "version": 2 if loads else 1,
        **about,
        "chambers": list(chambers),
        **({"loads": list(loads), "usual": list(loads.values())} if loads else {}),
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
        **({} if fit.modes is None or faces is None else _shape(fit.modes, faces)),
        **_stored("state", built.samples),
        **_stored("held_out", built.held_out),
    }
    np.savez(data, **arrays)
    atomic.write_bytes(path, data.getvalue())


def read_shape(path: Path) -> tuple[Faces, Modes] | None:
    """The surfaces at rest and their modes in a file that `reader.Model` reads; None where it has none.

    Raises
    ------
    ModelError
        If they are damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            if "shape_modes" not in stored:
                return None
            corners = {name.removeprefix(FACE): stored[name] for name in stored.files if name.startswith(FACE)}
            faces = Faces(stored["shape_points"], corners)
            amounts = stored["shape_index"].astype(np.intp), stored["shape_coefficients"]
            modes = Modes(stored["shape_modes"].astype(float), *amounts)
            if _sound(faces, modes, len(stored["bounds"])):
                return faces, modes
    except (KeyError, IndexError, ValueError, TypeError):
        pass
    raise ModelError(f"{path}: the shapes in it are damaged; write the model again with pneumorph model")


def _sound(faces: Faces, modes: Modes, chambers: int) -> bool:
    """Whether shapes of arrays and numbers fit together."""
    (count, many), nodes = modes.coefficients.shape, len(faces.points)
    corners = np.concatenate(list(faces.corners.values()))
    return (
        faces.points.shape == (nodes, 3)
        and modes.modes.shape == (many, nodes, 4)
        and modes.index.shape == (count, chambers)
        and corners.shape[1:] == (6,)
        and corners.dtype.kind == "i"
        and 0 <= int(corners.min()) <= int(corners.max()) < nodes
        and int(modes.index.min()) >= 0
        and all(bool(np.isfinite(each).all()) for each in (faces.points, modes.modes, modes.coefficients))
    )


def _shape(modes: Modes, faces: Faces) -> dict[str, np.ndarray]:
    return {
        "shape_points": faces.points,
        "shape_modes": modes.modes.astype(np.float32),
        "shape_index": modes.index.astype(np.int16),
        "shape_coefficients": modes.coefficients,
        **{f"{FACE}{name}": corners.astype(np.int32) for name, corners in faces.corners.items()},
    }


def _stored(name: str, samples: list[Sample]) -> dict[str, np.ndarray]:
    """What was solved, from which the model can be fitted again."""
    return {
        f"{name}_pressures": np.array([each.pressures for each in samples]),
        f"{name}_values": np.array([each.values for each in samples]),
        f"{name}_slopes": np.array([each.slopes for each in samples]),
        f"{name}_compliances": np.array([each.compliance for each in samples]),
    }
