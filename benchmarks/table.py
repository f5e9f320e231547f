"""A Markdown table of runs with the values of the paper's Table II in brackets.

    python benchmarks/table.py RUN [RUN …]

Every RUN is a run directory with the name of its example (bending_spring, arm_planar, …).
"""

import sys
from dataclasses import dataclass
from math import radians
from pathlib import Path
from statistics import median

from pneumorph.output.format import format_duration
from pneumorph.run import RunDirectory, open_run


@dataclass(frozen=True)
class Printed:
    """A column of the paper's Table II, measured on 16 cores: what it calls control points, iterations, total seconds,
    and the shares of geometry, finite elements and optimisation in percent; and what its text says was reached, as the
    motion of the tip in mm or rad, if it says so."""

    points: int
    designs: int
    seconds: int
    shares: tuple[int, int, int]
    reached: float | None = None


PAPER = {
    "linear": Printed(13650, 14, 21 * 60 + 27, (46, 21, 33)),
    # 12.15 N against its spring of 4 N/mm.
    "linear_spring": Printed(13650, 13, 18 * 60 + 31, (44, 20, 36), 12.15 / 4),
    "bending": Printed(16338, 39, 156 * 60, (26, 44, 30)),
    "bending_spring": Printed(16338, 33, 82 * 60 + 6, (40, 30, 30), radians(100)),
    "twisting": Printed(10962, 35, 176 * 60, (18, 37, 45), radians(140)),
    "twisting_spring": Printed(10962, 28, 80 * 60 + 46, (27, 21, 52), radians(85)),
    "arm_planar": Printed(20205, 14, 31 * 60 + 47, (56, 20, 23)),
    "arm_spatial": Printed(20205, 30, 97 * 60 + 19, (49, 35, 15)),
    "arm_series": Printed(12464, 36, 140 * 60 + 40, (24, 66, 10)),
    "arm_parallel": Printed(25184, 38, 358 * 60 + 53, (23, 41, 36)),
}

HEAD = (
    "run",
    "control points (paper)",
    "designs (paper)",
    "time (paper)",
    "factorisations",
    "median equivalents",
    "elements",
    "result",
)


def row(path: Path) -> str:
    run = open_run(path)
    history, problem = run.history(), run.problem
    last = history[-1]
    paper = PAPER.get(path.name)
    points, designs, spent = (
        ("–", "–", "–") if paper is None else (paper.points, paper.designs, format_duration(paper.seconds))
    )
    body = run.load_design(last.iteration).body(problem)
    seconds = sum(line.seconds["total"] for line in history)
    cost = median(line.equivalents for line in history[1:])
    cells = [
        path.name,
        f"{body.n_points} ({points})",
        f"{last.iteration} ({designs})",
        f"{format_duration(seconds)} ({spent})",
        str(sum(line.factorisations for line in history)),
        f"{cost:.1f}",
        str(last.elements),
        outcome(run),
    ]
    return f"| {' | '.join(cells)} |"


def outcome(run: RunDirectory) -> str:
    """The motions of the first and the last design of a run, and whether the last is sound."""
    history = run.history()
    last = history[-1]
    motions = "; ".join(
        f"{task.name}: {' → '.join(str(task.objective.achieved(each.tasks[task.name])) for each in (history[0], last))}"
        for task in run.problem.task
    )
    held = "all limits satisfied" if last.held else "limits violated"
    steady = "stable" if all(found.stable for found in last.tasks.values()) else "not stable"
    return f"{motions}; {held}, {steady}"


if __name__ == "__main__":
    print(f"| {' | '.join(HEAD)} |")
    print("|" + "---|" * len(HEAD))
    for name in sys.argv[1:]:
        print(row(Path(name)))
