"""The stiffness of the tip at a state, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pneumorph.results import SweepStep

AXES = ("x", "y", "z")


def stiffness_lines(step: SweepStep) -> Iterator[str]:
    """Stiffness against forces and moments, its principal axes, energy, air, and the force where the tip is blocked."""
    stiff = step.stiffness
    if stiff is None:
        return
    soft = np.diag(stiff.compliance)
    pushed = ", ".join(f"{axis} {_inverse(by)} N/mm" for axis, by in zip(AXES, soft[:3], strict=True))
    turned = ", ".join(f"{axis} {_inverse(by / math.radians(1))}" for axis, by in zip(AXES, soft[3:], strict=True))
    yield f"  stiffness of the tip: along {pushed}; about {turned} N·mm/°"
    values, axes = stiff.axes
    yield f"  softest {_principal(values[0], axes[0])}, stiffest {_principal(values[-1], axes[-1])}"
    air = ", ".join(f"{name} {_number(volume / 1e3)} ml" for name, volume in stiff.air.items())
    yield f"  energy {_number(stiff.energy)} mJ; air at atmospheric pressure since rest: {air}"
    if stiff.blocked is not None and stiff.along is not None:
        yield f"  blocked along {_axis(stiff.along)}: {_number(stiff.blocked)} N"


def _principal(value: float, axis: np.ndarray) -> str:
    stiff = "held" if math.isinf(value) else f"{value:.3g} N/mm"
    return f"{stiff} along {_axis(axis * np.sign(axis[np.argmax(np.abs(axis))]))}"


def _axis(axis) -> str:
    return f"({', '.join(f'{round(float(part), 2) + 0.0:g}' for part in axis)})"


def _inverse(soft: float) -> str:
    return "held" if soft <= 0.0 else f"{1.0 / soft:.3g}"


def _number(value: float) -> str:
    return f"{0.0 if abs(value) < 1e-9 else value:.3g}"
