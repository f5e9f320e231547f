"""Files too large, too deep or too long in any part: one short line each, in little time and memory."""

import json
import os
import subprocess
import sys

import pytest
from texts import problem_text
from tiny import tiny

from pneumorph.errors import ProblemError, clipped, printable, short
from pneumorph.problem import Problem, load, loads

resource = pytest.importorskip("resource")

SECONDS, BYTES = 60, 500_000_000
"""Processor time for all files together, and memory for each, beyond what the program takes itself."""

CHILD = """
import json, resource, sys
from pneumorph.errors import ProblemError
from pneumorph.problem import load
pages = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (pages + int(sys.argv[2]),) * 2)
resource.setrlimit(resource.RLIMIT_CPU, (int(sys.argv[1]),) * 2)
for path in sys.argv[3:]:
    try:
        load(path)
        said = "sound"
    except ProblemError as error:
        said = str(error)
    except BaseException as error:
        said = f"{type(error).__name__}\\n{error}"
    print(json.dumps([path, said]), flush=True)
"""

GOOD = tiny()


def chambers(count: int) -> str:
    table = '[[body.chamber]]\nname = "c{}"\nradius = "1 mm"\ncenter = ["0 mm", "0 mm"]\nspan = ["3 mm", "21 mm"]\n'
    return "".join(table.format(number) for number in range(count))


def tasks(count: int) -> str:
    table = '[[task]]\nname = "t{}"\npressure = {{ A = "60 kPa" }}\nobjective = {{ motion = "extension" }}\n'
    return "".join(table.format(number) for number in range(count))


def custom(content: str) -> str:
    return tiny(objective=f'{{ kind = "custom", {content} }}')


FILES = {
    "3 MB": (GOOD + "#" * 3_000_000, "it has more than 2 MB"),
    "a device": (custom('file = "/dev/zero"'), "it is a device or a pipe"),
    "a pipe": (custom('file = "pipe"'), "it is a device or a pipe"),
    "code of 3 MB": (custom('file = "long.py"'), "it has more than 2 MB"),
    "code": (custom(f'code = "{"x" * 1_000_000}"'), "use at most 100000"),
    "key": (GOOD + "k" * 1_900_000 + " = 1\n", "unknown key"),
    "quoted key": (GOOD + '"' + r"k\n" * 300_000 + '" = 1\n', "unknown key"),
    "digits": (tiny(length=f'"{"9" * 1_000_000} mm"'), "is not a number with a unit"),
    "parentheses": (tiny(length=f'"1 {"(" * 50_000}mm"'), "is not a number with a unit"),
    "few parentheses": (tiny(length=f'"1 mm{"(" * 90}mm{")" * 90}"'), "is not a"),
    "powers": (tiny(length='"1 mm^9^9^9^9^9"'), "is not a known unit"),
    "spaces": (tiny(length=f'"1{" " * 900_000}x"'), "is not a number with a unit"),
    "integer": (tiny(iterations="9" * 5000), "a number has too many digits"),
    "integer in range of Python": (tiny(iterations="9" * 4000), "a number of about 4000 digits is out of range"),
    "integer without unit": (tiny(length="9" * 4000), "the number of about 4000 digits has no unit"),
    "hexadecimal": (tiny(iterations=f"0x{'f' * 500_000}"), "digits is out of range"),
    "dotted key": (".".join(100_000 * "a") + " = 1\n" + GOOD, "dotted key of more than 64 parts"),
    "quoted dotted key": (GOOD + " . ".join(100_000 * ["'a'"]) + " = 1\n", "dotted key of more than 64 parts"),
    "dotted table": (GOOD + f"[{'.'.join(100_000 * 'a')}]\n", "dotted key of more than 64 parts"),
    "dotted keys": (GOOD + "".join(f"x.y.z.a{number} = 1\n" for number in range(100_000)), "unknown key"),
    "lists": (GOOD + f"x = {'[' * 900}{']' * 900}\n", "too many lists within lists"),
    "chambers": (GOOD.replace("[end_effector]", chambers(3000) + "[end_effector]"), "give at most 100"),
    "overlapping chambers": (
        problem_text("", chambers=()) + chambers(100) + GOOD[GOOD.index("[end_effector]") :],
        "more faults)",
    ),
    "tasks": (GOOD + tasks(300), "task: has too many entries; give at most 50"),
    "pressures": (tiny(pressure="{ " + ", ".join(f'c{n} = "1 kPa"' for n in range(50_000)) + " }"), "give at most 100"),
    "points": (
        tiny(objective=f'{{ kind = "match_curve", control_points = [{20_000 * """["0 mm", "0 mm", "0 mm"], """}] }}'),
        "give at most 1000",
    ),
    "mirrors": (
        GOOD.replace("[[body", "symmetry = { mirror = [" + 100_000 * '"xz", ' + "] }\n[[body", 1),
        "give at most 3",
    ),
    "name": (GOOD.replace('"extend"', f'"{"t" * 300}"'), "task[0].name: has 300 characters; use at most 64"),
    "title": (tiny(title=f'"{"x" * 1_000_000}"'), "title: has 1000000 characters; use at most 300"),
    "motion": (tiny(objective=f'{{ motion = "{"x" * 1_000_000}" }}'), "is not a known value"),
    "rubber": (GOOD.replace("Hei-Cast 8400", "x" * 1_000_000), "is not in the library"),
    "escapes": (tiny(length=r'"\u001b[2J\u202e\u0085"'), r"\x1b[2J\u202e"),
    "escapes in keys": (GOOD + r'"\u001b[2J" = 1', r"\u001b[2J"),
}


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What is said about each file, by a process with limits; nothing about those that it did not get to."""
    folder = tmp_path_factory.mktemp("files")
    os.mkfifo(folder / "pipe")
    (folder / "long.py").write_text("#" * 3_000_000)
    paths = {}
    for number, (name, (text, _)) in enumerate(FILES.items()):
        paths[str(folder / f"{number}.toml")] = name
        (folder / f"{number}.toml").write_text(text, encoding="utf-8")
    os.mkfifo(folder / "pipe.toml")
    paths |= {str(folder / "pipe.toml"): "itself a pipe", "/dev/zero": "itself a device"}
    limits = [str(SECONDS), str(BYTES)]
    ended = subprocess.run(
        [sys.executable, "-c", CHILD, *limits, *paths], capture_output=True, encoding="utf-8", timeout=600, check=False
    )
    found = dict(json.loads(line) for line in ended.stdout.splitlines())
    return {name: found.get(path, "nothing").replace(path, "FILE") for path, name in paths.items()}


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="the size of the process is read from /proc")
@pytest.mark.parametrize("name", [*FILES, "itself a pipe", "itself a device"])
def test_one_short_line_in_little_time_and_memory(said, name):
    words = FILES[name][1] if name in FILES else "it is a device or a pipe, not a file"
    assert words in said[name]
    assert len(said[name]) <= 300 and said[name].isprintable()


def test_texts_and_tables_are_bounded_too():
    for action in (
        lambda: loads(GOOD + "#" * 3_000_000),
        lambda: Problem(**{"k" * 10_000_000: 1}),
        lambda: loads(GOOD).with_changes({"a." * 100_000 + "b": 1}),
        lambda: loads(GOOD).with_changes({"body.length": 10**5000}),
        lambda: loads(GOOD).with_changes({f"task[{'9' * 5000}].weight": 1.0}),
        lambda: load("x\0y"),
        lambda: load("x" * 100_000),
    ):
        with pytest.raises(ProblemError) as caught:
            action()
        assert len(str(caught.value)) <= 300 or "x" * 100 in str(caught.value)
        assert str(caught.value).isprintable()


def test_what_messages_repeat_is_short_and_does_nothing_to_a_terminal():
    assert printable("a\x1b[2J\nb\tc\u202e\x85d\ud800 é\u202f1") == r"a\x1b[2J b c\u202e d\ud800 é" + "\u202f1"
    assert str(ProblemError(ProblemError("\x07"))) == r"\x07"
    assert short("x" * 61) == "x" * 60 + "… (61 characters)" and short(10**5000) == "of about 5000 digits"
    assert short(7) == "7" and clipped("short", 300) == "short"
    assert len(clipped("x" * 1000 + "end", 300)) == 300 and clipped("x" * 1000 + "end", 300).endswith("end")
