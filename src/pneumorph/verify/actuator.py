"""The actuators of the verification: the starting tube of the linear actuator, and an optimised bellows."""

from __future__ import annotations

from importlib import resources
from typing import Any

import numpy as np

from pneumorph.geometry import Body
from pneumorph.geometry.tube.start import starting_body
from pneumorph.problem import Problem

PRESSURE = 0.06
"""Pressure of the cases with these actuators, MPa."""

LINEAR: dict[str, Any] = {
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
    """The problem of a tube of radii 4 and 8 mm and length 80 mm, slightly rippled, with 3 mm ends and a plate."""
    return Problem.model_validate(LINEAR)


def several_rubbers(length: float = 80.0) -> Problem:
    """The same tube, or a shorter one, with a stiff layer on one side, so that it bends, and a soft sleeve inside."""
    chamber = LINEAR["body"]["chamber"][0] | {"span": ["3 mm", f"{length - 3} mm"]}
    body = LINEAR["body"] | {"length": f"{length} mm", "chamber": [chamber]}
    layer = {"thickness": "1 mm", "span": [f"{length / 8} mm", f"{length} mm"], "angles": ["-70 deg", "70 deg"]}
    regions = [
        {"name": "spine", "material": _rubber("2 MPa", "16 MPa"), "layer": layer},
        {
            "name": "liner",
            "material": _rubber("0.3 MPa", "3 MPa"),
            "sleeve": {"thickness": "0.8 mm", "chambers": ["A"]},
        },
    ]
    return Problem.model_validate(LINEAR | {"body": body, "region": regions})


def _rubber(shear: str, bulk: str) -> dict[str, str]:
    return {"model": "neo-hookean", "shear_modulus": shear, "bulk_modulus": bulk, "density": "1.1 g/cm^3"}


def bellows() -> Body:
    """Its optimised body after 40 designs: a bellows that extends by 28 mm at 60 kPa, with a stretch up to 1.5."""
    with resources.files("pneumorph.verify").joinpath("bellows.npz").open("rb") as file, np.load(file) as stored:
        nets = [stored["exterior"], stored["chamber_A"]]
    return starting_body(linear_actuator().tubes).with_control_points(
        np.concatenate([net.reshape(-1, 3) for net in nets])
    )
