"""The second measurement of a run's limits: it agrees with the history, and notices a claim that is too good."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from certifying import certified
from records import entry, one_element
from tiny import tiny

from pneumorph.geometry.tube import starting_body
from pneumorph.problem import loads
from pneumorph.results import to_json
from pneumorph.run import StoredDesign, create

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "recheck.py"
SERIES = (
    'radius = "4 mm"\ncenter = ["0 mm", "0 mm"]\nspan = ["3 mm", "21 mm"]\n',
    'radius = "4 mm"\ncenter = ["0 mm", "0 mm"]\nspan = ["3 mm", "11.5 mm"]\nends = "pole"\n'
    '[[body.chamber]]\nname = "B"\nradius = "3 mm"\ncenter = ["1 mm", "0.5 mm"]\nspan = ["13.6 mm", "21.2 mm"]\n',
)
DOMED = (
    SERIES[0],
    'radius = "4 mm"\ncenter = ["0.5 mm", "0 mm"]\nspan = ["3 mm", "20 mm"]\nends = "pole"\n',
)
BODIES = {
    "one chamber": tiny(control_density='"0.3 /mm"\nripple = { amplitude = "0.3 mm", period = "12 mm" }'),
    "a flat end before a pole": tiny(control_density='"0.5 /mm"').replace(*SERIES)
    + '[limits]\ncurvature = "9 /mm^2"\n',
    "a domed tip": tiny(control_density='"0.4 /mm"')
    .replace("[[body.chamber]]", '[body.dome]\nplate = "3.5 mm"\n[[body.chamber]]')
    .replace(*DOMED),
}


def recheck(path):
    return subprocess.run([sys.executable, SCRIPT, path], capture_output=True, encoding="utf-8")


@pytest.fixture(scope="module", params=BODIES)
def stored(request, tmp_path_factory):
    """A run directory with one design, the starting body, and what the report says of it."""
    problem = loads(BODIES[request.param])
    body = starting_body(problem.tubes)
    path = tmp_path_factory.mktemp("recheck") / "run"
    run = create(path, problem)
    line = entry(0, limits=certified(body, problem.limits).values())
    names = [chamber.name for chamber in problem.body.chamber]
    run.record(line, StoredDesign.of(body, {"extend": dict.fromkeys(names, 0.06)}), one_element(), {})
    return path, line


def test_it_agrees_with_the_report(stored):
    path, line = stored
    found = recheck(path)
    assert found.returncode == 0, found.stdout + found.stderr
    cells = found.stdout.splitlines()[2].replace("(", " ").replace(")", " ").split()
    # What is certified is never better than what is measured, and far from its bound a little worse.
    assert 0.97 * float(cells[1]) <= line.limits["wall_mm"] <= float(cells[1]) + 1e-3
    assert float(cells[5]) - 1e-4 <= line.limits["curvature"] <= float(cells[5]) + 0.02 * 0.3


@pytest.mark.parametrize(("key", "factor"), [("wall_mm", 1.04), ("curvature", 0.9)])
def test_a_claim_that_is_too_good_is_noticed(stored, key, factor):
    path, line = stored
    history = path / "history.jsonl"
    written = history.read_text(encoding="utf-8")
    spoiled = replace(line, limits={**line.limits, key: line.limits[key] * factor})
    history.write_text(json.dumps(to_json(spoiled)) + "\n")
    try:
        found = recheck(path)
    finally:
        history.write_text(written)
    assert found.returncode == 1
    assert f"worse than reported: {key}" in found.stdout


def test_what_is_no_run_is_told_in_one_line(tmp_path):
    found = recheck(tmp_path)
    assert found.returncode == 2
    assert len(found.stderr.splitlines()) == 1
