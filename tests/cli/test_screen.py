"""What a design run prints: rows that fit the screen, marks, rejected designs, and the last words."""

import io
import math
import re
from dataclasses import replace

import pytest
from certifying import certified
from records import entry, one_element, task_result
from rich.console import Console
from runs import analysed, line, waving_run
from tiny import tiny

from pneumorph.cli.columns import columns_of, heading, row, width_of
from pneumorph.cli.outcome import how_many, limits_table, outcome, tasks_table
from pneumorph.cli.screen import Screen
from pneumorph.cli.verdict import verdict
from pneumorph.geometry.tube.start import starting_body
from pneumorph.interface.runs import Run
from pneumorph.limits.report import LimitReading
from pneumorph.limits.table import in_history
from pneumorph.optimize import DesignAccepted, DesignRejected, Remeshed
from pneumorph.problem import loads
from pneumorph.problem.models import Scaling
from pneumorph.results import FineResult, RunResult

PROBLEM = loads(tiny().replace("[mesh]", '[limits]\nenvelope = { radius = "9 mm" }\n[mesh]'))
KEPT = {
    "wall_mm": 3.0,
    "fold_mm": 2.0,
    "curvature": 0.1,
    "skew": 0.0,
    "stretch": 0.01,
    "envelope_mm": 8.0,
    "margin": 1.4,
}
BROKEN = KEPT | {"wall_mm": 1.85, "curvature": 0.31}
RESULT = RunResult(
    title="Tiny", completed=True, reason="nothing improves it", iterations=3, best=3, objective=-0.2, optimality=0.1,
    motions={}, tasks={"extend": task_result(translation=(0.0, 0.0, 0.25))}, limits=KEPT, held=True,
    seconds={"total": 75.0}, peak_memory=None, versions={},
)  # fmt: skip


def printed(*parts, width=100):
    text = io.StringIO()
    console = Console(file=text, width=width)
    for part in parts:
        console.print(part)
    return text.getvalue()


@pytest.mark.parametrize("verbose", [False, True])
@pytest.mark.parametrize("width", [40, 60, 80, 100, 140])
def test_rows_fit_the_screen(width, verbose):
    columns = columns_of(PROBLEM, width, verbose)
    shown = [heading(columns).plain, *(row(PROBLEM, columns, entry(7, limits=each)).plain for each in (KEPT, BROKEN))]
    assert {len(text) for text in shown} == {width_of(columns)} and width_of(columns) <= width
    titles = [column.title for column in columns]
    assert titles[:2] == ["it", "extend"]
    assert ("wall mm" in titles) == (width >= 80) and ("most used limit" in titles) == (width < 80)
    assert ("equiv." in titles) == (verbose and width == 140)


def test_rows_beyond_a_limit_are_marked_without_colour():
    columns = columns_of(PROBLEM, 100, False)
    kept, broken = (row(PROBLEM, columns, entry(7, limits=each)).plain for each in (KEPT, BROKEN))
    assert "!" not in kept
    assert broken.startswith("!") and "1.85!" in broken and "0.310!" in broken and broken.count("!") == 3
    narrow = columns_of(PROBLEM, 40, False)
    assert "wall 1.85 mm!" in row(PROBLEM, narrow, entry(7, limits=BROKEN)).plain
    assert "–!" in row(PROBLEM, columns, entry(7, limits=KEPT | {"skew": None})).plain


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"envelope_mm": 8.99}, "envelope 8.99 mm "),
        ({"envelope_mm": 8.99, "wall_mm": 2.0}, "wall 2.00 mm "),
        ({"margin": 1.16}, "margin 1.160 "),
        ({}, "envelope 8.00 mm "),
    ],
)
def test_where_there_is_no_room_the_limit_of_which_most_is_used_is_named(limits, said):
    narrow = columns_of(PROBLEM, 60, False)
    shown = row(PROBLEM, narrow, entry(7, limits=KEPT | limits)).plain
    assert said in shown


def test_a_margin_up_to_which_the_path_was_followed_without_a_limit_point_is_told_as_such():
    limits = KEPT | {"margin": 1.25 * 1.15}
    columns = columns_of(PROBLEM, 140, False)
    assert "≥ 1.44 " in row(PROBLEM, columns, entry(7, limits=limits)).plain
    assert "1.400 " in row(PROBLEM, columns, entry(7, limits=KEPT)).plain
    (margin,) = [(limit, limits["margin"], bound) for limit, key, bound in in_history(PROBLEM) if key == "margin"]
    assert re.search("margin +at least 1.44 +≥ 1.15 +all tasks", printed(limits_table((), [margin])))


@pytest.mark.parametrize(("fine", "shown"), [(0.107, "±7.0 %"), (0.3, "> 100 %")])
def test_the_error_of_the_mesh_is_shown_of_designs_of_which_it_is_known(fine, shown):
    columns = columns_of(PROBLEM, 140, False)
    assert [column.title for column in columns][-1] == "mesh"
    finer = {"extend": FineResult(-fine, {}, (0.0, 0.0, fine), (0.0, 0.0, 0.0), {})}
    known, unknown = (row(PROBLEM, columns, entry(7, limits=KEPT, finer=each)).plain for each in (finer, {}))
    assert known.endswith(f" {shown}") and not unknown.strip().endswith("%") and len(known) == len(unknown)


def test_motions_that_are_limited_have_their_units():
    limits = '[limits]\nmotion = { tilt = "1 deg", shift_x = "1 mm" }\nsensitivity = "1 mm/kPa"\n'
    problem = loads(tiny().replace("[mesh]", f"{limits}[mesh]"))
    values = KEPT | {"tilt_deg": 1.402, "shift_x_mm": 0.5, "sensitivity_of_length": 0.1}
    titles = [column.title for column in columns_of(problem, 200, False)]
    assert {"tilt °", "shift_x mm", "sensitivity mm/kPa"} <= set(titles)
    narrow = columns_of(problem, 45, False)
    shown = row(problem, narrow, entry(7, limits=values)).plain
    assert shown.endswith("tilt 1.402°!") and len(shown) == width_of(narrow)


def test_a_limit_has_the_same_word_everywhere():
    limits = PROBLEM.limits.model_copy(update={"scaling": Scaling()})
    problem = PROBLEM.model_copy(update={"limits": limits})
    titles = [column.title for column in columns_of(problem, 200, False)]
    for limit, _, _ in in_history(problem):
        reading = LimitReading(limit.name, 1.0, 1.0, "A", 0.0, 0.0, 1.0)
        assert {limit.word, f"{limit.word} {limit.unit}"} & set(titles)
        assert str(reading).startswith(f"{limit.word} is ")
        assert limit.word in printed(limits_table((reading,)))


def test_rejected_designs_are_named():
    console = Console(file=io.StringIO(), width=100)
    screen = Screen(PROBLEM, console)
    screen.show(DesignRejected(3, "the gain was 0.01 of the predicted one", 0.1))
    screen.show(DesignRejected(3, "limits could not be satisfied: wall", 0.05))
    assert console.file.getvalue() == (
        "     design 3, trial 1 rejected: the gain was 0.01 of the predicted one; the next step is at most 0.1 mm\n"
        "     design 3, trial 2 rejected: limits could not be satisfied: wall; the next step is at most 0.05 mm\n"
    )
    quiet = Console(file=io.StringIO(), width=100)
    Screen(PROBLEM, quiet, quiet=True).show(DesignRejected(3, "the gain was 0.01 of the predicted one", 0.1))
    assert quiet.file.getvalue() == ""


def test_what_is_remeshed_is_named():
    console = Console(file=io.StringIO(), width=140)
    screen = Screen(PROBLEM, console)
    screen.show(Remeshed(4, "an element is nearly flat", 900, 0.1, ("sector 3",)))
    screen.show(Remeshed(5, "an element is nearly flat", 2700, 0.1, ()))
    assert console.file.getvalue() == (
        "     design 4: remeshed with 900 elements, one of 3 equal sectors of the body; in the old "
        "mesh, an element is nearly flat\n"
        "     design 5: remeshed with 2700 elements; in the old mesh, an element is nearly flat\n"
    )


def test_a_start_that_moves_the_other_way_is_told_beside_its_row():
    for moved, told in ((-0.3, True), (0.3, False)):
        console = Console(file=io.StringIO(), width=140)
        screen = Screen(PROBLEM, console)
        start = replace(entry(0), tasks={"extend": task_result(translation=(0.0, 0.0, moved))})
        for number in range(2):
            own = replace(start, iteration=number)
            screen.show(DesignAccepted(number, own, starting_body(PROBLEM.tubes), {}, one_element(), {}))
        text = console.file.getvalue()
        assert text.count("extend: extension goes the other way at first") == told


def test_the_number_of_designs_is_said():
    assert how_many(3, RESULT) == "3 designs in 1:15 min; the loop ended because nothing improves it."
    assert how_many(40, replace(RESULT, iterations=1)).startswith("1 design of at most 40 in 1:15 min; ")


def test_tasks_are_shown_from_start_to_end():
    unstable = replace(RESULT, tasks={"extend": replace(RESULT.tasks["extend"], stable=False)})
    (shown,) = printed(tasks_table(PROBLEM, entry(0), RESULT)).splitlines()[1:]
    assert shown.split() == ["extend", "extension", "0.10", "mm", "→", "0.25", "mm", "60", "kPa", "stable"]
    assert "not stable !" in printed(tasks_table(PROBLEM, entry(0), unstable))
    crossing = replace(RESULT, tasks={"extend": replace(RESULT.tasks["extend"], self_intersecting=True)})
    assert "stable, self-intersecting !" in printed(tasks_table(PROBLEM, entry(0), crossing))


HELD = loads(
    tiny(
        pressure='{ A = { start = "50 kPa", min = "0 kPa", max = "60 kPa" } }',
        objective='{ kind = "minimize", of = "pressure" }',
    ).replace("[mesh]", '[limits]\nat_least = { bending_y = "-30 deg" }\n[mesh]')
)
"""The least pressure that bends the tip by 30° to the other side."""

BENT = task_result(objective=38.2, rotation=(0.0, math.radians(-30.05), 0.0))
"""What a design of it achieves."""


@pytest.mark.parametrize("width", [45, 140])
def test_motions_that_a_task_must_have_are_always_shown(width):
    columns = columns_of(HELD, width, False)
    titles = [column.title for column in columns]
    assert titles[:3] == ["it", "extend", "least bending_y °"] and ("wall mm" in titles) == (width == 140)
    least = KEPT | {"least_bending_y_deg": 30.05}
    shown = row(HELD, columns, entry(7, tasks={"extend": BENT}, limits=least)).plain
    assert shown.split()[:4] == ["7", "38.20", "kPa", "-30.050"] and len(shown) == width_of(columns)


def test_motions_that_a_task_must_have_are_in_its_summary():
    start = entry(0, tasks={"extend": replace(BENT, objective=50.0, rotation=(0.0, math.radians(-31.0), 0.0))})
    ended = replace(RESULT, tasks={"extend": BENT})
    pressure, motion = printed(tasks_table(HELD, start, ended)).splitlines()[1:]
    assert pressure.split()[:6] == ["extend", "pressure", "50.00", "kPa", "→", "38.20"]
    assert " ".join(motion.split()) == "bending about y -31.00° → -30.05° (-30° or farther)"
    said = verdict(HELD, [start, entry(7, tasks={"extend": BENT})]).plain.strip()
    assert said == ("No target was stated; extend: pressure of 38.20 kPa, bending about y -30.05° (-30° or farther).")
    # The motion that is made largest is not told twice.
    own = loads(tiny().replace("[mesh]", '[limits]\nat_least = { extension = "0.1 mm" }\n[mesh]'))
    assert len(printed(tasks_table(own, entry(0), RESULT)).splitlines()) == 2


@pytest.mark.parametrize("width", [60, 100])
def test_limits_have_their_worst_value_and_its_place(width):
    body = starting_body(PROBLEM.tubes)
    readings = certified(body, PROBLEM.limits).readings
    text = printed(limits_table(readings), width=width)
    firsts = [one.split()[0] for one in text.splitlines() if not one.startswith(" ")]
    assert firsts == ["limit", "wall", "fold", "curvature", "skew", "stretch", "envelope"]
    assert max(len(one.rstrip()) for one in text.splitlines()) <= width and "!" not in text
    wall = text.splitlines()[1].split()
    assert wall[:6] == ["wall", "3", "mm", "≥", "2", "mm"] and wall[6] == "A" and wall[-1] == "3.0"
    assert "(" not in text and "x mm" in text.splitlines()[0], "numbers in columns"
    broken = tuple(replace(reading, bound=4.0) if reading.limit == "wall" else reading for reading in readings)
    assert "3 mm !" in printed(limits_table(broken))
    skew = next(each for each in readings if each.limit == "skew")
    assert "skew is 0, must be at most 0.2 " in str(skew) and "e-" not in text.split("skew")[1].split("≤")[0]
    # What nobody has asked for is shown where it is broken.
    area = tuple(replace(each, value=0.01) for each in readings if each.limit == "area")
    assert "area" not in text and "0.01 !" in printed(limits_table(area))


def test_the_last_words_say_which_design_is_the_best_and_where(tmp_path):
    fields = analysed(PROBLEM, 0.0)
    run = Run(waving_run(tmp_path / "run", PROBLEM, 2, {0: fields, 1: fields}))
    text = printed(*outcome(run, line(PROBLEM, 0, {"extend": {"A": 0.06}}), RESULT), width=300)
    assert f"number 1, the last: {tmp_path}/run/designs/0001.npz." in text
    assert text.rstrip().endswith(f"pneumorph view {tmp_path}/run")
