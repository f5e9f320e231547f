"""Attack the package as somebody who means harm would: python benchmarks/attacks.py [WORD…].

Runs from elsewhere, with links and pipes, pickles, corrupted and edited files; a hostile working directory; code that
was never trusted; names that are code of a page; requests to the server; objectives that never end; programs that are
killed; outputs and caches that cannot be written or read. One line for each,
with "refused" (one line says why) or "harmless" (it goes on, and nothing happens). A line with "SUCCEEDS" says what has
happened, and makes the exit status 1. With words, only attacks whose names contain one of them.
"""

from __future__ import annotations

import http.client
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "cli"))

import damage
from brief import BEGUN, arguments, brief, commands_for
from records import entry, one_element
from runs import analysed, ended, waving_run
from signals import HUNG, ends
from test_compiling import ANOTHER, SPOILED
from test_processes import ENDLESS, HOSTILE, STARTS, script
from tiny import tiny
from typer.testing import CliRunner

from pneumorph.atomic import write_arrays
from pneumorph.cli import app
from pneumorph.errors import NotWritten, ProblemError
from pneumorph.geometry.tube import starting_body
from pneumorph.interface.runs import prepare_run
from pneumorph.mesh.tube import mesh_body
from pneumorph.objective import build_objectives
from pneumorph.output.report import write_report
from pneumorph.output.report_data import facts_of
from pneumorph.output.study_page import write_study_page
from pneumorph.problem import loads
from pneumorph.results import Fields
from pneumorph.run import RunDirectory, StoredDesign, create
from pneumorph.serve.server import Server

PROBLEM = loads(tiny())
REFUSED, HARMLESS = "refused", "harmless"
ATTACKS: dict[str, Callable[[Path], str]] = {}


class Succeeded(Exception):
    """What an attack has brought about."""


def attack(name: str, *arguments: object) -> Callable:
    """Name an attack, which is given a folder of its own and these arguments."""

    def named(function: Callable) -> Callable:
        ATTACKS[name] = lambda folder: function(folder, *arguments)
        return function

    return named


def command(*arguments: object, begun: str = "", failing: bool = False) -> str:
    """Run a command in this process; whether it is refused.

    Parameters
    ----------
    arguments : of the command.
    begun : what it says, if not empty, where its work would begin.
    failing : whether it may also end with status 1, with one line.
    """
    found = CliRunner().invoke(app, [str(each) for each in arguments])
    if not isinstance(found.exception, SystemExit | None):
        raise Succeeded(f"{arguments[0]} ends in {found.exception!r}")
    if found.exit_code == 0 or (begun and begun in found.stderr):
        return HARMLESS
    if failing and found.exit_code == 1 and found.stderr.count("\n") == 1:
        return REFUSED
    if found.exit_code != 2 or found.stderr.count("\n") != 1:
        raise Succeeded(f"{arguments[0]} ends with status {found.exit_code} and says {found.stderr[-200:]!r}")
    return REFUSED


def refused(action: Callable[[], object]) -> str:
    """Whether an action is refused in one line, or cannot write."""
    try:
        action()
    except (ProblemError, NotWritten) as error:
        if "\n" in str(error):
            raise Succeeded("it is refused in several lines") from error
        return REFUSED
    return HARMLESS


@cache
def fields() -> Fields:
    """Of its start."""
    return analysed(PROBLEM, 0.0)


@cache
def sound() -> Path:
    """A run with three designs."""
    run = waving_run(Path(tempfile.mkdtemp()) / "run", PROBLEM, 3, {0: fields()})
    ended(run)
    return run.path


def copied(folder: Path) -> RunDirectory:
    """A run to be spoiled."""
    shutil.copytree(sound(), folder / "run")
    return RunDirectory(folder / "run", PROBLEM)


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a folder."""
    return {str(path): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


FILES = ("report.html", ".report.html.new", "problem.toml", "history.jsonl", "checkpoint.npz", "result.json", ".lock")
FOLDERS = ("designs", "fields", "pictures", "make")


def linked(folder: Path, name: str) -> str:
    """A file or folder of a run is a link to what is somebody's own, of the same content."""
    run, precious = copied(folder), folder / "precious"
    precious.mkdir()
    place = run.path / name
    if name in FOLDERS:
        shutil.copytree(place, precious / name) if place.exists() else (precious / name).mkdir()
        shutil.rmtree(place, ignore_errors=True)
    else:
        (precious / name).write_bytes(place.read_bytes() if place.exists() else b"precious")
        place.unlink(missing_ok=True)
    place.symlink_to(precious / name)
    before = contents(precious)

    def resumed() -> None:
        again = prepare_run(PROBLEM, run.path, resume=True).directory
        again.begin()
        again.record(replace(again.history()[-1], iteration=3), again.load_design(2), fields(), {})

    verdicts = [command("report", run.path), command("draw", run.path, "history"), refused(resumed)]
    if name == "make":
        verdicts.append(command("make", run.path))
    if contents(precious) != before:
        raise Succeeded("what it leads to is written or removed")
    return REFUSED if REFUSED in verdicts else HARMLESS


for each in (*FILES, *FOLDERS):
    attack(f"link in a run: {each}", each)(linked)


@attack("link in a run: a secret as make/body.step on the page", "link")
@attack("pipe in a run: make/body.step, waited for by the page", "pipe")
def made(folder: Path, kind: str) -> str:
    """The page has the exact CAD of a run in it."""
    run, secret = copied(folder), folder / "id_rsa"
    secret.write_bytes(b"secret" * 9)
    (run.path / "make").mkdir()
    place = run.path / "make" / "body.step"
    place.symlink_to(secret) if kind == "link" else os.mkfifo(place)
    verdict = command("report", run.path)
    if facts_of(run, run.history())["files"]:
        raise Succeeded("what it leads to is on the page")
    return verdict


class Marks:
    """Unpickled, it makes a file."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


@attack("pickle in a run: designs/0002.npz", "designs/0002.npz")
@attack("pickle in a run: fields/0000.npz", "fields/0000.npz")
@attack("pickle in a run: checkpoint.npz", "checkpoint.npz")
def pickled(folder: Path, name: str) -> str:
    """A file of arrays is a pickle."""
    run = copied(folder)
    (run.path / name).write_bytes(pickle.dumps(Marks(folder / "mark")))
    verdicts = [command(word, run.path, *more) for word, *more in (("report",), ("simulate",), ("draw", "evolution"))]
    if (folder / "mark").exists():
        raise Succeeded("it is unpickled")
    return REFUSED if REFUSED in verdicts else HARMLESS


def working_directory(folder: Path, kind: str) -> str:
    """Modules of the working directory have the names of those that children import."""
    for name in HOSTILE:
        (folder / "hostile" / name).mkdir(parents=True)
        (folder / "hostile" / name / "__init__.py").write_text(f"open({str(folder / 'mark')!r}, 'w').close()")
    program = [sys.executable, str(script(folder / "program.py", STARTS[kind])), str(folder / "hostile")]
    subprocess.run(program, cwd=folder / "hostile", capture_output=True, timeout=HUNG, check=True)
    if (folder / "mark").exists():
        raise Succeeded("they are executed")
    return HARMLESS


for each in STARTS:
    attack(f"modules in the working directory: {each}", each)(working_directory)


@attack("code with the fingerprint of trusted code")
def collides(folder: Path) -> str:
    """Function and text, joined by the end of a line, are those of other code that was trusted."""
    body = "def objective(f):\n    return -f.translation[2]\n"
    mark = f"open({str(folder / 'mark')!r}, 'w').close()\n"
    codes = {"first": ("objective", f'"""\n{mark}#"""\n{body}'), "second": ('objective\n"""', f'{mark}#"""\n{body}')}
    for name, (function, code) in codes.items():
        objective = f'{{ kind = "custom", function = {json.dumps(function)}, code = {json.dumps(code)} }}'
        (folder / f"{name}.toml").write_text(tiny(objective=objective))
    if command("simulate", folder / "first.toml", "--trust", "--quiet") != HARMLESS:
        raise Succeeded("trusted code is refused")
    if command("simulate", folder / "second.toml") == HARMLESS or (folder / "mark").exists():
        raise Succeeded("it runs without a question")
    return REFUSED


NASTY = "</script><script>window.X=1</script><img src=x onerror=alert(1)>"


@attack("names on the page of a run", False)
@attack("names on the page of a study", True)
def named(folder: Path, study: bool) -> str:
    """Titles are code of pages, and names those that every object of JavaScript has."""
    objects = "".join(
        f'[[obstacle]]\nname = "{name}"\nkind = "box"\ncenter = ["30 mm", "0 mm", "{10 * at} mm"]\n'
        'size = ["4 mm", "4 mm", "4 mm"]\n'
        for at, name in enumerate(("__proto__", "hasOwnProperty", "constructor"))
    )
    problem = loads(tiny(title=json.dumps(NASTY)).replace('"extend"', '"__proto__"') + objects)
    run = waving_run(folder / NASTY.replace("/", "_"), problem, 1, {0: analysed(problem, 0.0)})
    page = write_study_page(folder, [run]) if study else write_report(run)
    found = page.read_text(encoding="utf-8")
    if "<img src=x" in found or "<script>window.X" in found:
        raise Succeeded("a name is code of the page")
    return HARMLESS


@attack("names that are paths", "../../evil")
@attack("names that are whole paths", "/tmp/evil")
@attack("names with line ends", "a\\nb")
def paths(folder: Path, name: str) -> str:
    """Names of chambers and tasks become names of files."""
    verdicts = [refused(lambda text=text: loads(text)) for text in (
        tiny().replace('"A"', f'"{name}"').replace("A =", f'"{name}" ='), tiny().replace('"extend"', f'"{name}"'),
    )]  # fmt: skip
    if HARMLESS in verdicts:
        raise Succeeded("such a name is accepted")
    return REFUSED


DEEP = "[" * 100_000
DEMANDS = {
    "lists within lists": DEEP,
    "objects within objects": '{"A":' * 50_000,
    "a list": "[1]",
    "a boolean": '{"A": true}',
    "a text": '{"A": "1"}',
    "none": '{"A": null}',
    "NaN": '{"A": NaN}',
    "infinite": '{"A": Infinity}',
    "a thousand digits": '{"A": 1' + "0" * 1000 + "}",
    "an absurd one": '{"A": 1e9}',
    "another chamber": '{"B": 1}',
    "no UTF-8": b'{"A": "\xff"}',
}


@cache
def server() -> Server:
    """A server of a run."""
    found = Server([sound()])
    threading.Thread(target=found.serve_forever, daemon=True).start()
    return found


def asked(path: str, method: str = "GET", body: str | bytes | None = None, **headers: str) -> int:
    """The status of the server's answer; 0 where it ends the connection."""
    connection = http.client.HTTPConnection("127.0.0.1", server().server_address[1], timeout=HUNG)
    given = {"Content-Type": "application/json"} | {name.replace("_", "-"): value for name, value in headers.items()}
    try:
        connection.request(method, path, body.encode() if isinstance(body, str) else body, given)
        return connection.getresponse().status
    except (http.client.HTTPException, OSError):
        return 0
    finally:
        connection.close()


def demanded(folder: Path, body: str | bytes) -> str:
    """A pressure that is none."""
    del folder
    status = asked(f"/{server().token}/runs/0/designs/0/state", "POST", body)
    if not 400 <= status < 500:
        raise Succeeded(f"it is answered with {status}")
    if asked(f"/{server().token}/runs") != 200:
        raise Succeeded("the server answers no more")
    return REFUSED


for each, body in DEMANDS.items():
    attack(f"pressures to the server: {each}", body)(demanded)


@attack("the server: another host", {"Host": "evil.example:80"}, "runs")
@attack("the server: another site", {"Origin": "http://evil.example"}, "runs")
@attack("the server: a path out of the run", {}, "../../etc/passwd")
@attack("the server: a design that is a path", {}, "runs/0/designs/..%2f..%2f0/sweep")
@attack("the server: a run of a thousand digits", {}, f"runs/{'9' * 1000}")
@attack("the server: no token", {}, None)
def requested(folder: Path, headers: dict[str, str], path: str | None) -> str:
    """A request that is not the page's."""
    del folder
    status = asked("/runs" if path is None else f"/{server().token}/{path}", **headers)
    if not 400 <= status < 500:
        raise Succeeded(f"it is answered with {status}")
    return REFUSED


@attack("the server: a body of a terabyte", str(10**12))
@attack("the server: a body of less than nothing", "-1")
def long(folder: Path, length: str) -> str:
    """A length that is not that of the body."""
    del folder
    status = asked(f"/{server().token}/runs/0/designs/0/state", "POST", b"{}", Content_Length=length)
    if not 400 <= status < 500:
        raise Succeeded(f"it is answered with {status}")
    return REFUSED


OBJECTIVES = {
    "never ends": "while True:\n    pass\n",
    "never ends in C": "sum(iter(int, 1))\n",
    "waits": "import threading\nthreading.Event().wait()\n",
    "ends the process": "import os\nos._exit(0)\n",
    "aborts the process": "import os\nos.abort()\n",
    "is an interruption": "raise KeyboardInterrupt\n",
    "exits": "raise SystemExit(0)\n",
    "takes all memory": "x = bytearray(10**11)\n",
    "goes too deep": "def f():\n    f()\nf()\n",
    "returns nothing": "def objective(f):\n    return None\n",
    "returns NaN of another type": "def objective(f):\n    return float('nan') > 0\n",
}


def objective(folder: Path, code: str) -> str:
    """An objective that is trusted, but wrong."""
    del folder
    text = json.dumps(code + ("" if "def objective" in code else "def objective(f):\n    return f.translation[2]\n"))
    problem = loads(tiny(objective=f'{{ kind = "custom", code = {text} }}'))
    if refused(lambda: build_objectives(problem)) == HARMLESS:
        raise Succeeded("it is accepted")
    return REFUSED


for each, code in OBJECTIVES.items():
    attack(f"an objective that {each}", code)(objective)


def killed(folder: Path, kind: str) -> str:
    """Its parent is killed while a child works."""
    program = subprocess.Popen([sys.executable, str(script(folder / "it.py", ENDLESS[kind]))], stdout=subprocess.PIPE)
    try:
        assert program.stdout is not None
        child = os.pidfd_open(int(program.stdout.readline()))
    finally:
        program.send_signal(signal.SIGKILL)
        program.communicate()
    if not ends(child):
        raise Succeeded("the child goes on")
    return HARMLESS


for each in ENDLESS:
    attack(f"kill -9 of a program: {each}", each)(killed)


@cache
def corruptible() -> Path:
    """A run whose files are to be corrupted, with a mesh of its body."""
    mesh = mesh_body(damage.START, damage.PROBLEM.mesh.size).mesh
    u = mesh.points * np.array([-0.05, 0.0, 0.2])
    stored = Fields(mesh, {"extend": u}, {"extend": 1.0 + 0.01 * mesh.points[:, 2]})
    return damage.sound_run(Path(tempfile.mkdtemp()) / "run", damage.resumable_state(), stored).path


USED: dict = {}
"""Shares of the limits that designs of corrupted runs use, which are the same in all of them."""


def corrupted(folder: Path, name: str) -> str:
    """A file of a run is wrong: view, simulate, make and draw refuse it, or do not need it, and change nothing."""
    shutil.copytree(corruptible(), folder / "run")
    run = RunDirectory(folder / "run", damage.PROBLEM)
    DAMAGES[name](run)
    before, verdicts = damage.contents(run), set()
    for each in commands_for(name):
        with brief(USED):
            verdicts.add(command(*arguments(each, run.path, folder), begun=BEGUN))
    if damage.contents(run) != before:
        raise Succeeded("the run is changed")
    return REFUSED if REFUSED in verdicts else HARMLESS


DAMAGES = damage.damages(damage.resumable_state())
for each in DAMAGES:
    attack(f"a corrupted run: {each}", each)(corrupted)

MIRRORED = tiny().replace("[[body.chamber]]", 'symmetry = { mirror = ["xz"] }\n[[body.chamber]]', 1)
LAYERED = (
    tiny()
    + """
[[region]]
name = "end"
beyond = "18 mm"
material = { name = "Hei-Cast 8400" }
"""
)
EDITED = {
    "nets off a mirror plane by 2e-6 mm": (MIRRORED, lambda net: np.add(net, [0.0, 2e-6, 0.0])),
    "nets off a mirror plane by 1 mm": (MIRRORED, lambda net: np.add(net, [0.0, 1.0, 0.0])),
    "nets of which a row is in another region": (LAYERED, lambda net: net * [1.0, 1.0, 0.5]),
    "nets that leave a region without rubber": (LAYERED, lambda net: net * [1.0, 1.0, 0.2]),
    "nets that are turned inside out": (MIRRORED, lambda net: net[:, ::-1]),
    "nets that cross": (tiny(), lambda net: net * [3.0, 3.0, 1.0]),
}


def edited(folder: Path, name: str) -> str:
    """The nets of a chamber were edited: numbers that are finite, of a body that is none of the problem's."""
    text, change = EDITED[name]
    problem = loads(text)
    start = starting_body(problem.tubes)
    pressures = {"extend": {"A": 0.06}}
    run = create(folder / "run", problem)
    run.record(entry(0), StoredDesign.of(start, pressures), one_element(), {"iteration": 0})
    path = run.path / "designs" / "0000.npz"
    with np.load(path) as stored:
        arrays = dict(stored)
    arrays["chamber_A"] = change(arrays["chamber_A"])
    write_arrays(path, arrays)
    verdicts = [
        command(*words, failing=True)
        for words in (
            ("simulate", run.path),
            ("draw", run.path, "profile", "--out", folder / "p.png"),
            ("export", run.path, "--out", folder / "body.vtu"),
            ("report", run.path, "--out", folder / "page.html"),
        )
    ]
    return REFUSED if REFUSED in verdicts else HARMLESS


for each in EDITED:
    attack(f"a run that was edited: {each}", each)(edited)


def started(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    words = [sys.executable, "-m", "pneumorph", *map(str, arguments)]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "timeout": HUNG}
    found = subprocess.run(words, check=False, **(pipes | options))
    if "Traceback" in found.stderr:
        raise Succeeded(f"it ends in {found.stderr[-200:]!r}")
    return found


@attack("an output that knows nothing but ASCII")
def in_ascii(folder: Path) -> str:
    """Titles and units have letters that it does not know."""
    path = folder / "arm.toml"
    path.write_text(tiny(title='"Ärmel ≤ ½"'), encoding="utf-8")
    found = started("check", path, "--quick", env=os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"})
    if found.returncode != 0 or "\\xc4rmel" not in found.stdout:
        raise Succeeded(f"it ends with status {found.returncode}")
    return HARMLESS


@attack("a standard output that is full")
def full(folder: Path) -> str:
    """Nothing that is printed arrives."""
    del folder
    with open("/dev/full", "w", encoding="utf-8") as nowhere:
        found = started("--version", stdout=nowhere)
    if found.returncode != 1 or found.stderr.count("\n") != 1:
        raise Succeeded(f"it ends with status {found.returncode} and says {found.stderr[-200:]!r}")
    return REFUSED


@attack("a compile cache of jax that was emptied", b"")
@attack("a compile cache of jax that was spoiled", b"garbage" * 99)
def uncached(folder: Path, content: bytes) -> str:
    """Files of kernels that were kept before are of no use any more."""
    path, kept = folder / "tiny.toml", folder / "cache"
    path.write_text(tiny())
    own = {key: value for key, value in os.environ.items() if key != "JAX_COMPILATION_CACHE_DIR"}
    answers = []
    for number in range(2):
        out = folder / f"{number}.json"
        found = started("simulate", path, "--json", out, env=own | {"PNEUMORPH_CACHE": str(kept)})
        if found.returncode != 0:
            raise Succeeded(f"it ends with status {found.returncode} and says {found.stderr[-200:]!r}")
        answers.append(json.loads(out.read_text())["steps"])
        for each in (each for each in kept.rglob("*") if each.is_file()):
            each.write_bytes(content)
    if answers[0] != answers[1]:
        raise Succeeded("it finds other states")
    return HARMLESS


def spoiled(folder: Path, how: str) -> str:
    """Files of a kernel of Numba are of no use any more."""
    (folder / "kernel.py").write_text("import numba\n@numba.njit(cache=True)\ndef twice(x):\n    return 2 * x\n")
    places = {"PYTHONPATH": os.pathsep.join([str(folder), *filter(None, sys.path)]), "NUMBA_CACHE_DIR": str(folder)}
    for _ in range(2):
        program = [sys.executable, "-c", ANOTHER]
        found = subprocess.run(
            program, env=os.environ | places, capture_output=True, text=True, timeout=HUNG, check=False
        )
        if (found.returncode, found.stdout[:2]) != (0, "42"):
            raise Succeeded(f"it ends with status {found.returncode} and says {found.stderr[-200:]!r}")
        for each in [each for each in folder.rglob("*.nb?") if each.is_file()]:
            SPOILED[how](each)
    return HARMLESS


for each in SPOILED:
    attack(f"a compile cache of Numba that was spoiled: {each}", each)(spoiled)


@attack("a list of trusted code without the end of its last line")
def unfinished(folder: Path) -> str:
    """What is trusted next is not joined to what is there."""
    kept = Path(os.environ["XDG_CONFIG_HOME"]) / "pneumorph" / "trusted"
    kept.parent.mkdir(parents=True, exist_ok=True)
    before = kept.read_bytes() if kept.exists() else b""
    path, code = folder / "own.toml", f"# {folder}\ndef objective(f):\n    return -f.translation[2]\n"
    path.write_text(tiny(objective=f'{{ kind = "custom", code = {json.dumps(code)} }}'))
    try:
        kept.write_bytes(before + b"0123456789abcdef  a line that was not written in full")
        if command("export", path, "--out", folder / "body.msh", "--trust") != HARMLESS:
            raise Succeeded("trusted code is refused")
        if command("export", path, "--out", folder / "body.msh") != HARMLESS:
            raise Succeeded("it is forgotten at once")
    finally:
        kept.write_bytes(before)
    return HARMLESS


def _late(*_: object) -> None:
    raise Succeeded("it hangs")


def main() -> int:
    """Make all attacks; how many have succeeded."""
    words, count = sys.argv[1:], 0
    signal.signal(signal.SIGALRM, _late)
    # What is trusted here is nobody's.
    os.environ["XDG_CONFIG_HOME"] = tempfile.mkdtemp()
    for name, make in ATTACKS.items():
        if words and not any(word in name for word in words):
            continue
        with tempfile.TemporaryDirectory() as folder:
            signal.alarm(int(HUNG))
            try:
                verdict = make(Path(folder))
            except Succeeded as error:
                verdict, count = f"SUCCEEDS: {error}", count + 1
            finally:
                signal.alarm(0)
        print(f"{name}: {verdict}", flush=True)
    return count


if __name__ == "__main__":
    sys.exit(1 if main() else 0)
