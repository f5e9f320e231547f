"""Drives the tip of a body around a square by its fast model alone, and looks at exact states where it really goes.

    python benchmarks/square.py RUN_OR_PROBLEM MODEL.npz [--points 24] [--share 0.4]

The square lies across the axis, around the middle of the places that the tip reaches; its side is a share of the
smaller extent of these. Nothing is measured on the way (open loop): pressures come from the model for one place after
another.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import pneumorph as pm
from pneumorph.surrogate.reader import Model
from pneumorph.surrogate.states import Sample, States
from pneumorph.surrogate.workspace import workspace


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path)
    parser.add_argument("model", type=Path)
    parser.add_argument("--points", type=int, default=24)
    parser.add_argument("--share", type=float, default=0.4)
    asked = parser.parse_args()
    model = Model(asked.model)
    found = workspace(model, model.bounds, 4000)
    assert found is not None
    places = found.motions[:, :2]
    side = asked.share * float(np.ptp(places, axis=0).min())
    corners = np.median(places, axis=0) + side / 2 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]])
    along = np.linspace(0.0, 4.0, asked.points, endpoint=False)
    square = np.array([np.interp(along, range(5), corners[:, axis]) for axis in range(2)]).T
    bounds = dict(zip(model.chambers, map(tuple, model.bounds.tolist()), strict=True))
    source = asked.source
    design = pm.open_run(source, trust=True).best if source.is_dir() else pm.starting_design(pm.load(source))
    states = States(design.explorer(model.header["task"]), bounds)
    off, near = [], None
    for x, y in square:
        answer = model.pressures_for({"shift_x": x, "shift_y": y}, near)
        assert answer.reached, "the square is not within reach; make it smaller"
        near = list(answer.pressures.values())
        exact = states.at(np.array(near))
        assert isinstance(exact, Sample), exact
        off.append(np.linalg.norm(exact.values[:2] - [x, y]))
    rms = float(np.sqrt(np.mean(np.square(off))))
    print(f"{asked.points} places on a square with sides of {side:.3g} mm")
    print(f"the tip is off by {rms:.2g} mm (RMS), and by {max(off):.2g} mm at most")
    print(f"that is {100 * rms / side:.2g} % of its side")


if __name__ == "__main__":
    main()
