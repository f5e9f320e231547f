"""Compare the default sub-problem with the paper's (DFP with penalties) on the linear actuator.

    python benchmarks/methods.py [designs]

It prints objective, limits, and seconds in the sub-problem after every design.
"""

import sys
from pathlib import Path
from statistics import median

from pneumorph.optimize import DesignAccepted, DesignRejected, design
from pneumorph.problem import load

EXAMPLE = Path(__file__).parents[1] / "examples" / "linear.toml"


def main() -> None:
    designs = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    print(
        f"{'method':>7s} {'design':>6s} {'mm':>7s} {'wall':>6s} {'fold':>6s} {'h1':>6s} {'h2':>6s} {'h3':>6s} "
        f"{'evaluations':>11s} {'sub-problem s':>13s}"
    )
    for method in ("sqp", "dfp"):
        changes = {"optimizer.method": method, "optimizer.iterations": designs, "mesh.size": "3 mm"}
        seconds = []
        for event in design(load(EXAMPLE).with_changes(changes)):
            if isinstance(event, DesignRejected):
                print(f"{method:>7s} {event.iteration:6d} rejected: {event.reason}", flush=True)
            if isinstance(event, DesignAccepted) and 0 < event.iteration <= designs:
                line, limits = event.entry, event.entry.limits
                seconds.append(line.seconds["subproblem"])
                print(
                    f"{method:>7s} {event.iteration:6d} {-line.objective:7.3f} "
                    f"{limits['wall_mm']:6.3f} {limits['fold_mm']:6.3f} "
                    f"{limits['curvature']:6.3f} {limits['skew']:6.3f} {limits['stretch']:6.3f} "
                    f"{line.evaluations:11d} {seconds[-1]:13.2f}",
                    flush=True,
                )
        print(f"{method}: median {median(seconds):.2f} s in the sub-problem")


if __name__ == "__main__":
    main()
