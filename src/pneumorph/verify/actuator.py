"""The actuators of the verification: the linear actuator's start, and a design that an optimisation made of it."""

from __future__ import annotations

from importlib import resources

import numpy as np

from pneumorph.geometry import Body, starting_body
from pneumorph.problem import Problem

PRESSURE = 0.06
"""MPa."""

LINEAR = {
    "title": "Linear actuator",
    "material": {"name": "Hei-Cast 8400"},
    "body": {
        "length": "80 mm",
        "radius": "8 mm",
        "control_density": "0.6 /mm",
        "ripple": {"amplitude": "0.2 mm", "period": "10 mm"},
        "chamber": [
            {"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "77 mm"], "ends": "flat"}
        ],
    },
    "task": [
        {
            "name": "extend",
            "pressure": {"A": "60 kPa"},
            "objective": {"kind": "maximize", "motion": "extension"},
        }
    ],
}


def linear_actuator() -> Problem:
    """A tube of radii 4 and 8 mm and length 80 mm with a slight ripple, closed by ends 3 mm thick; plate at its tip."""
    return Problem.model_validate(LINEAR)


def bellows() -> Body:
    """What 40 designs made of it: a bellows that extends by 28 mm at 60 kPa, stretched up to 1.5 in its folds."""
    with resources.files("pneumorph.verify").joinpath("bellows.npz").open("rb") as file, np.load(file) as stored:
        nets = [stored["exterior"], stored["chamber_A"]]
    return starting_body(linear_actuator().body).with_control_points(
        np.concatenate([net.reshape(-1, 3) for net in nets])
    )
