"""Success of random problems: designs within their limits, gains, reasons for the end, time, factorisations, meshes.

    python benchmarks/yield.py SEED COUNT [--bodies] [--out DIR] [--jobs 2] [--iterations 10] [--timeout 900]
                               [--only INDEX] [--source OTHER/src] [--measure-again] [--table-only]

Problems 0 to COUNT-1 of SEED (`random_problems.py`, with --bodies `random_bodies.py`) are designed by the command
`pneumorph design`, each in its own process and its own directory; runs that have ended are not repeated. With --source
the command is that of another checkout. The limits of every accepted design are then measured by this checkout,
independently of the run's own report; with --measure-again this is repeated for designs measured before. --table-only
only prints the tables. Seconds include compilation; keep PNEUMORPH_CACHE between runs that are to be compared.

The gain of a run is (J at the start − least J of a design that keeps all limits) over the gain predicted by the
unconstrained first-order model: ITERATIONS steps from the start, each moving every smoothed variable by
`optimizer.step` against the gradient g at the start, ITERATIONS · step · ‖Sᵀg‖₁. Free pressures count up to their
bounds only, and the predicted gain of an objective that cannot be negative (targets) is at most its value at the start.
For bodies from files no gain is predicted.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any

HERE = Path(__file__).resolve()
SOURCE = HERE.parents[1] / "src"
MEASURING = 1800
"""Time limit for measuring a run, seconds."""

RETURNS = {
    "number asked": "the number of designs",
    "settled": "designs together improved",
    "optimal": "the design is optimal",
    "no promise": "promises no more",
    "no step": "no step",
}
TARGETS = ("match_curve", "match_sections", "reach")


# --- running ----------------------------------------------------------------------------------------------------------


def prepare(seed: int, index: int, folder: Path, bodies: bool = False) -> None:
    """Draw a problem, with a body from a CAD file if asked for, and write its files and its description."""
    if (folder / "drawn.json").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    if bodies:
        import random_bodies

        drawn = random_bodies.draw(seed, index)
        drawn.write(folder / "problem.toml")
    else:
        import random_problems

        drawn = random_problems.draw(seed, index)
        (folder / "problem.toml").write_text(drawn.text, encoding="utf-8")
    about = {key: value for key, value in asdict(drawn).items() if key not in ("text", "parts")}
    write(folder / "drawn.json", {"seed": seed, "index": index, **about})


def write(path: Path, content: Any) -> None:
    """Write JSON in one step, so that a file is never incomplete."""
    beside = path.with_suffix(".part")
    beside.write_text(json.dumps(content, indent=1), encoding="utf-8")
    beside.replace(path)


def read(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def environment(source: Path, threads: int) -> dict[str, str]:
    counts = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), str(threads))
    return {**os.environ, **counts, "PYTHONPATH": str(source), "PYTHONUNBUFFERED": "1"}


RUNNING: set[subprocess.Popen] = set()


def stop(*_: Any) -> None:
    """Stop all runs and exit; the same command resumes them later."""
    for process in list(RUNNING):
        os.killpg(process.pid, signal.SIGKILL)
    os._exit(1)


DRAWING = 10
"""Seconds after which a command that has written its result is stopped: then it only draws pictures."""


def call(
    arguments: list[str], env: dict[str, str], log: Path, errors: Path, timeout: float, result: Path | None = None
) -> int | None:
    """Exit status of a command; None if it was stopped at the time limit.

    It is also 0 if the command was stopped after it had written its `result`.
    """
    with log.open("a") as out, errors.open("w") as err:
        process = subprocess.Popen(arguments, env=env, stdout=out, stderr=err, start_new_session=True)
        RUNNING.add(process)
        try:
            return _waited(process, timeout, result)
        finally:
            RUNNING.discard(process)


def _waited(process: subprocess.Popen, timeout: float, result: Path | None) -> int | None:
    end, written = time.monotonic() + timeout, None
    while time.monotonic() < end:
        try:
            return process.wait(1.0)
        except subprocess.TimeoutExpired:
            if result is not None and result.exists():
                written = written or time.monotonic()
                if time.monotonic() > written + DRAWING:
                    break
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return None if written is None else 0


def run(folder: Path, asked: argparse.Namespace) -> None:
    """Design one problem, unless that is done, and store how it ended."""
    if (folder / "outcome.json").exists():
        return
    began = time.perf_counter()
    command = [sys.executable, "-c", "from pneumorph.cli import app; app()", "design", str(folder / "problem.toml")]
    command += ["--out", str(folder / "run"), "--iterations", str(asked.iterations), "--resume"]
    env = environment(asked.source, asked.threads)
    result = folder / "run" / "result.json"
    status = call(command, env, folder / "log.txt", folder / "errors.txt", asked.timeout, result)
    seconds = time.perf_counter() - began
    write(folder / "outcome.json", {**ending(folder, status), "seconds": seconds, "iterations": asked.iterations})


def trust_code(folder: Path) -> None:
    """Have the code of an objective agreed to: it is drawn here, and no command that follows can ask."""
    from pneumorph.problem import load

    load(folder / "problem.toml", trust=True)


def ending(folder: Path, status: int | None) -> dict[str, Any]:
    """How a run ended, as a kind and a reason of one line."""
    errors = (folder / "errors.txt").read_text(encoding="utf-8", errors="replace").strip()
    lines = errors.splitlines() or [""]
    messages = [line.removeprefix("pneumorph: ") for line in lines if line.startswith("pneumorph: ")]
    result = read(folder / "run" / "result.json")
    if status is None:
        return {"end": "without end", "reason": f"stopped after {log_state(folder)}"}
    if "Traceback" in errors:
        return {"end": "traceback", "reason": lines[-1]}
    if status == 0 and result is not None:
        return {"end": "completed", "reason": result["reason"]}
    if status == 1 and messages:
        return {"end": "failed", "reason": messages[-1]}
    if status == 2:
        return {"end": "refused", "reason": (messages or lines)[-1]}
    return {"end": "crashed", "reason": f"exit status {status}: {lines[-1]}"}


def log_state(folder: Path) -> str:
    done = len(history(folder))
    return f"{done - 1} designs" if done else "no design"


# --- measuring --------------------------------------------------------------------------------------------------------


def measure(folder: Path, asked: argparse.Namespace) -> None:
    """Compute the first-order prediction and the limits of every design, in separate processes."""
    env = environment(SOURCE, asked.threads)
    itself = [sys.executable, str(HERE), "--measure", str(folder)]
    if not (asked.bodies or (folder / "prediction.json").exists()):
        log = folder / "prediction.txt"
        if call([*itself, "prediction"], env, log, folder / "prediction_errors.txt", asked.timeout) != 0:
            write(folder / "prediction.json", {"gain": None})
    if asked.measure_again or not (folder / "measured.json").exists():
        log = folder / "measured.txt"
        if call([*itself, "limits"], env, log, folder / "measured_errors.txt", MEASURING) != 0:
            print(f"{folder}: its designs could not be measured, see measured_errors.txt", flush=True)


def predict(folder: Path) -> None:
    """Write prediction.json: the gain per step that the unconstrained first-order model predicts at the start.

    `gain` is that of the shape; `pressures` has, for every free pressure, its gain per step and the number of steps to
    its bound.
    """
    import numpy as np

    from pneumorph.analysis import analyse, design_gradient, discretise
    from pneumorph.geometry.tube.start import starting_body
    from pneumorph.geometry.tube.variables import build_design_space
    from pneumorph.mechanics import NoEquilibrium
    from pneumorph.optimize.smoothing import build_smoothing
    from pneumorph.problem import load

    problem = load(folder / "problem.toml")
    body = starting_body(problem.tubes)
    space = build_design_space(problem, body)
    disc = discretise(problem, body)
    found = analyse(problem, space, disc, space.start)
    if isinstance(found, NoEquilibrium):
        write(folder / "prediction.json", {"gain": None, "reason": found.reason})
        return
    step, shape = problem.optimizer.step, space.n_shape
    slope = build_smoothing(space).transpose(design_gradient(problem, space, disc, found))
    room = np.where(slope > 0, space.start - space.lower, space.upper - space.start)[shape:] / step
    pressures = [[float(step * abs(a)), float(b)] for a, b in zip(slope[shape:], room, strict=True)]
    gain = float(step * np.abs(slope[:shape]).sum())
    write(folder / "prediction.json", {"objective": found.value, "gain": gain, "pressures": pressures})


def measure_limits(folder: Path) -> None:
    """Write measured.json: for every design whether all limits are held, and the excess over each."""
    from pneumorph.limits.of_shape import limits_of, tube_limits
    from pneumorph.run import open_run

    stored = open_run(folder / "run") if (folder / "run" / "problem.toml").exists() else None
    designs = []
    for line in history(folder):
        body, problem = stored.load_design(line["iteration"]).body(stored.problem), stored.problem
        found = (limits_of(problem, body) if problem.solid else tube_limits(body, problem.limits)).certify(body)
        designs.append(
            {
                "iteration": line["iteration"],
                "held": found.satisfied(),
                "violated": [reading.limit for reading in found.violated()],
                "excess": {reading.limit: reading.excess() for reading in found.readings},
            }
        )
    write(folder / "measured.json", designs)


def history(folder: Path) -> list[dict[str, Any]]:
    path = folder / "run" / "history.jsonl"
    if not path.exists():
        return []
    lines = [
        json.loads(line) for line in path.read_text(encoding="utf-8").splitlines(keepends=True) if line[-1] == "\n"
    ]
    return [line for line in lines if (folder / "run" / "designs" / f"{line['iteration']:04d}.npz").exists()]


# --- results of a run -------------------------------------------------------------------------------------------------


def summary(folder: Path) -> dict[str, Any] | None:
    """The numbers of one problem for the tables; None if it has not been run and measured."""
    drawn, outcome, measured = (read(folder / f"{name}.json") for name in ("drawn", "outcome", "measured"))
    if drawn is None or outcome is None or measured is None:
        return None
    lines, later = history(folder), [design for design in measured if design["iteration"] > 0]
    values = {line["iteration"]: line["objective"] for line in lines}
    held = {design["iteration"] for design in measured if design["held"]}
    start = values.get(0)
    best = min((value for number, value in values.items() if number in held and number > 0), default=None)
    gained = start - best if start is not None and best is not None else 0.0
    promised = promise(folder, outcome["iterations"], start)
    # Smaller gains are below the tolerance of the equilibria.
    gains = start is not None and gained > 1e-6 * abs(start)
    words = (folder / "log.txt").read_text(encoding="utf-8", errors="replace") if (folder / "log.txt").exists() else ""
    ended = reason_of(outcome)
    return {
        **drawn,
        "end": outcome["end"],
        "reason": ended,
        "message": outcome["reason"],
        "ran": outcome["seconds"],
        "designs": len(later),
        "held": sum(design["held"] for design in later),
        "start held": bool(measured) and measured[0]["held"],
        "last held": bool(later) and later[-1]["held"],
        "beyond": [(limit, design["excess"][limit]) for design in later for limit in design["violated"]],
        "start": start,
        "best": best,
        "gained": gains,
        "share": max(gained, 0.0) / promised if promised and start is not None else None,
        "seconds": [line["seconds"]["total"] for line in lines if line["iteration"] > 0],
        "same": [line["factorisations"] for line in lines if line["iteration"] > 0 and not line["remeshed"]],
        "after remeshing": [line["factorisations"] for line in lines if line["iteration"] > 0 and line["remeshed"]],
        "remeshes": len(re.findall("meshed anew|remeshed with", words)),
        "taken back": sum(map(taken_back, words.splitlines())),
        "mesh failures": sum(about_mesh(line) for line in words.splitlines() if taken_back(line))
        + (outcome["end"] == "failed" and about_mesh(outcome["reason"])),
    }


def taken_back(line: str) -> bool:
    """Whether a line of the screen says that a trial was rejected; older versions said that a step was taken back."""
    return re.search(r"step taken back|trial \d+ rejected", line) is not None


def about_mesh(line: str) -> bool:
    """Whether a reason is that the body could not be meshed."""
    return re.search(r"mesh size of|(?:cannot|could not) be (?:meshed|filled)", line) is not None


def promise(folder: Path, iterations: int, start: float | None) -> float | None:
    """The gain that the unconstrained first-order model predicts for so many steps."""
    found = read(folder / "prediction.json")
    if found is None or found["gain"] is None or start is None:
        return None
    whole = iterations * found["gain"] + sum(gain * min(iterations, room) for gain, room in found["pressures"])
    tasks = tomllib.loads((folder / "problem.toml").read_text(encoding="utf-8"))["task"]
    return min(whole, start) if all(task["objective"]["kind"] in TARGETS for task in tasks) else whole


def reason_of(outcome: dict[str, Any]) -> str:
    """The reason without numbers and names, so that equal reasons can be counted."""
    if outcome["end"] == "completed":
        return next((name for name, words in RETURNS.items() if words in outcome["reason"]), outcome["reason"])
    first = re.split(r"; (?:design|designs|no design)\b", outcome["reason"])[0]
    first = re.sub(r"(?:[\w-]+ = [-+.\de]+ kPa(?:, | and )?)+", "pressures ", first)
    return re.sub(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?", "#", re.sub(r" \(volume [^)]*\)", "", first))[:150]


def one_line(folder: Path) -> str:
    found = summary(folder)
    if found is None:
        return f"{folder.name}: not measured"
    value = {name: "–" if found[name] is None else f"{found[name]:.5g}" for name in ("start", "best")}
    share = "" if found["share"] is None else f" ({100 * found['share']:.0f} % of predicted)"
    return (
        f"{found['index']:4d} {found['layout']:8s} {found['objective']:14s} held {found['held']}/{found['designs']}  "
        f"J {value['start']} → {value['best']}{share}  {found['ran']:.0f} s  {found['end']}: {found['message'][:160]}"
    )


# --- tables -----------------------------------------------------------------------------------------------------------


HEAD = ("", "runs", "ended", "starts", "designs", "held %", "ends held", "gained", "share %", "s/design", "fact.",
        "fact. new", "new", "no mesh", "back")  # fmt: skip


def row(name: str, found: list[dict[str, Any]]) -> list[str]:
    designs, held = (sum(one[key] for one in found) for key in ("designs", "held"))
    keys = ("seconds", "same", "after remeshing")
    seconds, same, remeshed = ([value for one in found for value in one[key]] for key in keys)
    shares = [one["share"] for one in found if one["share"] is not None]
    named = sum(one["end"] in ("completed", "failed", "refused") for one in found)

    def middle(values: list[float], places: int = 1) -> str:
        return f"{median(values):.{places}f}" if values else "–"

    return [
        name,
        str(len(found)),
        str(named),
        str(sum(one["start held"] for one in found)),
        str(designs),
        f"{100 * held / designs:.1f}" if designs else "–",
        str(sum(one["last held"] for one in found)),
        str(sum(one["gained"] for one in found)),
        middle([100 * share for share in shares], 0),
        middle(seconds),
        middle(same),
        middle(remeshed),
        str(sum(one["remeshes"] for one in found)),
        str(sum(one["mesh failures"] for one in found)),
        str(sum(one["taken back"] for one in found)),
    ]


def table(rows: list[list[str]], head: tuple[str, ...] = HEAD) -> None:
    widths = [max(len(cell) for cell in column) for column in zip(head, *rows, strict=True)]
    for cells in (head, *rows):
        first, *rest = (f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))
        print(f"{first.strip():{widths[0]}s}", *rest, sep="  ")
    print()


def tables(folders: list[Path]) -> None:
    found = [one for one in map(summary, folders) if one is not None]
    if not found:
        print("nothing has been run and measured yet")
        return
    print(
        f"{len(found)} of {len(folders)} problems, {sum(one['redraws'] for one in found)} draws refused before them\n\n"
        "ended: runs that end with a reason; starts: starts that satisfy all limits; designs: accepted after the\n"
        "start; held %: share of these that satisfy all limits; ends held: runs whose last design does; gained:\n"
        "runs with a design better than the start that satisfies all limits; share %: median fraction of the\n"
        "predicted gain; s/design, fact.: median seconds and factorisations per design; fact. new: the latter\n"
        "after remeshing; new: new meshes; no mesh: steps rejected because the body could not be meshed; back:\n"
        "all rejected steps\n"
    )
    table([row("all", found)])
    for key in ("layout", "objective"):
        table([row(name, [one for one in found if one[key] == name]) for name in sorted({one[key] for one in found})])
    flags = sorted({flag for one in found for flag in one["flags"]})
    table([row(flag, [one for one in found if flag in one["flags"]]) for flag in flags])
    ends = Counter((one["end"], one["reason"]) for one in found)
    for (end, reason), count in ends.most_common():
        print(f"{count:4d}  {end}: {reason}")
    print()
    beyond = [pair for one in found for pair in one["beyond"]]
    if beyond:
        limits = sorted({limit for limit, _ in beyond})
        excesses = {name: [excess for limit, excess in beyond if limit == name] for name in limits}
        table(
            [[name, str(len(worst)), f"{100 * max(worst):.1f}"] for name, worst in excesses.items()],
            ("limit", "designs beyond", "worst, %"),
        )
    bad = [one for one in found if one["end"] in ("traceback", "crashed", "without end")]
    for one in bad:
        print(f"{one['index']:04d} {one['end']}: {one['message']}")


# --- command ----------------------------------------------------------------------------------------------------------


def main() -> None:
    if sys.argv[1:2] == ["--measure"]:
        {"prediction": predict, "limits": measure_limits}[sys.argv[3]](Path(sys.argv[2]))
        return
    parser = argparse.ArgumentParser(description="Yield of random problems.")
    parser.add_argument("seed", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--bodies", action="store_true", help="bodies from CAD files in place of tubes")
    parser.add_argument("--out", type=Path, default=None, help="by default runs/yield_SEED")
    parser.add_argument("--source", type=Path, default=SOURCE, help="src of the checkout that designs")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--threads", type=int, default=1, help="of every job")
    parser.add_argument("--timeout", type=float, default=900.0, help="seconds of a run")
    parser.add_argument("--iterations", type=int, default=10)
    parser.add_argument("--only", type=int, default=None, help="one problem alone")
    parser.add_argument("--measure-again", action="store_true")
    parser.add_argument("--table-only", action="store_true")
    asked = parser.parse_args()
    out = asked.out or Path("runs") / f"yield_{asked.seed}"
    numbers = range(asked.count) if asked.only is None else [asked.only]
    folders = [out / f"{number:04d}" for number in numbers]

    def whole(number: int) -> None:
        folder = out / f"{number:04d}"
        prepare(asked.seed, number, folder, asked.bodies)
        drawn = read(folder / "drawn.json")
        if (drawn["seed"], drawn["index"]) != (asked.seed, number):
            sys.exit(f"{folder} holds another problem; name another --out")
        trust_code(folder)
        run(folder, asked)
        measure(folder, asked)
        print(one_line(folder), flush=True)

    if not asked.table_only:
        for sign in (signal.SIGINT, signal.SIGTERM):
            signal.signal(sign, stop)
        os.environ["XDG_CONFIG_HOME"] = str((out / "configuration").resolve())
        with ThreadPoolExecutor(asked.jobs) as pool:
            list(pool.map(whole, numbers))
        print()
    print(f"seed {asked.seed}: ", end="")
    tables(folders)


if __name__ == "__main__":
    main()
