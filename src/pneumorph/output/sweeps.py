"""The equilibria along sweeps of pressure as a table that spreadsheets read."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.mechanics.assembly.plate import COMPONENTS

AXES = ("x", "y", "z")
UNITS = {name: "N" if name in COMPONENTS[:3] else "N*mm" for name in COMPONENTS}
"""Of the reactions."""


@dataclass(frozen=True)
class Curve:
    """One sweep.

    Attributes
    ----------
    task : the task whose pressures the chambers have that are not swept.
    swept : names of the chambers that are.
    steps : what `pneumorph simulate --json` writes of every step.
    """

    task: str
    swept: tuple[str, ...]
    steps: list[dict[str, Any]]

    @property
    def found(self) -> list[dict[str, Any]]:
        """The steps that have an equilibrium."""
        return [step for step in self.steps if step["converged"]]


def reactions(curves: Sequence[Curve]) -> list[str]:
    """The plate components in which something blocks or springs back, in their usual order."""
    told = {name for curve in curves for step in curve.found for name in step["reaction"]}
    return [name for name in COMPONENTS if name in told]


def csv_text(curves: Sequence[Curve], chambers: Sequence[str]) -> str:
    """A line per step; units are in the header, and what was not found is left empty."""
    blocked = reactions(curves)
    header = ["task", "swept"]
    header += [f"pressure_{name}_kPa" for name in chambers]
    header += [f"translation_{axis}_mm" for axis in AXES]
    header += [f"rotation_{axis}_deg" for axis in AXES]
    header += [f"reaction_{name}_{UNITS[name].replace('*', '_')}" for name in blocked]
    header += [f"volume_{name}_mm3" for name in chambers]
    header += ["max_stretch", "beyond_validity", "converged", "reason"]
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(header)
    for curve in curves:
        for step in curve.steps:
            table.writerow([curve.task, "+".join(curve.swept), *_cells(step, chambers, blocked)])
    return text.getvalue()


def _cells(step: dict[str, Any], chambers: Sequence[str], blocked: Sequence[str]) -> list[str]:
    pressures = [1e3 * step["pressure_MPa"][name] for name in chambers]
    if step["converged"]:
        numbers = [
            *pressures,
            *step["translation_mm"],
            *np.degrees(step["rotation_rad"]),
            *(step["reaction"][name] for name in blocked),
            *(step["volume_mm3"][name] for name in chambers),
            step["max_stretch"],
        ]
        beyond = str(step["beyond_validity"]).lower()
        return [*(f"{number:.12g}" for number in numbers), beyond, "true", ""]
    nothing = [""] * (8 + len(blocked) + len(chambers))
    return [*(f"{number:.12g}" for number in pressures), *nothing, "false", step["reason"]]
