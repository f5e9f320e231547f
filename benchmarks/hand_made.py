"""`propose` against ten starts as one would set them by hand, on the tasks of the ten examples.

    python benchmarks/hand_made.py runs/hand_made

Of each example its rubber, tasks, loads, limits, largest pressure, length and envelope are taken. A start by hand is
the example's own body with what a person chooses drawn at random: radius, chambers' size and, where bodies bend, place,
how many there are in a row, and ripples or threads with their sense. Ten of them are designed for a few designs. Then
`propose` gets as much processor time as all ten took, of this process, without Netgen's. Its candidates are designed on
meshes made by the same rule, its proposals on finer ones. Everything is kept in the folder; the same command goes on.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
import tomllib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from targets import searched

from pneumorph.errors import ProblemError
from pneumorph.objective import build_objectives
from pneumorph.optimize.settings import LoopSettings
from pneumorph.problem import Problem
from pneumorph.proposals import Plan
from pneumorph.proposals.candidates import COARSE
from pneumorph.run import open_run
from pneumorph.study.members import run_member

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = (
    *("linear", "linear_spring", "bending", "bending_spring", "twisting", "twisting_spring"),
    *("arm_planar", "arm_spatial", "arm_series", "arm_parallel"),
)

STARTS = 10


def in_mm(text: str) -> float:
    return float(text.removesuffix(" mm"))


def mm(value: float) -> str:
    return f"{round(value, 3) + 0.0:g} mm"


def start(example: dict[str, Any], rng: np.random.Generator, designs: int) -> tuple[str, Problem]:
    """A start by hand, in words and as a problem.

    Raises
    ------
    ProblemError
        If what was drawn does not fit together.
    """
    body, limits = dict(example["body"]), example["limits"]
    envelope, wall = in_mm(limits["envelope"]["radius"]), in_mm(limits["wall"])
    radius = rng.uniform(0.55, 0.9) * envelope
    words = [f"radius {radius:.3g} mm"]
    if len(body["chamber"]) == 1 or in_mm(body["chamber"][0]["center"][0]) == 0.0:
        chambers = _along(example, rng, radius - wall, words)
    else:
        chambers = _around(example, rng, radius, wall, words)
    body |= {"radius": mm(radius), "chamber": chambers, "control_density": f"{3.0 / radius:.3g} /mm"}
    if (ripple := example["body"].get("ripple")) is not None:
        body |= _rippled(ripple, body, rng, words)
    tasks = [dict(task) for task in example["task"]]
    for task in tasks:
        [given, *_] = task["pressure"].values()
        task["pressure"] = {chamber["name"]: given for chamber in chambers}
    changed = {
        "body": body,
        "task": tasks,
        "mesh": {"size": mm(COARSE * radius)},
        "optimizer": {"step": f"{0.03 * radius:.2g} mm", "iterations": designs},
    }
    problem = Problem.model_validate(example | changed)
    build_objectives(problem)
    return ", ".join(words), problem


def _along(example: dict[str, Any], rng: np.random.Generator, room: float, words: list[str]) -> list[dict[str, Any]]:
    """One chamber along the body or several in a row; one that is to bend it may lie beside the axis."""
    old, length = example["body"]["chamber"], in_mm(example["body"]["length"])
    count = 1 if len(old) == 1 else int(rng.integers(2, 5))
    motions = {task["objective"].get("motion", "bending_y") for task in example["task"]}
    off = rng.uniform(0.0, 0.4) * room if motions == {"bending_y"} and rng.random() < 0.5 else 0.0
    radius = rng.uniform(0.5, 0.85) * (room - off)
    words.append(f"chamber {radius:.3g} mm" + f", {off:.2g} mm beside the axis" * (off > 0.0))
    if count > 1:
        words.append(f"{count} in a row")
    wall, each = 3.0, (length - 3.0 * (count + 1)) / count
    ends = [(wall + k * (each + wall), wall + k * (each + wall) + each) for k in range(count)]
    return [
        {"name": "ABCD"[k], "radius": mm(radius), "center": [mm(-off), "0 mm"], "span": [mm(low), mm(high)]}
        for k, (low, high) in enumerate(ends)
    ]


def _around(
    example: dict[str, Any], rng: np.random.Generator, radius: float, wall: float, words: list[str]
) -> list[dict[str, Any]]:
    """The example's chambers around the axis, of another size and distance from it, and more or less twisted."""
    largest = ((radius - wall) * np.sin(np.pi / 4) - 0.5 * wall) / (1.0 + np.sin(np.pi / 4))
    inner = rng.uniform(0.7, 0.95) * largest
    away = (radius - wall - inner) / np.sqrt(2.0)
    period, sense = float(rng.choice([30.0, 40.0, 60.0])), int(rng.choice([-1, 1]))
    words.append(f"4 chambers of {inner:.3g} mm, twisted once in {period:g} mm, sense {sense}")
    chambers = []
    for chamber in example["body"]["chamber"]:
        x, y = (mm(np.sign(in_mm(each)) * away) for each in chamber["center"])
        ripple = chamber["ripple"] | {"period": mm(period), "lobes": sense * chamber["ripple"]["lobes"]}
        chambers.append(chamber | {"radius": mm(inner), "center": [x, y], "ripple": ripple})
    return chambers


def _rippled(
    ripple: dict[str, Any], body: dict[str, Any], rng: np.random.Generator, words: list[str]
) -> dict[str, Any]:
    """Rings of another distance or none; or threads of another number, sense and pitch, with the symmetry of both."""
    if "lobes" in ripple:
        lobes, sense, period = int(rng.integers(2, 5)), int(rng.choice([-1, 1])), float(rng.choice([20.0, 40.0, 80.0]))
        words.append(f"{lobes} threads of {period:g} mm, {'right' if sense > 0 else 'left'}-handed")
        return {
            "ripple": ripple | {"period": mm(period), "lobes": sense * lobes},
            "symmetry": body["symmetry"] | {"rotation": lobes},
        }
    period = float(rng.choice([0.0, 8.0, 10.0, 16.0, 20.0]))
    words.append(f"rings of {period:g} mm" if period else "plain")
    if not period:
        return {"ripple": None}
    density = max(float(body["control_density"].split()[0]), 5.0 / period)
    return {"ripple": ripple | {"period": mm(period)}, "control_density": f"{density:.3g} /mm"}


def by_hand(example: dict[str, Any], name: str, seed: int, designs: int) -> Iterator[tuple[str, Problem]]:
    """Ten starts; what does not fit together is drawn again, as a person would."""
    for index in range(STARTS):
        rng = np.random.default_rng([seed, NAMES.index(name), index])
        while True:
            try:
                drawn = start(example, rng, designs)
            except ProblemError:
                continue
            yield drawn
            break


def target_of(example: dict[str, Any]) -> dict[str, Any]:
    """The tables of a target that asks for what an example does."""
    limits = dict(example["limits"])
    envelope = limits.pop("envelope")
    problem = Problem.model_validate(example)
    most = max(each.max for task in problem.task for each in task.pressure.values())
    return {
        **{key: example[key] for key in ("material", "end_effector", "gravity") if key in example},
        "space": {"length": example["body"]["length"], "radius": envelope["radius"]},
        "pressure": {"max": f"{1e3 * most:g} kPa"},
        "limits": limits,
        "task": [{key: value for key, value in task.items() if key != "pressure"} for task in example["task"]],
    }


def ended(folder: Path) -> dict[str, Any]:
    """The last design of a run that satisfies the limits: its objective, and what it does in each task."""
    history = open_run(folder).history() if (folder / "problem.toml").exists() else []
    kept = [entry for entry in history if entry.held]
    if not kept:
        return {"objective": None}
    tasks = open_run(folder).problem.task
    return {
        "objective": kept[-1].objective,
        "does": ", ".join(str(each.objective.achieved(kept[-1].tasks[each.name])) for each in tasks),
        "designs": kept[-1].iteration,
    }


def designed(name: str, example: dict[str, Any], asked: argparse.Namespace) -> dict[str, Any]:
    """Ten starts by hand with what became of them, and their seconds."""
    began, starts = time.time(), []
    for index, (words, problem) in enumerate(by_hand(example, name, asked.seed, asked.designs)):
        path, own = asked.out / name / f"hand-{index}", LoopSettings(seconds=asked.seconds)
        end = run_member(str(index), problem, str(path), lambda *_: None, False, None, own)
        starts.append({"start": words, **ended(path), "end": end.reason})
        print(name, json.dumps(starts[-1], ensure_ascii=False), flush=True)
    return {"starts": starts, "seconds": time.time() - began}


def proposed(name: str, example: dict[str, Any], seconds: float, asked: argparse.Namespace) -> dict[str, Any]:
    """What `propose` finds in so many seconds, and its own."""
    plan = Plan(asked.candidates, asked.seed, seconds / 60.0, (2, asked.designs), asked.designs)
    began = time.time()
    found = searched(target_of(example), asked.out / name / "propose", plan)
    row: dict[str, Any] = {"seconds of propose": time.time() - began}
    if found is None or found.run is None:
        return row | {"proposed": {"objective": None}}
    return row | {"proposed": {"run": found.run.name, "words": found.candidate.words, **ended(found.run)}}


def compared(name: str, asked: argparse.Namespace) -> dict[str, Any]:
    """Ten starts by hand and what `propose` finds in their time."""
    example = tomllib.loads((EXAMPLES / f"{name}.toml").read_text())
    row = kept(asked.out / name / "starts.json", lambda: designed(name, example, asked))
    return {"example": name, **row, **proposed(name, example, row["seconds"], asked)}


def kept(path: Path, found: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What is in a file, which is written where it is not there."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(found(), indent=1, ensure_ascii=False))
    return json.loads(path.read_text())


def table(rows: list[dict[str, Any]]) -> None:
    """Print for each example the median and the best of the starts, and what the search proposes."""
    print("| example | median of ten | best of ten | without a design | proposed | its body | seconds, both |")
    print("|---|---|---|---|---|---|---|")
    won = 0
    for row in rows:
        every = [np.inf if each["objective"] is None else each["objective"] for each in row["starts"]]
        low, high = statistics.median_low(every), statistics.median_high(every)
        best, found = min(every), row["proposed"]
        does = dict(zip(every, (each.get("does", "none") for each in row["starts"]), strict=True))
        ahead = found["objective"] is not None and found["objective"] < low
        won += ahead
        body = f"{found['run']}: {found['words']}" if "run" in found else "none"
        print(
            f"| {row['example']} | {does[high]} to {does[low]} | {does[best]} | "
            f"{sum(np.isinf(every))} | {found.get('does', 'none')}{'' if ahead else ' (behind)'} | {body} | "
            f"{row['seconds']:.0f}, {row['seconds of propose']:.0f} |"
        )
    print(f"\nAhead of both middle ones in {won} of {len(rows)}.")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--examples", nargs="+", choices=NAMES, default=list(NAMES))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--designs", type=int, default=6, help="of each start, candidate and proposal")
    parser.add_argument("--candidates", type=int, default=18)
    parser.add_argument("--seconds", type=float, default=60.0, help="that a start may take at most")
    asked = parser.parse_args()
    # All times are of the processor, those that a search keeps to as well: they do not depend on what else is running.
    time.time = time.process_time
    table([kept(asked.out / f"{name}.json", partial(compared, name, asked)) for name in asked.examples])


if __name__ == "__main__":
    main()
