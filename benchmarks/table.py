"""A Markdown table of runs with the values of the paper's Table II in brackets.

    python benchmarks/table.py RUN [RUN …]

Every RUN is a run directory with the name of its example (bending_spring, arm_planar, …).
"""

import sys
from pathlib import Path
from statistics import median

from pneumorph.output.format import format_duration, motion_of
from pneumorph.run import open_run

PAPER = {
    "linear": (13650, 14, "21:27 min"),
    "linear_spring": (13650, 13, "18:31 min"),
    "bending": (16338, 39, "2:36 h"),
    "bending_spring": (16338, 33, "1:22 h"),
    "twisting": (10962, 35, "2:56 h"),
    "twisting_spring": (10962, 28, "1:21 h"),
    "arm_planar": (20205, 14, "31:47 min"),
    "arm_spatial": (20205, 30, "1:37 h"),
    "arm_series": (12464, 36, "2:21 h"),
    "arm_parallel": (25184, 38, "5:59 h"),
}
"""Control points, iterations and total time in the paper, on 16 cores."""

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
    points, designs, spent = PAPER.get(path.name, ("–", "–", "–"))
    body = run.load_design(last.iteration).body(problem)
    seconds = sum(line.seconds["total"] for line in history)
    cost = median(line.equivalents for line in history[1:])
    motions = "; ".join(
        f"{task.name}: {motion_of(task, history[0].tasks[task.name])} → {motion_of(task, last.tasks[task.name])}"
        for task in problem.task
    )
    held = "all limits held" if last.held else "not every limit is held"
    steady = "stable" if all(found.stable for found in last.tasks.values()) else "not stable"
    cells = [
        path.name,
        f"{body.n_points} ({points})",
        f"{last.iteration} ({designs})",
        f"{format_duration(seconds)} ({spent})",
        str(sum(line.factorisations for line in history)),
        f"{cost:.1f}",
        str(last.elements),
        f"{motions}; {held}, {steady}",
    ]
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    print(f"| {' | '.join(HEAD)} |")
    print("|" + "---|" * len(HEAD))
    for name in sys.argv[1:]:
        print(row(Path(name)))
