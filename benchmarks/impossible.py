"""Whether what `propose` refuses before a mesh is made cannot be done indeed.

    python benchmarks/impossible.py runs/impossible --count 20

Targets are drawn at random, and a spring or load is made up to one and a half times as large as the smallest that is
refused. Bodies are designed for the motion all the same, from pressures near the largest, and what they reach is
compared with what was stated. Nothing is refused of a rubber whose largest stretch is not known: such targets are
passed over. With --layouts, those that are left out for a twist are designed for it.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from targets import drawn

from pneumorph.optimize.settings import LoopSettings
from pneumorph.proposals import Target
from pneumorph.proposals.candidates import draw_candidate, suited
from pneumorph.proposals.estimates import impossible
from pneumorph.proposals.layouts import LAYOUTS, Layout
from pneumorph.proposals.search import member
from pneumorph.run import open_run
from pneumorph.study.members import run_member

KINDS = {
    "extension": ("axial", "N/mm", "mm"),
    "shift_x": ("shift_x", "N/mm", "mm"),
    "bending_y": ("bending_y", "N*mm/rad", "deg"),
    "twist": ("torsion", "N*mm/rad", "deg"),
}
"""The spring against each motion, its unit, and that of the motion."""

MOST = 1e6
"""The largest force or moment against a motion, N or N·mm."""


def with_load(content: Mapping[str, Any], motion: str, stated: float, size: float, spring: bool) -> dict[str, Any]:
    """A target that states a motion against a spring, or against a load of so many N or N·mm."""
    name, of_spring, unit = KINDS[motion]
    amount = stated if unit == "mm" else np.radians(stated)
    if spring:
        tip: dict[str, Any] = {"spring": {name: f"{size / amount:.6g} {of_spring}"}}
    elif unit == "mm":
        tip = {"force": [f"{-size:.6g} N" if each == motion else "0 N" for each in ("shift_x", "", "extension")]}
    else:
        turns = ("", "bending_y", "twist")
        tip = {"moment": [f"{-size:.6g} N*mm" if each == motion else "0 N*mm" for each in turns]}
    task = {"name": "go", "objective": {"kind": "motion", motion: f"{stated:.6g} {unit}"}}
    return {**content, "end_effector": tip, "task": [task]}


def refused(seed: int, index: int) -> tuple[str, float, float, bool, dict[str, Any]] | None:
    """The motion of a target that is refused, what it states, spring or load, which of the two, and its tables.

    None for a target that is never refused.
    """
    rng = np.random.default_rng([seed, index, 1])
    _, content, _ = drawn(seed, index, (40.0, 100.0), ("bend",))
    motion, spring = list(KINDS)[index % len(KINDS)], bool(rng.random() < 0.75)
    length = Target.model_validate(with_load(content, motion, 1.0, 0.0, False)).space.length
    stated = float(rng.uniform(0.05, 0.3) * length if KINDS[motion][2] == "mm" else rng.uniform(10.0, 60.0))
    low, high = 1e-3, MOST
    if not impossible(Target.model_validate(with_load(content, motion, stated, high, spring))):
        return None
    while high > 1.001 * low:
        between = float(np.sqrt(low * high))
        target = Target.model_validate(with_load(content, motion, stated, between, spring))
        low, high = (low, between) if impossible(target) else (between, high)
    size = high * float(rng.uniform(1.0, 1.5))
    return motion, stated, size, spring, with_load(content, motion, stated, size, spring)


def best(target: Target, layout: Layout, number: int, motion: str, designs: int, out: Path) -> float | None:
    """The largest motion (mm or degrees) of the designs of one body; None where none has a state."""
    asked = target.model_dump(mode="json", exclude_unset=True)
    asked["task"] = [{"name": "go", "objective": {"motion": motion}}]
    name = f"{number:02d}-{layout.name}"
    rng = np.random.default_rng([1, number])
    candidate = draw_candidate(Target.model_validate(asked), layout, name, iter(rng.random, None))
    if candidate.problem is None:
        return None
    each = member(name, candidate.problem, designs)
    run_member(name, each.problem, str(out / name), lambda *_: None, False, None, LoopSettings(seconds=300.0))
    [task] = candidate.problem.task
    history = open_run(out / name).history() if (out / name / "problem.toml").exists() else []
    return max((task.objective.achieved(entry.tasks["go"]).value for entry in history), default=None)


def loads(asked: argparse.Namespace) -> None:
    """Print what bodies reach against springs and loads that are refused."""
    shares = []
    print("| target | stated | refused with | reached, best body |", "|---|---|---|---|", sep="\n")
    for index in range(asked.count):
        drawn_one = refused(asked.seed, index)
        if drawn_one is None:
            continue
        motion, stated, size, spring, content = drawn_one
        unit, target = KINDS[motion][2], Target.model_validate(content)
        layouts = suited(target)[0][: asked.bodies]
        found = [
            best(target, each, k, motion, asked.designs, asked.out / f"{index:03d}") for k, each in enumerate(layouts)
        ]
        reached = [each for each in found if each is not None]
        shares += [max(reached) / stated] if reached else []
        told = f"{max(reached):.3g} {unit}" if reached else "no state"
        against = f"{size:.3g} {'N' if unit == 'mm' else 'N·mm'}, {'spring' if spring else 'load'}"
        print(f"| {motion} | {stated:.3g} {unit} | {against} | {told} |", flush=True)
    if shares:
        most, middle = max(shares), statistics.median(shares)
        print(f"\nOf what was stated at most {100 * most:.2g} %, in the median {100 * middle:.2g} %, was reached.")


def layouts(asked: argparse.Namespace) -> None:
    """Print how far layouts twist that are left out for a twist, and threads beside them."""
    _, content, _ = drawn(asked.seed, 0, (40.0, 100.0), ("twist",))
    target = Target.model_validate({**content, "task": [{"name": "go", "objective": {"motion": "twist"}}]})
    out = suited(target)[1]
    for number, layout in enumerate(LAYOUTS):
        if layout.name in ("wound", "helix", "sheet"):
            continue
        found = best(target, layout, number, "twist", asked.designs, asked.out / "layouts")
        word = "left out" if layout.name in out else "tried"
        print(f"{layout.name} ({word}): {'no body or state' if found is None else f'{found:.4g}°'}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bodies", type=int, default=2, help="layouts that are designed for each target")
    parser.add_argument("--designs", type=int, default=3)
    parser.add_argument("--layouts", action="store_true")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    layouts(asked) if asked.layouts else loads(asked)


if __name__ == "__main__":
    main()
