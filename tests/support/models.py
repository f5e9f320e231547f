"""Writes web/test/model.json: a small model with a hole in its domain, and what the Python reader says of it.

`python tests/support/models.py`; `tests/surrogate/test_page_model.py` says whether the file is still what this writes.
"""

import json
import tempfile
from pathlib import Path

import numpy as np

from pneumorph.surrogate.build import Built, Fit
from pneumorph.surrogate.domain import whole
from pneumorph.surrogate.file import write
from pneumorph.surrogate.reader import MOTIONS, Model
from pneumorph.surrogate.states import Sample

PATH = Path(__file__).parents[2] / "web" / "test" / "model.json"
BOUNDS = np.array([[0.0, 0.06], [-0.02, 0.04]])
FAR = ({"shift_x": 30.0}, {"shift_x": 2.0, "shift_y": -1.0}, {"bending_y": 2.0})


def model_file(path: Path) -> Path:
    """A model of two chambers whose tip bends far, with errors and volumes that are made up."""
    domain = whole(BOUNDS).cut(np.array([0.05, 0.03]), np.array([0.052, 0.032]))
    rng = np.random.default_rng(3)
    index = np.array([(a, b) for a in range(5) for b in range(5 - a)])
    decay = 0.25 ** index.sum(axis=1)[:, None]
    coefficients = decay * rng.normal(size=(len(index), 8)) * np.array([8, 8, 8, 0.3, 0.3, 0.3, 90, 90])
    factors = np.random.default_rng(4).normal(size=(3, 6, 6)) * np.array([1.0, 0.3, 0.3])[:, None, None]
    soft = np.array([(factor @ factor.T)[np.tril_indices(6)] for factor in factors])
    fit = Fit(domain, index, coefficients, np.array([[0, 0], [1, 0], [0, 1]]), soft)
    sample = Sample(np.zeros(2), np.zeros(8), np.zeros((8, 2)), np.eye(6))
    errors = {"translation_mm": 1e-4, "rotation_rad": 1e-6, "volume_mm3": 1.0, "compliance": 0.0}
    built = Built(fit, errors, dict.fromkeys(errors, 1.0), [sample], [sample])
    write(path, built, ("A", "B"), 0, {"title": "T", "task": "t", "body": "b", "made_with": "0"}, 0.005)
    return path


def told() -> dict:
    """The model as the page gets it, and what is asked of it with the answers."""
    with tempfile.TemporaryDirectory() as folder:
        model = Model(model_file(Path(folder) / "m.npz"))
    rng = np.random.default_rng(5)
    points = np.vstack([BOUNDS[:, 0] + rng.random((6, 2)) * np.ptp(BOUNDS, axis=1), BOUNDS.T, [[0.06, 0.035]]])
    asked = [
        {
            "p": p.tolist(),
            "motions": [*model.pose(p).translation.tolist(), *model.pose(p).rotation.tolist()],
            "volumes": list(model.volumes(p).values()),
            "jacobian": model.jacobian(p).tolist(),
            "inside": model.inside(p),
            "fineness": np.linalg.svd(model.jacobian(p)[:3], compute_uv=False)[[-1, 0]].tolist(),
            "stiffness": (1.0 / np.linalg.eigvalsh(model.compliance(p)[:3, :3])[[2, 0]]).tolist(),
        }
        for p in points
    ]
    found = []
    there = model.pose([0.03, 0.01])
    x, y, _ = there.translation.tolist()
    reachable = ({"shift_x": x, "shift_y": y}, {"twist": float(there.rotation[2])}, {"extension": 0.9, "shift_y": y})
    for wanted in (*reachable, *FAR):
        for near in (None, [0.01, 0.01]):
            answer = model.pressures_for(wanted, near)
            found.append(
                {"wanted": wanted, "near": near, "p": list(answer.pressures.values())}
                | {"missed": answer.missed, "reached": answer.reached}
            )
    count = 6 + len(model.chambers)
    parts = {"chambers": list(model.chambers), "bounds": model.bounds.tolist(), "corners": model.corners.tolist()}
    parts |= {"index": model.index.tolist(), "coefficients": model.coefficients[:, :count].tolist()}
    parts |= {"soft": {"index": model.soft_index.tolist(), "coefficients": model.soft_coefficients[:, :6].tolist()}}
    assert list(MOTIONS) == [name.rpartition(" (")[0] for name in model.outputs[:6]]
    return {"model": parts | {"errors": model.errors}, "asked": asked, "found": found}


if __name__ == "__main__":
    PATH.write_text(json.dumps(told(), indent=1) + "\n")
