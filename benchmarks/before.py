"""An earlier version beside this one: the same designs, and commands with nothing compiled before.

    python benchmarks/before.py COMMIT [--designs N]

The commit is taken out of the repository into a temporary folder and run by the same Python and libraries, each of its
examples first by it and then by this version, on one thread. `linear, denser` has about as many coordinates of control
points as the paper has "control points". Kernels are compiled by a run of two designs before; the last designs of both
are those with the same number.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from first_use import measured

ROOT = Path(__file__).resolve().parents[1]
COMMAND = [sys.executable, "-c", "from pneumorph.cli import app; app()"]
"""The command as every version has it."""

THREADS = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
DENSER = (r"control_density = .*", 'control_density = "0.85 /mm"')
CASES = {
    "linear": ("linear", ()),
    "linear, denser": ("linear", DENSER),
    "bending": ("bending", ()),
    "arm_planar": ("arm_planar", ()),
}


def main(commit: str, designs: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        place, old = Path(folder), Path(folder) / "old"
        git = ["git", "-C", str(ROOT)]
        subprocess.run([*git, "worktree", "add", "--detach", "--quiet", str(old), commit], check=True)
        try:
            print(f"| first {designs} designs | s a design | median equivalents | factorisations | last objective |")
            print("|---|---|---|---|---|")
            for case, (name, change) in CASES.items():
                read = (old / "examples" / f"{name}.toml").read_text()
                text = re.sub(*change, read) if change else read
                found = [designed(tree, place, f"{case} {tree.name}", text, designs) for tree in (old, ROOT)]
                print(f"| {case} | {' | '.join(' → '.join(pair) for pair in zip(*found, strict=True))} |", flush=True)
            print("\n| command | first, CPU s | again, CPU s | peak, MB |\n|---|---|---|---|")
            for words in (["--help"], ["check", "examples/linear.toml"]):
                used = [twice(tree, place / f"empty {words[0]} {tree.name}", words) for tree in (old, ROOT)]
                print(f"| `{' '.join(words)}` | {' | '.join(' → '.join(pair) for pair in zip(*used, strict=True))} |")
        finally:
            subprocess.run([*git, "worktree", "remove", "--force", str(old)], check=True)


def designed(tree: Path, place: Path, label: str, text: str, designs: int) -> tuple[str, str, str, str]:
    """Seconds and equivalents of a design of a problem by a version, all factorisations, and its last objective."""
    for count, out in ((2, place / f"{label} compiling"), (designs, place / label)):
        file = place / f"{label}.toml"
        file.write_text("\n".join(limited(text.splitlines(), count)) + "\n")
        command = [*COMMAND, "design", str(file), "--out", str(out)]
        subprocess.run(command, env=environment(tree, place / tree.name), stdout=subprocess.DEVNULL, check=True)
    lines = [json.loads(line) for line in (place / label / "history.jsonl").read_text().splitlines()]
    steps = lines[1:]
    return (
        f"{sum(line['seconds']['total'] for line in steps) / len(steps):.1f}",
        f"{median(line['equivalents'] for line in steps):.1f}",
        str(sum(line["factorisations"] for line in lines)),
        f"{lines[-1]['objective']:.3f}",
    )


def limited(lines: list[str], designs: int) -> list[str]:
    """A problem file with another number of designs."""
    return [f"iterations = {designs}" if line.startswith("iterations") else line for line in lines]


def twice(tree: Path, cache: Path, words: list[str]) -> tuple[str, str, str]:
    """CPU seconds of a command with empty folders for kernels, the same again, and the first one's memory."""
    command = [*COMMAND, *(str(tree / word) if "/" in word else word for word in words)]
    (first, peak), (again, _) = (measured(command, environment(tree, cache)) for _ in range(2))
    return f"{first:.1f}", f"{again:.1f}", f"{peak:.0f}"


def environment(tree: Path, cache: Path) -> dict[str, str]:
    """That of a version on one thread, with its own folders for what is compiled."""
    places = {"PNEUMORPH_CACHE": str(cache / "jax"), "NUMBA_CACHE_DIR": str(cache / "numba")}
    return os.environ | THREADS | places | {"PYTHONPATH": str(tree / "src")}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("--designs", type=int, default=8)
    asked = parser.parse_args()
    main(asked.commit, asked.designs)
