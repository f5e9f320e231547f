"""Interrupt commands at random moments, and report how they end: python benchmarks/interrupts.py [COUNT] [SEED].

COUNT times each (20 by default), `design` is sent SIGINT, SIGTERM and SIGHUP, and a quarter as often `simulate` with a
table. The moment is drawn from the time of a whole run, from where the process receives signals itself: from then on
(some hundredths of a second after its start) there must be no traceback. Afterwards the exit status must be that of the
signal, a sentence must have been said, no process, temporary file or half-written file may be left, and the last design
that is said to be saved must be one from which the run can go on.

Latency is the time from the signal to the end of the process, with Python's own shutdown.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from pneumorph.interface.runs import open_run

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

from signals import SENT, Ended, interrupted, received, start
from tiny import tiny

NOTICE = "pneumorph: stops after the step in progress; Ctrl-C ends it at once\n"
STOPPED = re.compile(
    r"pneumorph: stopped(; (no design was finished; .*|designs? .* saved in .*; resume with: pneumorph design .*|"
    r"the run in .* is complete; draw .*)| after \d+ of \d+ steps(; the steps so far are in .*)?)?\n"
)


def main() -> None:
    """Run the campaign and print its figures."""
    count, seed = (int(word) for word in (*sys.argv[1:], *("20", "0")[len(sys.argv) - 1 :]))
    random = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "tiny.toml").write_text(tiny(iterations="2"), encoding="utf-8")
        lasting = {command: _duration(folder, command) for command in ("design", "simulate")}
        print(f"a whole run takes {lasting['design']:.1f} s, a sweep {lasting['simulate']:.1f} s; seed {seed}")
        late: dict[str, list[float]] = {}
        faults = 0
        for command, times in (("design", count), ("simulate", count // 4)):
            for number, status in SENT:
                for place in range(times):
                    moment = float(random.uniform(0.0, lasting[command]))
                    ended, wrong = _try(folder, command, int(number), status, moment)
                    faults += bool(wrong)
                    kind = "stopped" if NOTICE not in ended.err else "stopped, in a step that cannot be"
                    if ended.status == 0:
                        kind = "had ended"
                    late.setdefault(f"{command} {kind}", []).append(ended.late)
                    said = ended.err.strip().splitlines()[-1:] or [""]
                    print(
                        f"{command} {signal.Signals(number).name} {place} at {moment:.2f} s: status {ended.status}, "
                        f"{ended.late:.2f} s, {said[0].replace(name, '')[:90]}{' WRONG: ' + wrong if wrong else ''}",
                        flush=True,
                    )
    print("\nend, n, median, 90 %, largest latency in s")
    for kind, found in late.items():
        print(f"{kind}, {len(found)}, {np.median(found):.2f}, {np.quantile(found, 0.9):.2f}, {max(found):.2f}")
    print(f"{faults} wrong")
    sys.exit(faults > 0)


def _start(folder: Path, command: str) -> subprocess.Popen:
    """Start a command whose temporary files are in a folder of their own."""
    (folder / "tmp").mkdir(exist_ok=True)
    options = {
        "design": ["--out", "run"],
        "simulate": ["--pressure", "A=0:60:2kPa", "--csv", "table.csv"],
    }
    environment = {**os.environ, "TMPDIR": str(folder / "tmp")}
    return start(["-m", "pneumorph", command, "tiny.toml", *options[command]], cwd=folder, env=environment)


def _clear(folder: Path) -> None:
    """Remove what commands have written."""
    for path in sorted(folder.rglob("*"), reverse=True):
        if path.name != "tiny.toml":
            path.rmdir() if path.is_dir() else path.unlink()


def _duration(folder: Path, command: str) -> float:
    """Seconds of a whole run."""
    process = _start(folder, command)
    began = time.perf_counter()
    _, err = process.communicate()
    assert process.returncode == 0, err
    _clear(folder)
    return time.perf_counter() - began


def _try(folder: Path, command: str, number: int, status: int, moment: float) -> tuple[Ended, str]:
    """Interrupt a command; how it ended, and what is wrong with that."""
    process = _start(folder, command)
    received(process)
    time.sleep(moment)
    ended = interrupted(process, number)
    wrong = _wrong(folder, ended, status)
    _clear(folder)
    return ended, wrong


def _wrong(folder: Path, ended: Ended, status: int) -> str:
    """What is wrong with how a command ended and what it left; empty for nothing."""
    if ended.status == 0 and not ended.err:
        return ""  # it had come to its end
    if ended.status != status:
        return f"status {ended.status}: {ended.err}"
    if not STOPPED.fullmatch(ended.err.removeprefix(NOTICE)):
        return ended.err
    left = [path for path in folder.rglob("*") if path.name.endswith(".new") or path.parent == folder / "tmp"]
    if left:
        return f"left {left}"
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if str(folder).encode() in entry.read_bytes():
                return f"process {entry.parent.name} goes on"
        except OSError:
            continue
    if (table := folder / "table.csv").exists():
        steps = re.search(r"after (\d+) of", ended.err)
        if steps is None or len(table.read_text(encoding="utf-8").splitlines()) != int(steps[1]) + 1:
            return "the table has other steps"
    if (folder / "run" / "problem.toml").exists():
        run = open_run(folder / "run")
        saved = re.search(r"designs? (?:0 to )?(\d+)(?: is| are) saved", ended.err)
        if saved is not None and run.latest != int(saved[1]):
            return f"design {run.latest} is the last"
        if run.latest is not None:
            run.best.entry  # noqa: B018 - that it can be read
            run.directory.resumable()
    return ""


if __name__ == "__main__":
    main()
