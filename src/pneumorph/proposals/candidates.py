"""Candidates: problems with a body each, drawn for a target from the layouts that suit it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.objective import build_objectives
from pneumorph.problem import Problem
from pneumorph.proposals.estimates import ballooning, buckles
from pneumorph.proposals.layouts import LAYOUTS, Drawn, Draws, Layout, NoRoom
from pneumorph.proposals.target import PressureRange, Target, Wish

COARSE = 0.42
"""Size of the elements while candidates are compared, over the radius of the body."""

SAFE = 0.8
"""Pressure at which a chamber starts at most, over the one at which it would balloon by the estimate."""

_KEY = re.compile(r"(task|end_effector|gravity|material|pressure|title)\b[\w.\[\]]*: ")
"""How a reason begins that is about what a target says beside its space and limits."""

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
        rng = np.random.default_rng([seed, index])
        layout = layouts[index % len(layouts)]
        yield draw_candidate(target, layout, f"{index + 1:02d}-{layout.name}", iter(rng.random, None))


def why_none(drawn: Sequence[Candidate]) -> str:
    """Why no body was found for any candidate, as a sentence with its key."""
    reasons = Counter(each.reason for each in drawn)
    reason, times = reasons.most_common(1)[0]
    if times > len(drawn) / 2 and _KEY.match(reason):
        # What is wrong with the target itself is wrong with every body.
        return reason
    first = {each.layout: each.reason for each in reversed(drawn)}
    shown = "; ".join(f"{layout}: {why}" for layout, why in list(reversed(first.items()))[:2])
    return (
        f"space: no body was found that fits into it in {len(drawn)} draws; make the space larger, limits.wall or the "
        f"loads smaller, or try more --candidates ({shown})"
    )


def draw_candidate(target: Target, layout: Layout, name: str, numbers: Iterator[float]) -> Candidate:
    """Draw a candidate of a layout.

    Parameters
    ----------
    target, layout : what is asked, and the layout.
    name : of the candidate.
    numbers : in [0, 1), by which choices are made; where a body does not fit, the next ones.
    """
    draws, reason = Draws(numbers), ""
    for _ in range(REDRAWS):
        rubber = draws.one_of(target.material)
        level = draws.between(0.45, 0.75)
        try:
            drawn = layout.draw(target, draws)
            symmetries = [each for each in drawn.symmetries if all(map(target.mirrored, each.get("mirror", ())))]
            problem = _with_most_symmetry(_content(target, rubber, drawn, level), symmetries)
            if words := buckles(problem):
                raise NoRoom(words)
        except (NoRoom, ProblemError) as error:
            reason = str(error)
            continue
        named = f"{rubber.name}, " if len(target.material) > 1 and rubber.name else ""
        return Candidate(name, layout.name, named + drawn.words, problem)
    return Candidate(name, layout.name, "", None, reason)


def _with_most_symmetry(content: dict[str, Any], symmetries: Sequence[Mapping[str, Any]]) -> Problem:
    """The problem with the first of the symmetries that chambers, loads and tasks have too."""
    *more, least = symmetries
    for symmetry in more:
        with suppress(ProblemError):
            return _sound(content | {"body": content["body"] | {"symmetry": symmetry}})
    return _sound(content | {"body": content["body"] | {"symmetry": least}})


def _sound(content: Mapping[str, Any]) -> Problem:
    problem = Problem.model_validate(content)
    build_objectives(problem)
    return problem


def _content(target: Target, rubber: Any, drawn: Drawn, level: float) -> dict[str, Any]:
    """The tables of a problem file, without a symmetry."""
    given = target.model_dump(mode="json", exclude_unset=True)
    content = {key: given[key] for key in ("title", "end_effector", "gravity", "limits") if key in given}
    limits = {"envelope": target.space.envelope} | drawn.tables.get("limits", {}) | content.get("limits", {})
    content |= dict(drawn.tables) | {"material": rubber.model_dump(mode="json", exclude_unset=True), "limits": limits}
    tasks = given["task"]
    highest = SAFE * ballooning(drawn.tables, rubber)
    for table, task in zip(tasks, target.task, strict=True):
        table["pressure"] = {
            name: _pressure(target.pressure, task, place, level, highest) for name, place in drawn.places.items()
        }
    content["task"] = tasks
    content["mesh"] = {"size": f"{COARSE * drawn.radius:.3g} mm"}
    content["optimizer"] = {"step": f"{0.03 * drawn.radius:.2g} mm", "iterations": 1}
    return content


def _pressure(given: PressureRange, task: Wish, place: np.ndarray, level: float, highest: float) -> dict[str, str]:
    """Free pressure of a chamber, which starts higher on the side from which the task bends the body.

    Parameters
    ----------
    given : the pressures that chambers may have.
    task, place : the task, and where the chamber is.
    level : where in that range it starts.
    highest : at which it starts at most, MPa.
    """
    towards, least, most = task.towards, given.min, given.max
    share = level
    if towards is not None and np.any(place):
        share = level * (0.5 - 0.5 * float(place @ towards))
    start = max(least, min(least + share * (most - least), highest))
    return {key: f"{1e3 * value:.5g} kPa" for key, value in (("start", start), ("min", least), ("max", most))}
