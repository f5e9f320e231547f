"""What the first use costs: processor time and memory of commands with nothing compiled before, and again.

    python benchmarks/first_use.py

Each command runs in a process of its own, first with empty folders for compiled kernels, then once more. The last two
are rubbers of other kinds, with the kernels of the commands before at hand.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NEW = ("Ecoflex 00-30", "Elastosil M4601")


def main() -> None:
    small = (ROOT / "examples" / "small.toml").read_text()
    print("| command | first, CPU s | again, CPU s | peak, MB |")
    print("|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        commands = {
            "`--help`": ["--help"],
            "`check examples/linear.toml`": ["check", str(ROOT / "examples" / "linear.toml")],
        }
        finer = place / "thousand.toml"
        finer.write_text(small.replace('"5 mm"', '"2.6 mm"'))
        commands["`design`, about 1000 elements, 2 designs"] = ["design", str(finer), "--out", "OUT"]
        for name in NEW:
            changed = place / f"{name}.toml"
            changed.write_text(small.replace("Hei-Cast 8400", name).replace("60 kPa", "1 kPa"))
            commands[f"`simulate`, a rubber of another model ({name})"] = ["simulate", str(changed), "--quiet"]
        environment = os.environ | {
            "PNEUMORPH_CACHE": str(place / "jax"),
            "NUMBA_CACHE_DIR": str(place / "numba"),
            "XDG_CONFIG_HOME": str(place / "configuration"),
        }
        for label, command in commands.items():
            spent = []
            for out in ("first", "again"):
                given = [str(place / out) if word == "OUT" else word for word in command]
                spent.append(measured([sys.executable, "-m", "pneumorph", *given], environment))
            (first, peak), (again, _) = spent
            print(f"| {label} | {first:.1f} | {again:.1f} | {peak:.0f} |", flush=True)


def measured(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """CPU seconds of a command with its processes, and its own peak memory in MB."""
    running = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    assert running.stderr is not None
    said = running.stderr.read()
    _, status, used = os.wait4(running.pid, 0)
    if os.waitstatus_to_exitcode(status):
        sys.exit(said)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


if __name__ == "__main__":
    main()
