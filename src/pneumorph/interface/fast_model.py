"""Fast models of designs: built, compared with exact states, and said in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import pneumorph
from pneumorph.analysis import Explorer
from pneumorph.errors import ProblemError
from pneumorph.interface.reach import bounds_of
from pneumorph.study.cluster import connected
from pneumorph.study.states import StatesOnWorkers
from pneumorph.surrogate.build import Built, build, groups_of
from pneumorph.surrogate.file import fingerprint, write
from pneumorph.surrogate.inputs import FORCES, GRAVITIES
from pneumorph.surrogate.modes import faces_of
from pneumorph.surrogate.reader import Model, ModelError
from pneumorph.surrogate.states import Bounds, Sample, States
from pneumorph.units import FORCE, parse

LOOSEST, FINEST = 0.2, 1e-4
"""Tolerances that make sense."""

MOST_CHAMBERS = 4
MOST_SECTIONS = 50

WORDS = {
    "translation": "translation of the tip",
    "rotation": "rotation of the tip",
    "volume": "volumes",
    "shape": "places on the surfaces",
}


@dataclass(frozen=True, eq=False, repr=False)
class FastModel:
    """A fast model and what it cost.

    Attributes
    ----------
    path : Path
        Its file.
    model : Model
        As any program reads it, see ``pneumorph/surrogate/reader.py``.
    built : Built
        Exact states and measured errors.
    tolerance : float
        What was asked for.
    """

    path: Path
    model: Model
    built: Built
    tolerance: float

    @property
    def good(self) -> bool:
        """Whether the errors are within the tolerance."""
        return self.built.worst() <= self.tolerance

    def __str__(self) -> str:
        built, index = self.built, self.built.fit.index
        degree = int(index.sum(axis=1).max())
        kept = len(built.samples)
        lines = [f"{len(index)} polynomials of degree {degree} at most, fitted to {kept} exact states and their slopes"]
        lines.append(f"{built.solved} states were sought, {built.factorisations} factorisations")
        lines.append(f"largest errors at {len(built.held_out)} random states that are not among them:")
        for name, error in built.errors.items():
            lines.append(f"  {error_words(name, error, built.ranges.get(name))}")
        if not self.good:
            lines.append(f"that is more than {100 * self.tolerance:g} %: allow more states, or narrower bounds")
        lines += self._of_domain()
        return "\n".join(lines)

    def _of_domain(self) -> list[str]:
        if not self.built.missing:
            return ["every state within the bounds that was sought is stable"]
        count, reasons = len(self.model.chambers), list(dict.fromkeys(each.reason for each in self.built.missing))
        named = ", ".join(self.model.chambers)
        if self.model.loads:
            lowest = np.abs(self.model.corners[:, :count]).min(axis=0)
            least = ", ".join(f"{1e3 * part:.4g}" for part in lowest)
            return [f"stable up to {named} = ({least}) kPa under all loads, and beyond under some; else: {reasons[0]}"]
        corners = ["(" + ", ".join(f"{1e3 * part:.4g}" for part in corner) + ")" for corner in self.model.corners]
        return [f"stable up to {named} = {' or '.join(corners)} kPa; beyond: {reasons[0]}"]


@dataclass(frozen=True)
class ModelCheck:
    """Errors of a model at exact states.

    Attributes
    ----------
    off : (n, 2)
        mm and rad, of the tip at each state.
    errors : (2,)
        What the file says.
    allowed : (2,)
        The tolerance of the file, or its errors where they are larger.
    missing : int
        Pressures in its domain without a stable state.
    """

    off: np.ndarray
    errors: tuple[float, float]
    allowed: tuple[float, float]
    missing: int

    @property
    def good(self) -> bool:
        """Whether the errors are within the tolerance with which the model was built."""
        return not self.missing and bool(np.all(self.off <= np.array(self.allowed)))

    def __str__(self) -> str:
        mm, rad = self.off.max(axis=0) if len(self.off) else (0.0, 0.0)
        said, turned = self.errors[0], np.degrees(self.errors[1])
        text = f"at {len(self.off)} exact states the tip is off by at most {mm:.2g} mm and {np.degrees(rad):.2g}°"
        text += f" (the file says {said:.2g} mm and {turned:.2g}°)"
        return text if not self.missing else f"{text}; at {self.missing} pressures there is no stable state"


def build_model(
    explorer: Explorer,
    path: Path,
    bounds: Mapping[str, Any],
    tolerance: float,
    sections: int,
    most: int,
    said: Callable[[str], None] = lambda text: None,
    force: Any = None,
    gravity: bool = False,
    workers: int = 1,
) -> FastModel:
    """Build a fast model and write it; the parameters are those of `Design.model`.

    Parameters
    ----------
    explorer : of the design, under the loads of a task.
    path : of the file.
    bounds : {chamber: "0:60 kPa"}
    tolerance : relative to ranges.
    sections : their number.
    most : most states.
    said : told how far it is.
    force : largest component of forces on the tip, "0.5 N"; None where they do not vary.
    gravity : whether its direction varies.
    workers : processes that solve states.

    Raises
    ------
    ProblemError
        If one of them makes no sense.
    """
    if not FINEST <= tolerance <= LOOSEST:
        raise ProblemError(f"tolerance: {100 * tolerance:g} % is not between {100 * FINEST:g} % and 20 %; use 0.5 %")
    if not 0 <= sections <= MOST_SECTIONS:
        raise ProblemError(f"sections: {sections} is not between 0 and {MOST_SECTIONS}; use e.g. 5")
    given = bounds_of(explorer.problem, bounds)
    if still := [each.name for each in explorer.problem.body.chamber if each.name not in given]:
        said(f"no pressure in {', '.join(still)}, as in all tasks; --bounds {still[0]}=0:60kPa lets it vary too")
    if len(given) > MOST_CHAMBERS:
        raise ProblemError(
            f"bounds: {len(given)} chambers are too many for a fast model, which may have {MOST_CHAMBERS}; use reach"
        )
    if path.suffix != ".npz":
        raise ProblemError(f"{path}: is no name of a model; let it end in .npz")
    if workers < 1:
        raise ProblemError(f"workers: {workers} is less than one; use 1, or the number of cores")
    states = States(explorer, given, sections, True, loads_that_vary(explorer, force, gravity))
    groups = groups_of(len(given), sections)
    if workers > 1:
        with connected(None, workers) as client:
            built = build(StatesOnWorkers(client, states), groups, tolerance, most, said)
    else:
        built = build(states, groups, tolerance, most, said)
    problem = explorer.problem
    about = {
        "title": problem.title,
        "task": problem.task[0].name,
        "body": fingerprint(problem, explorer.body),
        "made_with": pneumorph.__version__,
    }
    loads = dict(zip(states.names[len(given) :], states.usual, strict=True))
    write(path, built, tuple(given), sections, about, tolerance, faces_of(states.mesh), loads)
    return FastModel(path, Model(path), built, tolerance)


def loads_that_vary(explorer: Explorer, force: Any, gravity: bool) -> Bounds:
    """The ranges of the loads that vary, N and parts of gravity.

    Raises
    ------
    ProblemError
        If there is no plate or no gravity, or the force is none or smaller than that of the task.
    """
    found: dict[str, tuple[float, float]] = {}
    if force is not None:
        try:
            most = parse(force, FORCE)
        except ValueError as error:
            raise ProblemError(f"force: {error}") from None
        if explorer.problem.end_effector.kind != "plate":
            raise ProblemError('force: acts on a plate, and the tip is free; set kind = "plate" in [end_effector]')
        own = max(map(abs, explorer.under.force))
        if not most > 0.0 or own > most:
            raise ProblemError(f"force: {force} is not above {own:g} N, the largest component of the task's force")
        found |= dict.fromkeys(FORCES, (-most, most))
    if gravity:
        if explorer.under.gravity is None:
            raise ProblemError("gravity: the body has no weight; add the table [gravity] to the problem")
        found |= dict.fromkeys(GRAVITIES, (-1.0, 1.0))
    return found


def read_model(path: Path) -> Model:
    """The model in a file.

    Raises
    ------
    ProblemError
        If there is none.
    """
    try:
        return Model(path)
    except ModelError as error:
        raise ProblemError(str(error)) from None


def check_model(explorer: Explorer, path: Path, count: int) -> ModelCheck:
    """Compare a model with exact states; see `Design.check_model`."""
    model = read_model(path)
    if model.header["body"] != fingerprint(explorer.problem, explorer.body):
        raise ProblemError(
            f"{path}: is the model of another body, task or mesh ({model.header['title']}, task "
            f"{model.header['task']}); write that of this one with pneumorph model"
        )
    bounds = list(map(tuple, model.bounds.tolist()))
    loads = dict(zip(model.loads, bounds[len(model.chambers) :], strict=True))
    states = States(explorer, dict(zip(model.chambers, bounds, strict=False)), loads=loads)
    off, missing, rng = [], 0, np.random.default_rng()
    while len(off) + missing < count:
        p = rng.uniform(*model.bounds.T)
        if not model.inside(p):
            continue
        exact = states.at(p)
        if not isinstance(exact, Sample):
            missing += 1
            continue
        pose = model.pose(p)
        both = (pose.translation, exact.values[:3]), (pose.rotation, exact.values[3:6])
        off.append([float(np.linalg.norm(one - other)) for one, other in both])
    names = ("translation_mm", "rotation_rad")
    mm, rad = (model.errors[name] for name in names)
    most = tuple(model.header["tolerance"] * model.header["ranges"][name] for name in names)
    return ModelCheck(np.array(off).reshape(-1, 2), (mm, rad), (max(mm, most[0]), max(rad, most[1])), missing)


def error_words(name: str, error: float, span: float | None) -> str:
    """An error with its unit, and in per cent of the range of what it is of."""
    what, _, unit = name.rpartition("_")
    part = "" if span is None else f" ({100 * error / span:.2g} % of the range)"
    words = WORDS.get(what, what.replace("_", " "))
    if name == "compliance":
        return f"compliance {100 * error:.2g} %"
    if name == "stretch":
        return f"largest stretch on the surfaces {error:.2g}"
    amount = f"{np.degrees(error):.2g}°" if unit == "rad" else f"{error:.2g} {unit.replace('mm3', 'mm³')}"
    return f"{words} {amount}{part}"
