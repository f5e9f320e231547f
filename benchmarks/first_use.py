"""What the first use costs: processor time and memory of commands with nothing compiled before, and again.

    python benchmarks/first_use.py

Each command runs in a process of its own: first with empty folders for compiled kernels, each command with those of
the commands before it; then after `pneumorph warm-up` in other empty folders; then once more. The last two are rubbers
of other kinds.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NEW = ("Ecoflex 00-30", "Elastosil M4601")
ROW = re.compile(r"\s*1\s+\S+ mm ")
"""The line that a design run prints for its first new design."""


def main() -> None:
    small = (ROOT / "examples" / "small.toml").read_text()
    linear = str(ROOT / "examples" / "linear.toml")
    print("| command | first, CPU s | after warm-up | again | peak, MB |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        commands = {
            "`--help`": ["--help"],
            "`check examples/linear.toml --quick`": ["check", linear, "--quick"],
            "`check examples/linear.toml`": ["check", linear],
            "`design examples/linear.toml`, until its first design": ["design", linear, "--out", "OUT"],
        }
        finer = place / "thousand.toml"
        finer.write_text(small.replace('"5 mm"', '"2.6 mm"'))
        commands["`design`, about 1000 elements, 2 designs"] = ["design", str(finer), "--out", "OUT"]
        for name in NEW:
            changed = place / f"{name}.toml"
            changed.write_text(small.replace("Hei-Cast 8400", name).replace("60 kPa", "1 kPa"))
            commands[f"`simulate`, a rubber of another model ({name})"] = ["simulate", str(changed), "--quiet"]
        warmed = measured(["warm-up"], kept_in(place / "warmed"))[0]
        for label, command in commands.items():
            spent = []
            for out, kept in (("first", "empty"), ("after", "warmed"), ("again", "empty")):
                given = [str(place / out / label) if word == "OUT" else word for word in command]
                spent.append(measured(given, kept_in(place / kept), until=ROW if "until" in label else None))
            (first, peak), (after, _), (again, _) = spent
            print(f"| {label} | {first:.1f} | {after:.1f} | {again:.1f} | {peak:.0f} |", flush=True)
        print(f"| `warm-up` | {warmed:.1f} | | | |")


def kept_in(place: Path) -> dict[str, str]:
    """The environment of a command whose kernels are kept in a folder."""
    folders = {"PNEUMORPH_CACHE": "jax", "NUMBA_CACHE_DIR": "numba", "XDG_CONFIG_HOME": "configuration"}
    return os.environ | {name: str(place / folder) for name, folder in folders.items()}


def measured(words: list[str], environment: dict[str, str], until: re.Pattern | None = None) -> tuple[float, float]:
    """CPU seconds of a command with the processes it has ended, and its own peak memory in MB; up to a line of it."""
    command = [sys.executable, "-m", "pneumorph", *words]
    with tempfile.TemporaryFile("w+") as said:
        running = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=said, text=True)
        assert running.stdout is not None
        reached = any(until is not None and until.match(line) for line in running.stdout)
        if reached:
            running.kill()
        _, status, used = os.wait4(running.pid, 0)
        if os.waitstatus_to_exitcode(status) and not reached:
            said.seek(0)
            sys.exit(said.read())
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


if __name__ == "__main__":
    main()
