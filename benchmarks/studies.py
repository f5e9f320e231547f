"""Efficiency and memory of a study on this machine: eight members by two workers of one thread, and by one of two.

    python benchmarks/studies.py OUT

Members are the small actuator at eight pressures, on a mesh of some thousand elements. Efficiency is the time of the
one worker over that of the two. What is compiled, is compiled before. The memory of a worker is that of two designs of
`linear`, an example at its own size.
"""

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
PRESSURES = (35, 40, 45, 50, 55, 60, 65, 70)
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def main(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    base = out / "base.toml"
    base.write_text(
        (EXAMPLES / "small.toml").read_text().replace('"5 mm"', '"1.6 mm"').replace("iterations = 2", "iterations = 4")
    )
    values = ", ".join(f'"{each} kPa"' for each in PRESSURES)
    study = out / "study.toml"
    study.write_text(f'base = "base.toml"\n[grid]\n"task[0].pressure.A" = [{values}]\n')
    timed(["design", str(base), "--out", str(out / "first")], 2)
    alone = timed(["study", str(study), "--out", str(out / "alone"), "--workers", "1"], 2)
    beside = timed(["study", str(study), "--out", str(out / "beside"), "--workers", "2"], 1)
    larger = (EXAMPLES / "linear.toml").read_text().replace("iterations = 20", "iterations = 2")
    (out / "linear.toml").write_text(larger)
    study.write_text('base = "linear.toml"\n[grid]\n"task[0].pressure.A" = ["60 kPa"]\n')
    timed(["study", str(study), "--out", str(out / "linear"), "--workers", "1"], 1)
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print("| one worker of two threads | two workers of one thread | efficiency | a worker's memory, MB |")
    print("|---|---|---|---|")
    print(f"| {alone:.0f} s | {beside:.0f} s | {alone / beside:.2f} | {memory:.0f} |")


def timed(command: list[str], threads: int) -> float:
    """Seconds of a command whose kernels have so many threads."""
    began = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "pneumorph", *command, "--quiet"],
        env=os.environ | dict.fromkeys(THREADS, str(threads)),
        stdout=subprocess.DEVNULL,
        check=True,
    )
    return time.perf_counter() - began


if __name__ == "__main__":
    main(Path(sys.argv[1]))
