"""Making the starting bodies of the examples: a Markdown table of times, sizes and checks.

    python benchmarks/making.py OUT [EXAMPLE …]

By default of all ten examples. Each is made in a process of its own into OUT/EXAMPLE; CPU seconds include the picture,
which another process draws. The first example also compiles the mechanics if PNEUMORPH_CACHE is empty.
"""

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NAMES = (
    "linear",
    "linear_spring",
    "bending",
    "bending_spring",
    "twisting",
    "twisting_spring",
    "arm_planar",
    "arm_spatial",
    "arm_series",
    "arm_parallel",
)
MAKE = """
import sys
from pathlib import Path
from pneumorph import load, starting_design
starting_design(load(sys.argv[1])).make(Path(sys.argv[2]), 0.02)
"""
DISTANCES = "distance of the part's points", "distance of the mould's curved"


def row(name: str, folder: Path) -> str:
    """Make one example."""
    began, before = time.perf_counter(), spent()
    done = subprocess.run(
        [sys.executable, "-c", MAKE, EXAMPLES / f"{name}.toml", folder], capture_output=True, text=True
    )
    wall, cpu = time.perf_counter() - began, spent() - before
    if done.returncode:
        return f"| {name} | {done.stderr.splitlines()[-1]} |"
    checks = json.loads((folder / "checks.json").read_text())["checks"]
    failed = [f"{check['what']} ({check['file']}): {check['value']:.3g}" for check in checks if not check["passed"]]
    away = max(check["value"] for check in checks if check["what"].startswith(DISTANCES))
    room = next(check["value"] for check in checks if check["what"].startswith("volume of the part"))
    effects = [check["value"] for check in checks if check["what"].startswith("change of the motion")]
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6
    cells = (
        name,
        f"{len(checks) - len(failed)} of {len(checks)}",
        f"{away:.3f}",
        f"{room:.0e}",
        f"{100 * max(effects):.2g}",
        f"{cpu:.0f}",
        f"{wall:.0f}",
        f"{size:.0f}",
        "; ".join(failed) or "–",
    )
    return f"| {' | '.join(cells)} |"


def spent() -> float:
    """CPU seconds of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    out, *names = sys.argv[1:]
    print("| example | passed checks | distance, mm | room taken | ports' effect, % | CPU s | s | MB | failed |")
    print(f"|{'---|' * 9}")
    for name in names or NAMES:
        print(row(name, Path(out) / name), flush=True)


if __name__ == "__main__":
    main()
