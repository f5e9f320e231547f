"""A design of the linear actuator, as a whole, with the paper's number of variables and twice as many.

    python benchmarks/denser.py OUT

Ten designs each in the folder OUT; what is finished there is not run again. Prints what `iteration.py` prints.
"""

import sys
from pathlib import Path

from iteration import table
from paper_size import EXAMPLES, designed

from pneumorph.problem import load

DENSITIES, DESIGNS = {"13582 variables": 0.86, "28116 variables": 1.244}, 10
"""Control points per mm, by what it leads to, and how many designs."""


def main(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    problem = load(EXAMPLES / "linear.toml").with_changes({"body.symmetry": False})
    optimizer = problem.optimizer.model_copy(update={"iterations": DESIGNS})
    for name, density in DENSITIES.items():
        run, body = out / name, problem.body.model_copy(update={"control_density": density})
        if not (run / "result.json").exists():
            designed(problem.model_copy(update={"body": body, "optimizer": optimizer}).to_toml(), run)
        table(str(run))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
