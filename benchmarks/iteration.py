"""Time of the phases of a design iteration: medians over the designs of finished runs, with and without remeshing.

    python benchmarks/iteration.py runs/linear [runs/linear_spring ...]

An equivalent is the time of one assembly and factorisation of the tangent on the same mesh.
"""

import sys
from statistics import median

from pneumorph.run import open_run

PHASES = ("geometry", "equilibrium", "gradient", "subproblem")


def table(path: str) -> None:
    lines = [line for line in open_run(path).history() if line.iteration > 0]
    print(f"{path}: {len(lines)} designs")
    print(
        f"{'':12s} {'designs':>7s} {'factor.':>8s} {'equiv.':>7s} {'total s':>8s} "
        + " ".join(f"{p:>11s}" for p in (*PHASES, "other"))
    )
    for name, chosen in (
        ("all", lines),
        ("same mesh", [line for line in lines if not line.remeshed]),
        ("remeshed", [line for line in lines if line.remeshed]),
    ):
        if not chosen:
            continue
        total = median(line.seconds["total"] for line in chosen)
        parts = [median(line.seconds[phase] for line in chosen) for phase in PHASES]
        other = median(line.seconds["total"] - sum(line.seconds[phase] for phase in PHASES) for line in chosen)
        print(
            f"{name:12s} {len(chosen):7d} {median(line.factorisations for line in chosen):8.1f} "
            f"{median(line.equivalents for line in chosen):7.1f} {total:8.2f} "
            + " ".join(f"{part:11.2f}" for part in (*parts, other))
        )
    spent = {phase: sum(line.seconds[phase] for line in lines) for phase in PHASES}
    whole, limiting = sum(line.seconds["total"] for line in lines), sorted(spent, key=spent.get, reverse=True)
    print("of all time: " + ", ".join(f"{phase} {100 * spent[phase] / whole:.0f} %" for phase in limiting))


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        table(argument)
