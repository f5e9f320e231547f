"""The paper's ten cases at its size, timed as its Table II is.

    python benchmarks/paper_size.py OUT [CASE …]

Each case is an example of the same name with so dense control points that their coordinates are as many as the paper's
"control points". Cases are run one after another in the folder OUT; what is finished there is not run again. Prints a
Markdown table with the paper's values, on 16 cores, in brackets, and after how many designs and how long a run is as
good as the paper's text says of its own.
"""

import subprocess
import sys
from pathlib import Path

from table import PAPER, Printed, outcome

from pneumorph.geometry.tube import build_design_space, starting_body
from pneumorph.output.format import format_duration
from pneumorph.problem import load
from pneumorph.results import HistoryEntry
from pneumorph.run import open_run

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
FINER = 0.004
"""Step in which the density is raised, 1/mm."""

HEAD = (
    "case",
    "coordinates (paper)",
    "variables",
    "designs (paper)",
    "time (paper)",
    "paper's time over ours",
    "as good as the paper after",
    "s a design (paper)",
    "geometry, FEA, optimisation, % (paper)",
    "factorisations",
    "result",
)


def main(out: Path, names: list[str]) -> None:
    out.mkdir(parents=True, exist_ok=True)
    print(f"| {' | '.join(HEAD)} |")
    print("|" + "---|" * len(HEAD))
    for name in names or PAPER:
        run = out / name
        if not (run / "result.json").exists():
            designed(of_size(name), run)
        print(row(run), flush=True)


def designed(problem: str, run: Path) -> None:
    """Design a problem, whose file is stored beside its run."""
    file = run.with_suffix(".toml")
    file.write_text(problem)
    command = [sys.executable, "-m", "pneumorph", "design", str(file), "--out", str(run), "--quiet"]
    ended = subprocess.run(command, stdout=sys.stderr)
    if ended.returncode not in (0, 3):  # 3: a target was not reached
        raise SystemExit(f"{run.name} ended with status {ended.returncode}")


def of_size(name: str) -> str:
    """The problem file of a case, with the least density of control points that gives as many coordinates."""
    problem, density = load(EXAMPLES / f"{name}.toml"), 0.5
    while True:
        body = problem.body.model_copy(update={"control_density": density})
        if 3 * starting_body(body).n_points >= PAPER[name].points:
            break
        density += FINER
    return problem.model_copy(update={"body": body}).to_toml()


def row(path: Path) -> str:
    """The line of a finished case."""
    run, paper = open_run(path), PAPER[path.name]
    history, body = run.history(), starting_body(run.problem.tubes)
    seconds = {phase: sum(line.seconds[phase] for line in history) for phase in history[0].seconds}
    spent, designs = seconds["total"], history[-1].iteration
    solving = seconds["equilibrium"] + seconds["gradient"]
    shares = (100 * part / spent for part in (seconds["geometry"], solving, seconds["subproblem"]))
    cells = [
        path.name,
        f"{3 * body.n_points} ({paper.points})",
        str(build_design_space(run.problem, body).n),
        f"{designs} ({paper.designs})",
        f"{format_duration(spent)} ({format_duration(paper.seconds)})",
        f"{paper.seconds / spent:.0f}",
        overtaken(history, paper),
        f"{spent / designs:.1f} ({paper.seconds / paper.designs:.0f})",
        f"{', '.join(f'{share:.0f}' for share in shares)} ({', '.join(map(str, paper.shares))})",
        str(sum(line.factorisations for line in history)),
        outcome(run),
    ]
    return f"| {' | '.join(cells)} |"


def overtaken(history: list[HistoryEntry], paper: Printed) -> str:
    """When the motion that the paper's text names was reached: designs, time, and the paper's whole time over it."""
    if paper.reached is None:
        return "–"
    spent = 0.0
    for line in history:
        spent += line.seconds["total"]
        if -line.objective >= paper.reached:
            return f"{line.iteration}, {format_duration(spent)}, {paper.seconds / spent:.0f}"
    return "not reached"


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
