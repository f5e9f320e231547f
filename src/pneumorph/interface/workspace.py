"""Workspaces of tips, within bounds as users write them, and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.interface.reach import range_of
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.objectives.words import MOTION_WORDS
from pneumorph.surrogate.reader import Model
from pneumorph.surrogate.workspace import Workspace, workspace

SWEPT = {1: ("line", "mm"), 2: ("surface", "mm²"), 3: ("space", "mm³")}


@dataclass(frozen=True, eq=False, repr=False)
class WorkspaceFound(Workspace):
    """A workspace that says what it is."""

    def __str__(self) -> str:
        lines = [f"at {len(self.pressures)} random pressures in the domain the tip has"]
        for number, name in enumerate(MOTIONS):
            low, high = self.motions[:, number].min(), self.motions[:, number].max()
            low, high, unit = (low, high, " mm") if number < 3 else (np.degrees(low), np.degrees(high), "°")
            lines.append(f"  {MOTION_WORDS[name]:<24} {low:8.2f} to {high:8.2f}{unit}")
        away = np.linalg.norm(self.motions[:, :2], axis=1).max()
        lines.append(f"it goes {away:.3g} mm from the axis, and turns by {self._turn():.3g}° at most")
        if self.swept is not None:
            what, unit = SWEPT[len(self.chambers)]
            lines.append(
                f"its places are a {what} of {self.swept:.3g} {unit}; their convex hull has {self.hull:.3g} mm³"
            )
        else:
            lines.append(f"the convex hull of its places has {self.hull:.3g} mm³")
        low, middle, high = np.percentile(1e-3 * self.finest, [0, 50, 100])
        lines.append(
            f"1 kPa moves it by {low:.2g} to {high:.2g} mm, {middle:.2g} in the median, in the direction in which it "
            f"moves least ({np.median(self.evenness):.2g} of what it does in that in which it moves most)"
        )
        softest, stiffest = self.stiffness[:, 0], self.stiffness[:, -1]
        lines.append(
            f"its stiffness is {softest.min():.3g} to {softest.max():.3g} N/mm where it is softest, and "
            f"{stiffest.min():.3g} to {stiffest.max():.3g} N/mm where it is stiffest"
        )
        return "\n".join(lines)

    def _turn(self) -> float:
        return float(np.degrees(np.linalg.norm(self.motions[:, 3:], axis=1)).max())


def workspace_of(model: Model, bounds: np.ndarray, count: int) -> WorkspaceFound:
    """The workspace of the tip within bounds (C, 2) in MPa.

    Raises
    ------
    ProblemError
        If no state is known there.
    """
    found = workspace(model, bounds, count)
    if found is None:
        raise ProblemError("bounds: no stable state is known at pressures within them; widen them")
    return WorkspaceFound(**vars(found))


def narrowed(model: Model, given: Mapping[str, Any]) -> np.ndarray:
    """The bounds (C, 2) of a model in MPa, with those that are given in their place.

    Raises
    ------
    ProblemError
        If a chamber is unknown, or a bound is no pressure or beyond those of the model.
    """
    bounds = model.bounds[: len(model.chambers)].copy()
    for name, text in given.items():
        if name not in model.chambers:
            raise ProblemError(f"{name}: there is no such chamber in the model; it has {', '.join(model.chambers)}")
        k, (low, high) = model.chambers.index(name), range_of(name, text)
        if low < bounds[k, 0] - 1e-12 or high > bounds[k, 1] + 1e-12:
            raise ProblemError(
                f"{name}: {text} is beyond the model, which knows {1e3 * bounds[k, 0]:g} to {1e3 * bounds[k, 1]:g} kPa"
            )
        bounds[k] = low, high
    return bounds
