"""Moulds: ports, partings and vents are where they should be, and what is written passes its own proof."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pneumorph.make", reason="needs the extra cad")

from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.make.mould.bill import bill
from pneumorph.make.mould.files import make_mould
from pneumorph.make.mould.pieces import pieces
from pneumorph.make.mould.plan import plan
from pneumorph.make.mould.proof import part, proof, room
from pneumorph.make.mould.release import release
from pneumorph.make.mould.samples import sampled
from pneumorph.make.mould.sheet import FOOT, _sections, text_pages
from pneumorph.make.mould.tessellation import tessellated
from pneumorph.make.mould.tops import tops
from pneumorph.problem import BodySpec, load
from pneumorph.problem.fabrication import MakeSpec

DENSITY = 1.1e-9
CHORD = 0.03
THIN = MakeSpec.model_validate({"tube": "2 mm"})


def tube(chambers, length=40, radius=8, **rest):
    table = {"length": f"{length} mm", "radius": f"{radius} mm", "control_density": "0.4 /mm", **rest}
    table["chamber"] = [
        {"name": name, "radius": f"{size} mm", "center": [f"{x} mm", f"{y} mm"], "span": [f"{a} mm", f"{b} mm"]}
        for name, size, (x, y), (a, b) in chambers
    ]
    return starting_body(BodySpec.model_validate(table))


@pytest.mark.parametrize("place", [(0, 0), (-3.8, 0), (2, 3)])
def test_the_sheet_cuts_through_the_port(place):
    """Every piece beside the axis is named at a point in it, and the core's stem reaches the underside."""
    planned = plan(tube([("A", 3, place, (3, 37))]), THIN, 1.0, DENSITY)
    parts = [part(piece.name, piece.role, tessellated(piece.shape, 0.1)) for piece in pieces(planned)]
    upright, level = _sections(planned, parts, "A tube").axes
    names = {text.get_text() for text in upright.texts}
    assert {"body", "base", "lid", "core-A", "outer-1", "outer-2"} <= names
    assert {"body", "core-A", "outer-1", "outer-2"} <= {text.get_text() for text in level.texts}
    shown = [each for each in parts if each.role in ("mould", "core", "product")]
    core = [each.name for each in shown].index("core-A")
    assert upright.patches[core].get_path().vertices[:, 1].min() < planned.bottom - 1.0


def test_text_fills_pages_and_none_runs_off():
    pages = list(text_pages({"Steps": [f"{n}. {'word ' * 60}" for n in range(15)], "Bill": ["1 piece"] * 5}))
    heights = [[text.get_position()[1] for text in page.texts] for page in pages]
    assert len(pages) == 2 and all(min(each) > FOOT for each in heights)
    assert "Bill" in [text.get_text() for text in pages[-1].texts] and len(pages[-1].texts) > 7


def proved(planned):
    parts = [part(piece.name, piece.role, tessellated(piece.shape, CHORD)) for piece in pieces(planned)]
    return parts, list(proof(planned, parts, CHORD))


def test_a_mould_of_any_body_passes_its_proof(body):
    parts, checks = proved(plan(body, THIN, 1.0, DENSITY))
    assert not [check for check in checks if not check.passed]
    assert {"body", "base", "lid", "outer-1", "outer-2"} <= {each.name for each in parts}


def test_a_piece_in_the_rubbers_room_fails_the_proof(bodies):
    planned = plan(bodies("plain"), THIN, 1.0, DENSITY)
    parts = [part(piece.name, piece.role, tessellated(piece.shape, CHORD)) for piece in pieces(planned)]
    core = next(each for each in parts if each.role == "core")
    points = core.mesh.triangles.points + np.array([0.3, 0.0, 0.0])
    moved = replace(core.mesh, triangles=replace(core.mesh.triangles, points=points))
    changed = [part(core.name, "core", moved) if each is core else each for each in parts]
    failed = {check.what for check in proof(planned, changed, CHORD) if not check.passed}
    assert {
        "distance of the part's points from the mould's surfaces",
        "distance of the mould's curved surfaces from the part",
        "volume of the part that pieces take up, relative",
    } <= failed


def test_coarse_triangles_take_up_no_room(bodies):
    """Those of a piece and of the part have different vertices on their common surface."""
    planned, chord = plan(bodies("flat"), THIN, 1.0, DENSITY), 0.2
    parts = [part(piece.name, piece.role, tessellated(piece.shape, chord)) for piece in pieces(planned)]
    around = [each for each in parts if each.role in ("mould", "core")]
    product = next(each for each in parts if each.name == "body")
    (taken,) = (check for check in room("mould", product, around, chord) if "volume" in check.what)
    assert taken.value > 1e-3
    assert taken.passed


def test_no_rubber_gets_into_the_clearance_around_stems():
    """Between stem and mould the part's surface had nothing to lie on."""
    body = tube((("A", 4, (0, 0), (3, 18)), ("B", 4, (0, 0), (21, 37))))
    loose = MakeSpec.model_validate({"clearance": "1 mm"})
    _, checks = proved(plan(body, loose, 2.0, DENSITY))
    assert not [check for check in checks if not check.passed]


def test_chambers_behind_others_get_their_ports_through_the_side_and_a_parting_there():
    body = tube((("A", 4, (0, 0), (3, 18)), ("B", 4, (0, 0), (21, 37))))
    planned = plan(body, MakeSpec(), 2.0, DENSITY)
    ways = {stem.chamber: stem for stem in planned.stems if not stem.closed}
    assert ways["A"].way == "base"
    assert ways["B"].way == "side"
    assert 21.0 < ways["B"].start[2] < 28.0
    assert ways["B"].wall == pytest.approx(4.0, abs=0.6)
    assert min(abs((ways["B"].angle - angle + np.pi) % (2 * np.pi) - np.pi) for angle in planned.angles) < 1e-6


def test_a_slender_core_is_held_at_both_ends():
    body = tube((("A", 4, (0, 0), (3, 197)),), length=200, control_density="0.3 /mm")
    (core,) = plan(body, THIN, 2.0, DENSITY).cores
    assert [stem.way for stem in core.stems] == ["base", "tip"]
    assert [stem.closed for stem in core.stems] == [False, True]
    assert core.sag < 0.1


def test_a_core_behind_another_is_held_by_two_stems_through_the_side():
    spans = ((3, 17), (20, 90), (93, 107))
    body = tube(tuple((n, 4, (0, 0), span) for n, span in zip("ABC", spans, strict=True)), length=110)
    planned = plan(body, THIN.model_copy(update={"core_sag": 0.02}), 1.5, DENSITY)
    core = planned.cores[1]
    port, second = core.stems
    assert (port.way, port.closed, second.way, second.closed) == ("side", False, "side", True)
    assert port.start[2] < 30.0 and second.start[2] > 80.0
    assert port.angle == pytest.approx(second.angle)  # no further parting
    assert core.sag < 0.02
    _, checks = proved(planned)
    assert not [check for check in checks if not check.passed]


def test_a_core_that_sags_too_far_is_refused_with_the_place():
    body = tube((("A", 4, (0, 0), (3, 197)),), length=200, control_density="0.3 /mm")
    with pytest.raises(ComputationError, match=r"chamber A, z = 100 mm: the core sags.*make\.core_sag"):
        plan(body, THIN.model_copy(update={"core_sag": 1e-4}), 2.0, DENSITY)


def test_only_a_core_that_is_little_wider_than_its_port_is_pulled_out():
    body = tube((("A", 4, (0, 0), (3, 37)),))
    for size, whole in (("2 mm", False), ("6 mm", True)):
        (core,) = plan(body, MakeSpec.model_validate({"tube": size}), 2.0, DENSITY).cores
        assert core.leaves_whole(1.5) == whole


def test_the_outer_mould_and_stems_have_the_draft(bodies):
    spec = THIN.model_copy(update={"draft": np.radians(3.0)})
    planned = plan(bodies("plain"), spec, 1.0, DENSITY)
    parts, checks = proved(planned)
    assert not [check for check in checks if not check.passed]
    found = {each.name: each.mesh.triangles.points for each in parts}
    radius, z = np.hypot(*found["outer-1"][:, :2].T), found["outer-1"][:, 2]
    for end in (planned.bottom, planned.length):
        assert radius[np.abs(z - end) < 1e-6].max() == pytest.approx(planned.outer - 6.0 * np.tan(spec.draft))
    assert radius.max() == pytest.approx(planned.outer, abs=1e-6)
    stem = found["core-A"][found["core-A"][:, 2] < planned.bottom - 7.9]
    assert np.hypot(*stem[:, :2].T).max() == pytest.approx(0.9 - 0.2 * 0.9, abs=1e-6)  # a thin one keeps 80 %


def test_what_is_too_tall_for_the_printer_is_split_with_keys():
    body = tube((("A", 4, (0, 0), (3, 87)),), length=90, control_density="0.3 /mm")
    small = MakeSpec.model_validate({"tube": "3 mm", "printer": {"volume": ["60 mm", "60 mm", "60 mm"]}})
    parts, checks = proved(plan(body, small, 2.0, DENSITY))
    assert not [check for check in checks if not check.passed]
    names = {each.name for each in parts}
    assert {"outer-1-1", "outer-1-2", "outer-2-1", "outer-2-2", "core-A-1", "core-A-2", "base", "lid"} <= names
    lower, upper = (next(each for each in parts if each.name == f"outer-1-{k}") for k in (1, 2))
    plane = upper.mesh.triangles.points[:, 2].min()
    assert lower.mesh.triangles.points[:, 2].max() > plane + 0.4  # the keys


def test_what_cannot_be_split_for_the_printer_is_refused():
    body = tube((("A", 4, (0, 0), (3, 37)),))
    small = MakeSpec.model_validate({"printer": {"volume": ["45 mm", "45 mm", "250 mm"]}})
    with pytest.raises(ComputationError, match=r"base is .* too large for make\.printer\.volume.*larger printer"):
        pieces(plan(body, small, 2.0, DENSITY))


def test_a_tube_that_is_thicker_than_the_chamber_is_refused_with_the_place():
    with pytest.raises(ComputationError, match=r"chamber A cannot get a port of 9 mm.*make\.tube"):
        plan(tube((("A", 4, (0, 0), (3, 37)),)), MakeSpec.model_validate({"tube": "10 mm"}), 2.0, DENSITY)


def test_the_depth_of_an_undercut_is_found():
    body = tube((("A", 4, (0, 0), (3, 37)),))
    net = body.exterior.net
    exterior = sampled(body.exterior)
    thick = np.full(len(exterior.points), 4.0)
    assert release(exterior, thick, 0.0, np.pi).depth < 0.05
    # A groove around the body has walls along the direction in which a half mould is pulled off.
    groove = np.where(np.arange(len(net))[:, None, None] == len(net) // 2, [0.6, 0.6, 1.0], 1.0)
    assert release(sampled(replace(body.exterior, net=net * groove)), thick, 0.0, np.pi).depth < 0.1
    # Waves along that direction are in its way.
    wave = net + np.stack([np.zeros(net.shape[:2]), 3.0 * np.sin(net[..., 0] / 2.0), np.zeros(net.shape[:2])], axis=-1)
    bent = release(sampled(replace(body.exterior, net=wave)), thick, np.pi / 2.0, 1.5 * np.pi)
    assert bent.depth > 0.3
    assert bent.stretch == pytest.approx(1.0 + bent.depth / 4.0)


def test_tops_are_where_air_stays():
    body = tube((("A", 4, (0, 0), (3, 37)),))
    assert len(tops(sampled(body.exterior))) == 0
    net = body.exterior.net.copy()
    middle = len(net) // 2
    # A lobe that rises above the wall it grows from.
    net[middle, :4, 0] += 4.0
    net[middle, :4, 2] += 6.0
    (top,) = tops(sampled(replace(body.exterior, net=net)))
    assert top[0] > 8.0
    assert 20.0 < top[2] < 28.0


def test_shrinkage_enlarges_the_mould(bodies):
    body = bodies("plain")
    spec = THIN.model_copy(update={"shrinkage": 0.1})
    assert plan(body, spec, 1.0, DENSITY).length == pytest.approx(30.0 / 0.9)


def test_the_bill_weighs_the_rubber(bodies):
    planned = plan(bodies("plain"), THIN, 1.0, DENSITY)
    parts, _ = proved(planned)
    volume = next(each for each in parts if each.role == "product").solid.volume()
    items = {(item.item, item.unit): item.quantity for item in bill(planned, parts, "Smooth-Sil 950", 1.24e-9)}
    grams = volume * 1.2 * 1.24e-3
    assert items["rubber, Smooth-Sil 950", "g"] == pytest.approx(grams)
    assert items["Smooth-Sil 950 part A", "g"] == pytest.approx(grams * 10 / 11)
    assert items["Smooth-Sil 950 part B", "g"] == pytest.approx(grams / 11)


def test_all_files_are_written_and_valid(tmp_path):
    problem = load("examples/small.toml")
    files, checks = make_mould(starting_body(problem.tubes), problem, tmp_path, 0.1)
    assert not [check for check in checks if not check.passed]
    assert all(path.stat().st_size > 100 for path in files)
    names = {path.name for path in files}
    assert {"assembly.step", "assembly.pdf", "bill.csv", "wall.png", "core-A.step", "core-A.3mf"} <= names


def test_bad_values_are_answered_in_one_line():
    with pytest.raises(ProblemError, match=r"make\.tube.*above zero"):
        load("examples/small.toml").with_changes({"make.tube": "0 mm"})
    with pytest.raises(ProblemError, match=r'make\.tubes.*did you mean "tube"'):
        load("examples/small.toml").with_changes({"make.tubes": "4 mm"})
    with pytest.raises(ProblemError, match=r"make\.draft.*more than 5 deg"):
        load("examples/small.toml").with_changes({"make.draft": "10 deg"})
