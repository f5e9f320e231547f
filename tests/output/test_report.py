"""The page of a run: its data, its size, and that nothing in a problem file gets out of its place."""

import base64
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from certifying import certified
from records import one_element
from runs import analysed, ended, inflated, line, waved, waving_run
from texts import EXTEND, TWO_BESIDE, problem_text
from tiny import tiny

import pneumorph as pm
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import cap_points
from pneumorph.limits import of_shape
from pneumorph.limits.shares import usage
from pneumorph.limits.table import BY_NAME
from pneumorph.mesh.tube import mesh_body
from pneumorph.output.packed import Steps, in_parts, in_steps, pack, unpack
from pneumorph.output.report import facts_and_shapes, page_of, write_report
from pneumorph.output.report_data import facts_of
from pneumorph.output.report_limits import MOST, packed_usage
from pneumorph.output.report_shapes import _changes, packed_states
from pneumorph.problem import load, loads
from pneumorph.results import Fields, FineResult, nodal_stretch, unpack_fields
from pneumorph.run import StoredDesign, create, open_run

ROOT = Path(__file__).parents[2]
TASK = '[[task]]\nname = "{}"\npressure = {{ A = "60 kPa" }}\nobjective = {{ motion = "extension" }}\n'


def block_of(path: Path) -> tuple[dict, dict]:
    """Facts and arrays of a page."""
    text = re.search(r'id="block">([^<]*)</script>', path.read_text(encoding="utf-8"))
    assert text is not None
    return unpack(base64.b64decode(text[1]))


@pytest.fixture(scope="module")
def problem():
    return loads(tiny())


@pytest.fixture(scope="module")
def fields(problem):
    """Of the waved body under a pressure that inflates it."""
    return analysed(problem, 0.3)


@pytest.fixture(scope="module")
def run(problem, fields, tmp_path_factory):
    """A run of three designs, the last with its way to the pressures."""
    start = Fields(fields.mesh, fields.u, fields.stretch)
    run = waving_run(tmp_path_factory.mktemp("runs") / "run", problem, 3, {0: start, 2: fields})
    ended(run)
    return run


def test_packed_numbers_come_back():
    rng = np.random.default_rng(0)
    walk = np.cumsum(rng.normal(0, 0.2, (5, 7, 3)), axis=0) + 100.0
    arrays = {
        "walk": in_steps(walk, 1e-3, differences=True),
        "parts": in_parts(rng.normal(size=(4, 3))),
        "small": Steps(np.array([-128 + 1, 0, 127])),
        "large": Steps(np.array([0, 2**31 - 1, -(2**31) + 1])),
        "none": in_parts(np.zeros((0, 3))),
    }
    facts, back = unpack(pack({"ü": [1, None, "</script>"]}, arrays))
    assert facts == {"ü": [1, None, "</script>"]}
    for name, array in arrays.items():
        np.testing.assert_allclose(back[name], array.step * array.values, rtol=1e-15)
    np.testing.assert_allclose(back["walk"], walk, atol=0.51e-3)


def test_what_the_page_has_is_what_is_stored(run, fields):
    path = write_report(run)
    assert path == run.path / "report.html"
    facts, arrays = block_of(path)
    result = json.loads((run.path / "result.json").read_text(encoding="utf-8"))
    assert facts["result"].items() >= result.items()
    assert [entry["iteration"] for entry in facts["history"]] == [0, 1, 2]
    assert facts["history"][2]["motions"]["extend"]["text"] == "3.00 mm"
    for number in range(3):
        design = run.load_design(number)
        np.testing.assert_allclose(arrays["net exterior"][number], design.exterior, atol=0.51e-3)
        np.testing.assert_allclose(arrays["net chamber A"][number], design.chambers["A"], atol=0.51e-3)
    assert facts["problem"] == (run.path / "problem.toml").read_text(encoding="utf-8")
    assert [state["design"] for state in facts["states"]] == [0, 2]
    stops = facts["states"][1]["tasks"][0]["stops"]
    np.testing.assert_allclose([stop["pressures"]["A"] for stop in stops], np.linspace(0, 0.06, 7))
    last, skin = stops[-1]["name"], fields.mesh.points[fields.skin]
    points, moved = arrays["points 2"], arrays[f"u {last}"]
    nearest = np.linalg.norm(points[:, None] - skin, axis=2)
    assert nearest.min(axis=1).max() < 1e-3
    np.testing.assert_allclose(moved, fields.u["extend"][fields.skin][nearest.argmin(axis=1)], atol=1e-4)
    assert arrays[f"stretch {last}"].max() == pytest.approx(fields.stretch["extend"][fields.skin].max(), abs=1e-3)


def test_designs_whose_error_by_the_mesh_is_known_have_it_in_their_results(run):
    start, *others = run.history()
    finer = {"extend": FineResult(-1.5, {}, (0.0, 0.0, 1.5), (0.0, 0.0, 0.0), {})}
    shown = [each["motions"]["extend"] for each in facts_of(run, [replace(start, finer=finer), *others])["history"]]
    assert shown[0]["fine"] == pytest.approx(1.5) and "fine" not in shown[1]
    assert shown[0]["text"] == f"1.00 ± {abs(1.5 - shown[0]['value']):.2g} mm (mesh)"


def test_motions_that_a_task_must_have_are_in_its_results(run):
    problem = run.problem.with_changes({"limits.at_least": {"shift_x": "2 mm"}})
    with_least = SimpleNamespace(problem=problem, path=run.path, result=run.result)
    shown = facts_of(with_least, run.history())["history"][0]["motions"]["extend"]
    assert shown["text"] == f"{shown['found']}, shift along x 0.00 mm (at least 2 mm)"


def test_limits_are_shown_without_rounding_errors(run):
    *before, last = run.history()
    key = next(iter(last.limits))
    last = replace(last, limits={**last.limits, key: 6.4e-11})
    shown = facts_of(run, [*before, last])["history"][-1]["limits"]
    assert shown == {**last.limits, key: 0.0}


def test_shares_of_limits_agree_with_the_certificate(run, problem):
    facts, arrays = block_of(write_report(run))
    for number in (0, 2):
        readings = certified(run.load_design(number).body(problem), problem.limits).readings
        used = {
            each.limit: BY_NAME[each.limit].used(each.attained, each.bound) for each in readings if each.limit != "ends"
        }
        shares = [arrays[f"used {surface['key']}"][number] for surface in facts["surfaces"]]
        assert max(map(np.max, shares)) == pytest.approx(min(max(used.values()), MOST), rel=0.03)
        at = max(range(len(shares)), key=lambda place: shares[place].max())
        where = np.unravel_index(shares[at].argmax(), shares[at].shape)
        limit = arrays[f"limit {facts['surfaces'][at]['key']}"][number][where]
        if max(used.values()) < MOST:
            assert facts["limit_words"][int(limit)] == max(used, key=lambda name: used[name])


def test_shares_that_are_known_are_not_computed_again(run, problem, monkeypatch):
    limits = of_shape.limits_of(problem, starting_body(problem.tubes))
    bodies = [run.load_design(number).body(problem) for number in (0, 1, 2)]
    known = {}
    _, arrays = packed_usage(limits, bodies[:2], known)
    asked = []
    monkeypatch.setattr(of_shape, "usage", lambda kinds, at: asked.append(at.body) or usage(kinds, at))
    _, more = packed_usage(limits, bodies, known)
    assert len(asked) == 1 and len(known) == 3
    for name, array in arrays.items():
        np.testing.assert_array_equal(more[name].values[:2], array.values)
    assert packed_usage(limits, bodies)[1]["used exterior"].values.max() == more["used exterior"].values.max()


def test_triangles_bound_the_rubber(run, fields):
    """They are closed and look from solid to void: but for being flat, their volume is that of the mesh."""
    facts, arrays = block_of(write_report(run))
    points, triangles = arrays["points 2"], arrays["triangles 2"].astype(int).reshape(-1, 3)
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    assert np.einsum("ti,ti->", a, np.cross(b, c)) / 6 == pytest.approx(fields.mesh.volume(), rel=0.04)
    parts = facts["states"][1]["parts"]
    assert parts[-1]["vertices"] == len(points) and parts[-1]["triangles"] == len(triangles)
    # The flat ends of a chamber are parts of their own, so that their rims are sharp.
    assert [part["face"] for part in parts].count("chamber A") == 3


def test_inflation_is_stored_and_parts_become_whole(problem, fields):
    way = fields.inflation["extend"]
    assert way.u.dtype == np.float32 and way.u.shape == (5, len(fields.skin), 3)
    # Nearly in step with the pressure, and a part of what there is at the whole.
    height = way.u[..., 2].max(axis=1) / fields.u["extend"][:, 2].max()
    np.testing.assert_allclose(height, way.parts, atol=0.1)
    back = unpack_fields(fields.pack())
    np.testing.assert_array_equal(back.inflation["extend"].stretch, way.stretch)
    symmetric = tiny().replace("[[body.chamber]]", 'symmetry = { mirror = ["xz", "yz"] }\n[[body.chamber]]')
    quarter = analysed(loads(symmetric), 0.3)
    assert quarter.mesh.mirrors == ("xz", "yz")
    whole = quarter.whole()
    last = whole.inflation["extend"].u[-1]
    full = 5 / 6 * whole.u["extend"][whole.skin]
    assert np.abs(last - full).max() < 0.1 * np.abs(full).max()
    places = whole.mesh.points[whole.skin]
    for signs in ([1, -1, 1], [-1, 1, 1]):
        image = np.linalg.norm(places[:, None] - places * signs, axis=2).argmin(axis=1)
        np.testing.assert_allclose(last[image], last * signs, atol=1e-6)


def layer(fields):
    """What 1 mm of rubber on the whole chamber does to the extension, mm."""
    corners = fields.mesh.faces["chamber A"][:, :3]
    first, second, third = (fields.mesh.points[corners[:, k]] for k in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=1)
    return areas @ fields.thickening["extend"]["extension"][corners].mean(axis=1)


def test_what_more_rubber_does_is_stored_and_told(problem, fields, run):
    """In the unit of the motion, at the vertices of the skin; of a quarter as of the whole body."""
    known = fields.thickening["extend"]["extension"]
    back = unpack_fields(fields.pack()).thickening["extend"]["extension"]
    np.testing.assert_allclose(back, known, rtol=1e-6, atol=1e-9)
    states, arrays, _ = packed_states(run, run.history())
    assert "thickening" not in states[0]["tasks"][0]
    (told,) = states[-1]["tasks"][0]["thickening"]
    assert told["words"].startswith("Extension") and told["words"].endswith(", mm")
    packed = arrays[told["name"]]
    skin = fields.whole().skin
    assert packed.values.max() * packed.step == pytest.approx(10.0 * known[skin].max(), rel=1e-3)
    assert packed.values.min() * packed.step == pytest.approx(10.0 * known[skin].min(), rel=1e-3)
    symmetric = tiny().replace("[[body.chamber]]", 'symmetry = { mirror = ["xz", "yz"] }\n[[body.chamber]]')
    assert layer(fields) == pytest.approx(layer(analysed(loads(symmetric), 0.3).whole()), rel=0.03)


def test_every_motion_of_a_task_has_its_change(fields):
    both = tiny().replace(
        'kind = "maximize", motion = "extension"', 'kind = "motion", extension = "1 mm", bending_y = "2 deg"'
    )
    known = fields.thickening["extend"]["extension"]
    stored = replace(fields, thickening={"extend": {"extension": known, "bending_y": 2.0 * known}})
    (changes,) = _changes(loads(both), stored).values()
    assert [each.words.rpartition(", ")[2] for each in changes] == ["mm", "°"]
    assert len({each.motion for each in changes}) == 2
    one, other = (each.values for each in changes)
    np.testing.assert_allclose(other, np.degrees(2.0 * one))


@pytest.mark.slow
def test_a_page_of_forty_designs_is_small(tmp_path):
    """Seven pressures of two tasks, with nets and a mesh as large as those of the examples."""
    text = (ROOT / "examples" / "linear.toml").read_text(encoding="utf-8")
    problem = loads(text.replace("[limits]", f"{TASK.format('half').replace('60', '30')}\n[limits]"))
    problem = problem.with_changes({"body.symmetry": False, "body.control_density": "0.6 /mm"})
    body = waved(starting_body(problem.tubes), 1.0)
    mesh = mesh_body(body, 3.0).mesh
    u = mesh.points * [0.02, 0.02, 0.3] + np.random.default_rng(0).normal(0, 1e-3, mesh.points.shape)
    stretch = nodal_stretch(mesh, u)
    tasks = [task.name for task in problem.task]
    fields = inflated(Fields(mesh, dict.fromkeys(tasks, u), dict.fromkeys(tasks, stretch)))
    run = waving_run(tmp_path / "run", problem, 40, {0: fields, 39: fields}, waves=0.05)
    path = write_report(run, tmp_path / "elsewhere" / "page.html")
    assert path.stat().st_size < 5e6
    facts, _ = block_of(path)
    assert [len(task["stops"]) for state in facts["states"] for task in state["tasks"]] == [7] * 4


def test_a_large_mesh_is_thinned_and_the_page_says_so(run, monkeypatch):
    _, full = block_of(write_report(run, run.path / "thin.html"))
    monkeypatch.setattr("pneumorph.output.report_shapes.MOST_NUMBERS", 2000)
    facts, arrays = block_of(write_report(run, run.path / "thin.html"))
    assert len(facts["notes"]) == 2 and all("to keep this file small" in note for note in facts["notes"])
    stops = facts["states"][1]["tasks"][0]["stops"]
    assert len(stops) < 7 and stops[-1]["pressures"] == {"A": 0.06}
    assert len(arrays["points 2"]) < len(full["points 2"]) / 2


NASTY = "</script><script>alert(1)</script><!-- {{block}} \" ' & <b>"


def test_nothing_of_a_problem_file_becomes_html(fields, tmp_path):
    code = f'def objective(f):\\n    return f.volume["A"]  # {NASTY}'.replace('"', '\\"')
    text = tiny(title=json.dumps(NASTY), objective=f'{{ kind = "custom", code = "{code}" }}')
    # The quotes were escaped once too often where they are part of the code's own escapes.
    run = waving_run(tmp_path / "run", loads(text.replace('\\\\"', '\\"')), 2, {0: fields, 1: fields})
    page = write_report(run).read_text(encoding="utf-8")
    assert "alert(1)" not in page.replace("&lt;script&gt;alert(1)", "")
    empty = page_of([b""], "")
    assert page.count("<script") == empty.count("<script") and page.count("<b>") == empty.count("<b>")
    facts, _ = block_of(run.path / "report.html")
    assert facts["title"] == NASTY and NASTY in facts["problem"].replace('\\"', '"')


def test_runs_without_an_end_or_fields(run, problem, fields, tmp_path):
    one = waving_run(tmp_path / "one", problem, 1, {0: fields})
    facts, _ = block_of(write_report(one))
    assert facts["result"] is None and len(facts["history"]) == 1
    ended(one, "the computation failed: there is no equilibrium", completed=False)
    facts, _ = block_of(write_report(one))
    assert not facts["result"]["completed"] and "no equilibrium" in facts["result"]["reason"]
    # As runs of the first versions are.
    shutil.rmtree(one.path / "fields")
    facts, arrays = block_of(write_report(one))
    assert facts["states"] == [] and "net exterior" in arrays


def test_ten_chambers(tmp_path):
    places = [
        (f"c{k}", 1.2, f"{7 * np.cos(2 * np.pi * k / 10)} mm", f"{7 * np.sin(2 * np.pi * k / 10)} mm")
        for k in range(10)
    ]
    body = 'control_density = "0.5 /mm"'
    problem = loads(problem_text(EXTEND.replace("{ A =", "{ c0 ="), radius=11, chambers=tuple(places), body=body))
    run = waving_run(tmp_path / "run", problem, 2, {0: one_element(), 1: one_element()})
    facts, arrays = block_of(write_report(run))
    assert len(facts["surfaces"]) == 11 and all(f"net {surface['key']}" in arrays for surface in facts["surfaces"])


def test_cad_is_in_the_page_and_large_cad_is_named(run, monkeypatch):
    (run.path / "make").mkdir()
    (run.path / "make" / "body.step").write_bytes(b"ISO-10303-21;")
    facts, _ = block_of(write_report(run))
    assert base64.b64decode(facts["files"][0]["content"]) == b"ISO-10303-21;"
    monkeypatch.setattr("pneumorph.output.report_data.MOST_STEP", 3)
    facts, _ = block_of(write_report(run))
    assert facts["files"] == [{"name": "body.step", "bytes": 13, "content": None}]


def test_targets(fields, tmp_path):
    arm = load(ROOT / "examples" / "arm_planar.toml")
    run = create(tmp_path / "run", arm)
    pressures = {"shape": {"A": 0.06}}
    design = StoredDesign.of(starting_body(arm.tubes), pressures)
    run.record(line(arm, 0, pressures), design, one_element(), {})
    shutil.rmtree(run.path / "fields")
    facts, _ = block_of(write_report(run))
    target = facts["tasks"][0]["target"]
    assert target["line"][0] == [0, 0, 0] and target["line"][-1] == [84, 0, 124] and len(target["sections"]) == 10
    assert facts["gravity"] == [-1, 0, 0]


def test_a_target_stands_behind_what_was_found(tmp_path):
    problem = loads(tiny(objective='{ kind = "motion", bending_y = "60 deg" }'))
    facts, _ = block_of(write_report(waving_run(tmp_path / "run", problem, 1, {0: one_element()})))
    motion = facts["history"][0]["motions"]["extend"]
    assert motion["word"] == "bending about y" and motion["text"] == f"{motion['found']} (target 60°)"


def test_refusals(problem, run, tmp_path):
    nothing = create(tmp_path / "nothing", problem)
    with pytest.raises(ProblemError, match="there is no finished design in it yet; run pneumorph design first"):
        write_report(nothing)
    (tmp_path / "file").touch()
    with pytest.raises(ProblemError, match=r"cannot be written .*; name another file with --out"):
        write_report(run, tmp_path / "file" / "page.html")


def test_the_public_way(run, tmp_path):
    assert pm.open_run(run.path).report(tmp_path / "page.html") == tmp_path / "page.html"


def test_surfaces_in_the_browser_are_those_of_the_package(tmp_path):
    if shutil.which("node") is None:
        pytest.skip("there is no Node.js here to evaluate them")
    text = problem_text(EXTEND, radius=11, chambers=TWO_BESIDE, body='control_density = "0.4 /mm"')
    problem = loads(text.replace('name = "B"', 'name = "B"\nends = "pole"'))
    start = starting_body(problem.tubes)
    rng = np.random.default_rng(1)
    body = start.with_control_points(start.control_points() + rng.normal(0, 0.3, (start.n_points, 3)))
    run = create(tmp_path / "run", problem)
    pressures = {"extend": {"A": 0.06, "B": 0.0}}
    run.record(line(problem, 0, pressures), StoredDesign.of(body, pressures), one_element(), {})
    shutil.rmtree(run.path / "fields")
    (tmp_path / "block").write_bytes(facts_and_shapes(open_run(run.path), run.history()))
    command = ["node", str(ROOT / "tests" / "report" / "positions.mjs"), str(tmp_path / "block")]
    found = np.array(json.loads(subprocess.run(command, capture_output=True, check=True).stdout)).reshape(-1, 3)
    expected = []
    for surface in body.surfaces:
        rows, columns = surface.net.shape[:2]
        q, r = np.arange(4 * columns) / (4 * columns), np.linspace(0, 1, 4 * (rows - 3) + 1)
        expected.append(surface.sample(q, r).reshape(-1, 3))
        for tip in [tip for tip in (False, True) if not surface.poles[tip]]:
            expected.append(surface.end_rows[int(tip)].mean(axis=0)[None])
            expected += [cap_points(surface, tip, q, np.full(len(q), ring / 6)) for ring in range(1, 7)]
    # Nets are in the page to a micrometre, and the screen's numbers are single.
    np.testing.assert_allclose(found, np.concatenate(expected), atol=2e-3)


def test_free_obstacles_are_shown_where_their_places_are_known(tmp_path):
    ball = '[[obstacle]]\nname = "ball"\nkind = "sphere"\ncenter = ["0 mm", "30 mm", "8 mm"]\nradius = "6 mm"\n'
    springs = ", ".join(f'{axis} = "1 N/mm"' for axis in "xyz")
    held = 'hold = ["turn_x", "turn_y", "turn_z"]'
    text = tiny() + ball + f"free = {{ {held}, spring = {{ {springs} }} }}\n[contact]\nself = false\n"
    problem = loads(text.replace("[[task]]", '[[task]]\nmove = { ball = ["0 mm", "0 mm", "9 mm"] }', 1))
    run = waving_run(tmp_path / "run", problem, 1, {0: analysed(problem, 0.0)})
    ((design,), _, notes) = packed_states(run, run.history())
    first, *between, last = (stop["obstacles"] for stop in design["tasks"][0]["stops"])
    assert first == {} and between and all(each == {"ball": None} for each in between)
    # Column by column: the last one is how far it is moved.
    assert last["ball"][12:] == pytest.approx([0.0, 0.0, 9.0, 1.0])
    assert any(note.startswith("free obstacles are shown at rest") for note in notes)
