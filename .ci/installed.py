"""What the installed package has computed with one linear solver and with the other, in the current folder."""

import json
from pathlib import Path

import numpy as np

from pneumorph import extras
from pneumorph.mechanics.assembly.linear import Pardiso

if extras.has_mkl():
    # ImportError where there is no PARDISO.
    Pardiso(np.array([0, 1]), np.array([0]))

one, other = (
    [json.loads(line)["objective"] for line in Path(run, "history.jsonl").read_text().splitlines()]
    for run in ("with", "without")
)
assert len(one) == len(other) == 3, (one, other)
assert one[-1] < one[0] < 0.0, one
np.testing.assert_allclose(other, one, rtol=1e-6)

steps = json.loads(Path("steps.json").read_text())["steps"]
assert len(steps) == 4 and all(step["converged"] and step["stable"] for step in steps), steps
extensions = [step["translation_mm"][2] for step in steps]
assert all(np.diff(extensions) > 0.0), extensions
print(f"three designs are the same with PARDISO and SuperLU; mixed elements extend by {extensions[-1]:.4f} mm")
