"""Signals are noted by a thread: nothing is raised but where a program asks, and the process ends at once elsewhere.

The programs here never end by themselves, or only once their input is closed: that one ends shows that it was made to.
"""

import os
import signal
import sys

import pytest
from signals import POSIX, SENT, heard, interrupted, start

from pneumorph import interrupts, processes

pytestmark = POSIX

INSTALLED = """
import os, sys, threading, time
from pneumorph import interrupts
from pneumorph.interrupts import *

install()
interrupts.PATIENCE = 1e6

def say(word):
    print(word, flush=True)

def for_ever():
    threading.Event().wait()

def until_noted():
    while not interrupts._noted:
        time.sleep(0.001)
    say("noted")
"""


def program(body: str, **options):
    """A program whose signals are received, once it has said that it is ready."""
    process = start(["-c", INSTALLED + body], **options)
    heard(process, "ready")
    return process


@pytest.mark.parametrize(("number", "status"), SENT)
def test_it_ends_at_once_where_nothing_is_to_be_saved(number, status):
    body = "with cleaned_up(lambda: os.write(1, b'cleaned up')):\n    say('ready')\n    for_ever()"
    ended = interrupted(program(body), number)
    assert (ended.status, ended.out, ended.err) == (status, "cleaned up", "pneumorph: stopped\n")


WRITING = """
from pathlib import Path
from pneumorph import atomic

def wait(handle):
    say('ready')
    for_ever()

os.fsync = wait
atomic.write_bytes(Path('table.csv'), b'new')
"""


def test_a_file_that_is_being_written_is_left_as_it_was(tmp_path):
    (tmp_path / "table.csv").write_bytes(b"old")
    ended = interrupted(program(WRITING, cwd=tmp_path), signal.SIGTERM)
    assert (ended.status, ended.err) == (143, "pneumorph: stopped\n")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("table.csv", b"old")]


ASKING = """
try:
    with deferred():
        say('ready')
        while True:
            time.sleep(0.001)
            where = 'where it asks'
            stop_if_asked()
            where = 'elsewhere'
except Interrupted as stop:
    say(f'{stop} {where}')
    sys.exit(stop.status)
"""


@pytest.mark.parametrize(("number", "status"), SENT)
def test_what_is_deferred_ends_where_it_asks(number, status):
    ended = interrupted(program(ASKING), number)
    assert (ended.status, ended.out, ended.err) == (status, "stopped where it asks\n", "")


BUSY = """
import signal
# Not printed: it may come while something else is.
signal.signal(signal.SIGTERM, lambda *_: os.write(1, b'another\\n'))
with deferred():
    say('ready')
    until_noted()
    for_ever()
"""


def test_a_second_ctrl_c_ends_at_once_what_asks_nothing():
    process = program(BUSY)
    process.send_signal(signal.SIGINT)
    heard(process, "noted")
    ended = interrupted(process, signal.SIGINT)
    assert (ended.status, ended.err) == (130, "pneumorph: ended at once\n")


def test_other_signals_come_in_pairs_and_the_first_is_obeyed():
    process = program(BUSY)
    for number, word in ((signal.SIGHUP, "noted"), (signal.SIGTERM, "another")):
        process.send_signal(number)
        heard(process, word)
    # Signals are handled in their order: it has outlived the second one when the third ends it.
    ended = interrupted(process, signal.SIGINT)
    assert (ended.status, ended.err) == (130, "pneumorph: ended at once\n")


def test_what_goes_on_for_long_says_so():
    process = program("interrupts.PATIENCE = 0\nwith deferred():\n    say('ready')\n    sys.stdin.read()")
    process.send_signal(signal.SIGHUP)
    said = heard(process, "pneumorph: ", "stderr")
    assert said == "pneumorph: stops after the step in progress; Ctrl-C ends it at once\n"
    ended = interrupted(process)
    assert ended.status == 1 and ended.err.endswith("Interrupted: stopped\n")


def test_an_error_after_a_signal_is_its_consequence():
    body = """
try:
    with deferred():
        say('ready')
        until_noted()
        raise OSError('gone')
except Interrupted as stop:
    say(repr(stop.__cause__))
"""
    ended = interrupted(program(body), signal.SIGHUP)
    assert (ended.status, ended.out) == (0, "noted\nOSError('gone')\n")


def test_signals_that_are_ignored_stay_ignored():
    """As under nohup, or in the background of a script."""
    body = "say('ready')\nsys.stdin.read()\nsay('done')"
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
    body = "import atexit\natexit.register(for_ever)\nprint('ready', end='')\nleave(0)\nleave(143)"
    ended = interrupted(start(["-c", INSTALLED + body]))
    assert (ended.status, ended.out, ended.err) == (143, "ready", "")


@pytest.mark.parametrize("number", [number for number, _ in SENT])
def test_a_signal_while_python_itself_ends_changes_nothing(number):
    body = "def __del__(self, write=os.write, read=os.read):\n        write(1, b'ready\\n')\n        read(0, 1)"
    ended = interrupted(program(f"class Late:\n    {body}\nlate = Late()"), number)
    assert (ended.status, ended.err) == (0, "")


FOR_EVER = "import threading; threading.Event().wait()"


@pytest.mark.parametrize("within", ["deferred()", "contextlib.nullcontext()"])
def test_programs_and_folders_end_with_the_command(tmp_path, within):
    body = f"""
import contextlib
from pneumorph.processes import run, temporary_folder
os.mkfifo('started')
with {within}, temporary_folder() as folder:
    code = "import os; print(os.getpid(), file=open('started', 'w'), flush=True); {FOR_EVER}"
    say('ready')
    try:
        run([sys.executable, '-c', code], 1e6)
    except Interrupted as stop:
        sys.exit(stop.status)
"""
    (tmp_path / "temporary").mkdir()
    environment = {**os.environ, "TMPDIR": str(tmp_path / "temporary")}
    process = program(body, env=environment, cwd=tmp_path)
    child = int((tmp_path / "started").read_text())
    ended = interrupted(process, signal.SIGTERM)
    assert ended.status == 143, ended.err
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)
    assert not list((tmp_path / "temporary").iterdir())


def test_a_program_that_takes_too_long_is_ended():
    assert processes.run([sys.executable, "-c", "print('x' * 10**6)"], 1e6).stdout == "x" * 10**6 + "\n"
    with pytest.raises(processes.subprocess.TimeoutExpired):
        processes.run([sys.executable, "-c", FOR_EVER], 0.0)


def test_every_part_of_a_kernel_is_a_place_to_stop(monkeypatch):
    from pneumorph.threads import each

    monkeypatch.setattr(interrupts, "_noted", 15)
    with pytest.raises(interrupts.Interrupted) as stop:
        each(abs, [1, 2])
    assert stop.value.status == 143
