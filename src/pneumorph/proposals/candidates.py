"""Candidates: problems with a body each, drawn for a target from the layouts that suit it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.objective import build_objectives
from pneumorph.problem import Problem
from pneumorph.proposals.layouts import LAYOUTS, Drawn, Draws, Layout, NoRoom
from pneumorph.proposals.target import Target, Wish

COARSE = 0.42
"""Size of the elements while candidates are compared, over the radius of the body."""

REDRAWS = 20
"""Draws of a candidate until its body fits."""


@dataclass(frozen=True)
class Candidate:
    """A body drawn for a target.

    Attributes
    ----------
    name : str
        Number and layout.
    layout : str
    words : str
        What was drawn.
    problem : Problem or None
    reason : str
        Why there is no problem, as a sentence.
    """

    name: str
    layout: str
    words: str
    problem: Problem | None
    reason: str = ""

    @property
    def posed(self) -> Problem:
        """The problem of a candidate that has one."""
        assert self.problem is not None, "bodies that were not found are not designed"
        return self.problem


def suited(target: Target) -> tuple[list[Layout], dict[str, str]]:
    """The layouts that may do what is asked, and for each of the others why it cannot."""
    reasons = {layout.name: layout.unsuited(target) for layout in LAYOUTS}
    return [layout for layout in LAYOUTS if not reasons[layout.name]], {
        name: reason for name, reason in reasons.items() if reason
    }


def draw_candidates(target: Target, count: int, seed: int = 0) -> Iterator[Candidate]:
    """Draw candidates, of every suited layout in turn; each depends on the seed and its number alone."""
    # Several chambers around the axis, or a single one on it, suit every target.
    layouts, _ = suited(target)
    for index in range(count):
        yield _candidate(target, layouts[index % len(layouts)], seed, index)


def _candidate(target: Target, layout: Layout, seed: int, index: int) -> Candidate:
    draws, name = Draws(seed, index), f"{index + 1:02d}-{layout.name}"
    reason = ""
    for _ in range(REDRAWS):
        rubber = draws.one_of(target.material)
        try:
            drawn = layout.draw(target, draws)
            problem = _with_most_symmetry(_content(target, rubber, drawn, draws), drawn)
        except (NoRoom, ProblemError) as error:
            reason = str(error)
            continue
        named = f"{rubber.name}, " if len(target.material) > 1 and rubber.name else ""
        return Candidate(name, layout.name, named + drawn.words, problem)
    return Candidate(name, layout.name, "", None, reason)


def _with_most_symmetry(content: dict[str, Any], drawn: Drawn) -> Problem:
    """The problem with the first of the body's symmetries that loads and tasks have too."""
    *more, least = drawn.symmetries
    for symmetry in more:
        with suppress(ProblemError):
            return _sound(content | {"body": {**drawn.tables["body"], "symmetry": symmetry}})
    return _sound(content | {"body": {**drawn.tables["body"], "symmetry": least}})


def _sound(content: Mapping[str, Any]) -> Problem:
    problem = Problem.model_validate(content)
    build_objectives(problem)
    return problem


def _content(target: Target, rubber: Any, drawn: Drawn, draws: Draws) -> dict[str, Any]:
    """The tables of a problem file, without a symmetry."""
    given = target.model_dump(mode="json", exclude_unset=True)
    content = {key: given[key] for key in ("title", "end_effector", "gravity", "limits") if key in given}
    content |= dict(drawn.tables) | {"material": rubber.model_dump(mode="json", exclude_unset=True)}
    limits = content.setdefault("limits", {})
    limits.setdefault("envelope", {"radius": f"{target.space.radius:g} mm"})
    level = draws.between(0.45, 0.75)
    tasks = given["task"]
    for table, task in zip(tasks, target.task, strict=True):
        table["pressure"] = {name: _pressure(target, task, place, level) for name, place in drawn.places.items()}
    content["task"] = tasks
    content["mesh"] = {"size": f"{COARSE * drawn.radius:.3g} mm"}
    content["optimizer"] = {"step": f"{0.03 * drawn.radius:.2g} mm", "iterations": 1}
    return content


def _pressure(target: Target, task: Wish, place: np.ndarray, level: float) -> dict[str, str]:
    """Free pressure of a chamber, which starts higher on the side from which the task bends the body."""
    towards, least, most = task.towards, target.pressure.min, target.pressure.max
    share = level
    if towards is not None and np.any(place):
        share = level * (0.5 - 0.5 * float(place @ towards))
    start = least + share * (most - least)
    return {key: f"{1e3 * value:.5g} kPa" for key, value in (("start", start), ("min", least), ("max", most))}
