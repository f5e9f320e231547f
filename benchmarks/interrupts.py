"""Interrupt commands at random moments, and report how they end: python benchmarks/interrupts.py [COUNT] [SEED].

COUNT times each (20 by default), SIGINT, SIGTERM and SIGHUP are sent to `design`, every other time to `simulate` with
a table. The moment is drawn from the time of a whole run, from where the process receives signals itself: from then on
(some hundredths of a second after its start) there must be no traceback. Afterwards the exit status must be that of the
signal, a sentence must have been said, no process, temporary file or half-written file may be left, and the last design
that is said to be saved must be one from which the run can go on.

Latency is the time from the signal to the end of the process, with Python's own shutdown; and the processor time of the
process in between, which does not depend on what else the machine does.
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

from signals import SENT, Ended, start
from tiny import tiny

SWEEP, STEPS = "A=0:60:2kPa", 31
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
        (folder / "tiny.toml").write_text(tiny(iterations="1"), encoding="utf-8")
        lasting = {command: _duration(folder, command) for command in ("design", "simulate")}
        print(
            f"a whole run takes {lasting['design']:.1f} s, a sweep {lasting['simulate']:.1f} s; seed {seed}", flush=True
        )
        latencies: dict[str, list[tuple[float, float]]] = {}
        faults = 0
        for place in range(count):
            command = "simulate" if place % 2 else "design"
            for number, status in SENT:
                moment = float(random.uniform(0.0, lasting[command]))
                ended, late, used, wrong = _try(folder, command, int(number), status, moment)
                faults += bool(wrong)
                kind = "stopped" if NOTICE not in ended.err else "stopped after more than a second"
                if ended.status == 0:
                    kind = "had ended"
                latencies.setdefault(f"{command} {kind}", []).append((late, used))
                said = (ended.err.strip().splitlines() or [""])[-1].replace(f"{name}/", "")
                print(
                    f"{place} {command} {signal.Signals(number).name} at {moment:.2f} s: status {ended.status}, "
                    f"{late:.2f} s, {used:.2f} s of processor: {said[:90]}{' WRONG: ' + wrong if wrong else ''}",
                    flush=True,
                )
    print("\nend, n, and median, 90 % and largest of the latency in s, and of the processor time in s")
    for kind, found in latencies.items():
        figures = [f"{part:.2f}" for one in zip(*found, strict=True) for part in np.quantile(one, (0.5, 0.9, 1.0))]
        print(f"{kind}, {len(found)}, {', '.join(figures)}")
    print(f"{faults} wrong")
    sys.exit(faults > 0)


def _start(folder: Path, command: str) -> subprocess.Popen:
    """Start a command whose temporary files are in a folder of their own."""
    (folder / "tmp").mkdir(exist_ok=True)
    options = {
        "design": ["--out", "run"],
        "simulate": ["--pressure", SWEEP, "--csv", "table.csv"],
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


def _try(folder: Path, command: str, number: int, status: int, moment: float) -> tuple[Ended, float, float, str]:
    """Interrupt a command; how it ended, how long that took in s and in s of the processor, and what is wrong."""
    process = _start(folder, command)
    _received(process)
    time.sleep(moment)
    before = after = _used(process)
    began = time.perf_counter()
    if process.poll() is None:
        process.send_signal(number)
    while process.poll() is None:
        after = _used(process) or after
        time.sleep(0.01)
    late = time.perf_counter() - began
    ended = Ended(process.returncode, *process.communicate())
    wrong = _wrong(folder, ended, status)
    _clear(folder)
    return ended, late, after - before, wrong


def _received(process: subprocess.Popen) -> None:
    """Wait until a process receives SIGTERM itself, which is soon after its start."""
    status = Path("/proc", str(process.pid), "status")
    while process.poll() is None:
        caught = next(line for line in status.read_text(encoding="ascii").splitlines() if line.startswith("SigCgt"))
        if int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.002)


def _used(process: subprocess.Popen) -> float:
    """Processor time of a process in s; 0 once it has ended."""
    try:
        *_, fields = Path("/proc", str(process.pid), "stat").read_text(encoding="ascii").rpartition(")")
    except OSError:
        return 0.0
    user, system = fields.split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


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
        # Where nothing is said of steps, all had been written.
        if len(table.read_text(encoding="utf-8").splitlines()) != (STEPS if steps is None else int(steps[1])) + 1:
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
