"""What a design costs, version by version, as ratios that hardly depend on the machine.

    python benchmarks/ratios.py RUN [RUN …]

Every RUN is the directory of a finished run, with the name of its example. Its ratios are put into ratios.json beside
this file, under the version of pneumorph that the run says it is of, in place of those that are there; the table of all
versions is printed. In the file an example has

- `factorisations` and `equivalents`, medians over its designs (an equivalent is the time of one assembly and
  factorisation of the tangent on the same mesh);
- `shares` of the time of all its designs: geometry, equilibrium, gradient, subproblem.
"""

import json
import sys
from pathlib import Path
from statistics import median

from pneumorph.run import open_run

FILE = Path(__file__).with_suffix(".json")

PHASES = ("geometry", "equilibrium", "gradient", "subproblem")

Ratios = dict[str, dict]


def ratios(path: Path) -> tuple[str, dict]:
    """The version that a run is of, and its ratios."""
    run = open_run(path)
    lines = [line for line in run.history() if line.iteration > 0]
    whole = sum(line.seconds["total"] for line in lines)
    found = {
        "factorisations": median(line.factorisations for line in lines),
        "equivalents": round(median(line.equivalents for line in lines), 1),
        "shares": {phase: round(sum(line.seconds[phase] for line in lines) / whole, 2) for phase in PHASES},
    }
    return str(run.result().versions["pneumorph"]), found


def table(known: dict[str, Ratios]) -> str:
    """Factorisations and equivalents of a design of every example, by version, in Markdown."""
    versions = sorted(known, key=lambda version: [int(part) for part in version.split(".")])
    names = sorted({name for version in versions for name in known[version]})
    rows = [["example", *versions], ["---"] * (1 + len(versions))]
    for name in names:
        cells = (known[version].get(name) for version in versions)
        rows.append([name, *("–" if one is None else _cell(one) for one in cells)])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _cell(one: dict) -> str:
    parts = ", ".join(f"{100 * one['shares'][phase]:.0f}" for phase in PHASES)
    return f"{one['factorisations']:g} / {one['equivalents']:g} ({parts} %)"


def main() -> None:
    known: dict[str, Ratios] = json.loads(FILE.read_text(encoding="utf-8"))
    for name in sys.argv[1:]:
        version, found = ratios(Path(name))
        known.setdefault(version, {})[Path(name).name] = found
    FILE.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    print(table(known))


if __name__ == "__main__":
    main()
