"""Signals are noted by a thread: nothing is raised but where a program asks, and the process ends at once elsewhere."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from signals import SENT, heard, interrupted, start

from pneumorph import interrupts, processes

INSTALLED = "import time\nfrom pneumorph.interrupts import *\ninstall()\n"


def program(body: str, **options):
    """A program whose signals are received, once it has said that it is ready."""
    process = start(["-c", INSTALLED + body], **options)
    heard(process, "ready")
    return process


@pytest.mark.parametrize(("number", "status"), SENT)
def test_it_ends_at_once_where_nothing_is_to_be_saved(number, status):
    body = "with cleaned_up(lambda: os.write(1, b'cleaned up')):\n    print('ready', flush=True)\n    time.sleep(60)"
    ended = interrupted(program(f"import os\n{body}"), number)
    assert (ended.status, ended.out, ended.err) == (status, "cleaned up", "pneumorph: stopped\n")
    assert ended.late < 2.0


WRITING = """
import os
from pathlib import Path
from pneumorph import atomic

def wait(handle):
    print('ready', flush=True)
    time.sleep(60)

os.fsync = wait
atomic.write_bytes(Path('table.csv'), b'new')
"""


def test_a_file_that_is_being_written_is_left_as_it_was(tmp_path):
    (tmp_path / "table.csv").write_bytes(b"old")
    ended = interrupted(program(WRITING, cwd=tmp_path), signal.SIGTERM)
    assert (ended.status, ended.err) == (143, "pneumorph: stopped\n")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("table.csv", b"old")]


WAITING = """
import sys
try:
    with deferred():
        print('ready', flush=True)
        for _ in range(100):
            time.sleep(0.05)
            stop_if_asked()
except Interrupted as stop:
    print(f'{stop} in line {sys.exc_info()[2].tb_lineno}')
    sys.exit(stop.status)
"""


@pytest.mark.parametrize(("number", "status"), SENT)
def test_what_is_deferred_ends_where_it_asks(number, status):
    ended = interrupted(program(WAITING), number)
    assert (ended.status, ended.out, ended.err) == (status, "stopped in line 11\n", "")
    assert ended.late < 2.0


BUSY = "with deferred():\n    print('ready', flush=True)\n    time.sleep({})"


def test_a_second_ctrl_c_ends_at_once_what_asks_nothing():
    ended = interrupted(program(BUSY.format(60)), signal.SIGINT, signal.SIGINT)
    assert (ended.status, ended.err) == (130, "pneumorph: ended at once\n") and ended.late < 3.0
    # Other signals come in pairs, and the first is obeyed.
    ended = interrupted(program(BUSY.format(2.5)), signal.SIGHUP, signal.SIGTERM)
    assert ended.status == 1 and "Interrupted: stopped" in ended.err and "ended at once" not in ended.err
    assert "pneumorph: stops after the step in progress; Ctrl-C ends it at once\n" in ended.err


def test_an_error_after_a_signal_is_its_consequence():
    body = """
try:
    with deferred():
        print('ready', flush=True)
        time.sleep(1)
        raise OSError('gone')
except Interrupted as stop:
    print(repr(stop.__cause__))
"""
    ended = interrupted(program(body), signal.SIGHUP)
    assert (ended.status, ended.out) == (0, "OSError('gone')\n")


def test_signals_that_are_ignored_stay_ignored():
    """As under nohup, or in the background of a script."""
    body = "print('ready', flush=True)\ntime.sleep(1)\nprint('done')"
    ended = interrupted(program(body, ignoring=(signal.SIGHUP, signal.SIGINT)), signal.SIGHUP, signal.SIGINT)
    assert (ended.status, ended.out) == (0, "done\n")


def test_without_the_command_signals_do_what_they_always_do():
    code = "import signal, pneumorph as pm, pneumorph.cli\nfrom pneumorph.interrupts import stop_if_asked, deferred\n"
    code += "pm.load\nassert signal.getsignal(signal.SIGINT) is signal.default_int_handler\n"
    code += "assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL and signal.set_wakeup_fd(-1) == -1\n"
    code += "with deferred():\n    stop_if_asked()\n    signal.raise_signal(signal.SIGINT)"
    ended = interrupted(start(["-c", code]))
    assert ended.err.splitlines()[-1] == "KeyboardInterrupt" and ended.status in (-signal.SIGINT, 130)


def test_an_interrupted_command_does_not_wait_for_what_python_does_at_its_end():
    body = "import atexit\natexit.register(time.sleep, 60)\nprint('ready', end='')\nleave(0)\nleave(143)"
    ended = interrupted(start(["-c", INSTALLED + body]), seconds=30)
    assert (ended.status, ended.out, ended.err) == (143, "ready", "")


@pytest.mark.parametrize("number", [number for number, _ in SENT])
def test_a_signal_while_python_itself_ends_changes_nothing(number):
    body = "def __del__(self, write=os.write, sleep=time.sleep):\n        write(1, b'ready\\n')\n        sleep(0.5)"
    ended = interrupted(program(f"import os\nclass Late:\n    {body}\nlate = Late()"), number)
    assert (ended.status, ended.err) == (0, "")


@pytest.mark.parametrize("within", ["deferred()", "contextlib.nullcontext()"])
def test_programs_and_folders_end_with_the_command(tmp_path, within):
    body = f"""
import contextlib, sys
from pneumorph.processes import run, temporary_folder
with {within}, temporary_folder() as folder:
    code = "import os, time; open('pid', 'w').write(str(os.getpid())); os.rename('pid', 'started'); time.sleep(60)"
    print('ready', folder, flush=True)
    try:
        run([sys.executable, '-c', code], 60, folder)
    except Interrupted as stop:
        sys.exit(stop.status)
"""
    process = start(["-c", INSTALLED + body], env={**os.environ, "TMPDIR": str(tmp_path)})
    started = Path(heard(process, "ready").split()[1]) / "started"
    while not started.exists():
        time.sleep(0.01)
    child = int(started.read_text())
    ended = interrupted(process, signal.SIGTERM)
    assert ended.status == 143, ended.err
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)
    assert not list(tmp_path.iterdir())


def test_a_program_that_takes_too_long_is_ended(tmp_path):
    assert processes.run([sys.executable, "-c", "print('x' * 10**6)"], 60).stdout == "x" * 10**6 + "\n"
    with pytest.raises(processes.subprocess.TimeoutExpired):
        processes.run([sys.executable, "-c", "import time; time.sleep(60)"], 0.3)


def test_every_part_of_a_kernel_is_a_place_to_stop(monkeypatch):
    from pneumorph.threads import each

    monkeypatch.setattr(interrupts, "_noted", 15)
    with pytest.raises(interrupts.Interrupted) as stop:
        each(abs, [1, 2])
    assert stop.value.status == 143
