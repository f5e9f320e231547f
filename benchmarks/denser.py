"""A design of the linear actuator, as a whole, with the paper's number of variables and twice as many.

    python benchmarks/denser.py OUT

Ten designs each in the folder OUT; what is finished there is not run again. Prints what `iteration.py` prints.
"""

import subprocess
import sys
from pathlib import Path

from iteration import table

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "linear.toml"
DENSITIES = {"13582 variables": "0.86", "28116 variables": "1.244"}
"""Control points per mm, by what it leads to."""


def main(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    for name, density in DENSITIES.items():
        run, file = out / name, out / f"{name}.toml"
        if not (run / "result.json").exists():
            text = EXAMPLE.read_text().replace('control_density = "0.6 /mm"', f'control_density = "{density} /mm"')
            file.write_text(text.replace("iterations = 20", "iterations = 10"))
            command = [sys.executable, "-m", "pneumorph", "design", str(file), "--out", str(run), "--quiet"]
            subprocess.run(command, check=True, stdout=sys.stderr)
        table(str(run))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
