"""Silicone moulds: planes open every chamber, negatives and parts fit, and what cannot be made is refused."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pneumorph.make", reason="needs the extra cad")

from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import enclosed_volume
from pneumorph.make.checks import Check
from pneumorph.make.mould.proof import part
from pneumorph.make.mould.split import bounds
from pneumorph.make.mould.tessellation import tessellated
from pneumorph.make.silicone.files import make_silicone_mould
from pneumorph.make.silicone.pieces import pieces
from pneumorph.make.silicone.plan import plan_silicone, size_of
from pneumorph.make.silicone.proof import proof
from pneumorph.make.silicone.sag import grids, sag_of
from pneumorph.problem import BodySpec, load
from pneumorph.problem.fabrication import MakeSpec

CHORD = 0.1
THIN = MakeSpec.model_validate({"method": "silicone mould", "tube": "2 mm"})


def tube(chambers, length=30, radius=8, ends="flat"):
    table = {"length": f"{length} mm", "radius": f"{radius} mm", "control_density": "0.3 /mm"}
    table["chamber"] = [
        {
            "name": name,
            "radius": f"{size} mm",
            "center": [f"{x} mm", f"{y} mm"],
            "span": [f"{a} mm", f"{b} mm"],
            "ends": ends,
        }
        for name, size, (x, y), (a, b) in chambers
    ]
    return starting_body(BodySpec.model_validate(table))


SIDE_BY_SIDE = tuple(
    (name, 1.8, place, (3, 17)) for name, place in zip("ABCD", ((4, 4), (-4, 4), (-4, -4), (4, -4)), strict=True)
)


def failed(checks):
    return [check for check in checks if not check.passed]


def test_chambers_side_by_side_in_three_parts():
    planned = plan_silicone(tube(SIDE_BY_SIDE, length=20, radius=9), THIN, 1.0)
    assert planned.offsets == pytest.approx((-4.0, 4.0), abs=0.1)
    assert [slab.inner for slab in planned.slabs] == [False, True, False]
    # As if there were a high point on the outside of part 3.
    outside = planned.samples[0].points
    top = outside[np.argmax(outside @ planned.normal - 0.5 * np.abs(outside[:, 2] - 10.0))]
    planned = replace(planned, vents=top[None])
    made = pieces(planned)
    corners = {name: bounds(shape) for name, shape in made.assembly.items()}
    for number in (1, 2, 3):
        for side in "ab":  # the boxes are around the negatives
            (low, high), (least, most) = (
                corners[f"{n}-{side}{of}"] for n, of in (("box", f" of part {number}"), (f"negative-{number}", ""))
            )
            assert (low[1:] < least[1:]).all() and (high[1:] > most[1:]).all()
            assert low[0] == pytest.approx(least[0], abs=2.0 if side == "b" else 1e-6)
    parts = [part(piece.name, piece.role, tessellated(piece.shape, CHORD)) for piece in made.pieces]
    assert not failed(proof(planned, parts, CHORD))
    assert {"part-3", "negative-2-a", "negative-2-b", "master-3", "box-a", "cover-b"} <= {each.name for each in parts}
    handles = {each.name: each.solid.genus() for each in parts}
    assert handles["negative-3-a"] == 1 and handles["negative-1-a"] == 0
    assert handles["cover-a"] == 7 and handles["cover-b"] == 6  # six rods and the vent
    # A negative that is not where it was cast.
    ridge = next(each for each in parts if each.name == "negative-3-b")
    points = ridge.mesh.triangles.points + 0.4 * planned.slabs[2].up
    moved = replace(ridge.mesh, triangles=replace(ridge.mesh.triangles, points=points))
    changed = [part(each.name, each.role, moved) if each is ridge else each for each in parts]
    words = {(check.file, check.what) for check in failed(proof(planned, changed, CHORD))}
    assert ("mould 3", "distance of the part's points from the mould's surfaces") in words
    assert ("mould 3", "distance of the mould's curved surfaces from the part") in words
    assert ("negative-3-b", "distance of its curved surfaces from the master") in words


def test_ports_lie_in_the_plane_that_opens_their_chamber():
    body = tube((("A", 4, (0, 0), (3, 14)), ("B", 4, (0.5, 1), (17, 27))))
    planned = plan_silicone(body, MakeSpec(), 2.0)
    assert len(planned.offsets) == 1
    ways = {stem.chamber: stem for stem in planned.stems}
    assert (ways["A"].way, ways["B"].way) == ("base", "side")
    for stem in planned.stems:
        assert stem.start @ planned.normal == pytest.approx(planned.offsets[0], abs=0.05)
        assert abs(stem.direction @ planned.normal) < 1e-9


def test_a_chamber_that_winds_around_the_axis_is_refused_with_the_place():
    body = tube((("A", 1.5, (0, 0), (3, 27)),))
    (chamber,) = body.chambers
    turn = chamber.net[..., 2] / 4.0
    wound = chamber.net + 4.0 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    with pytest.raises(ComputationError, match=r"chamber A, z = \d+ mm: no plane along the axis opens all of it"):
        plan_silicone(replace(body, chambers=(replace(chamber, net=wound),)), THIN, 1.0)


def test_an_undercut_is_refused_with_the_place():
    body = tube((("A", 4, (0, 0), (3, 27)),))
    net = body.exterior.net
    # Turned lobes are in each other's way, in whichever direction the master is pulled.
    turn = net[..., 2] / 8.0
    x, y = net[..., 0], 0.6 * net[..., 1]
    twisted = np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn), net[..., 2]], axis=-1)
    body = replace(body, exterior=replace(body.exterior, net=twisted))
    tight = THIN.model_copy(update={"release_stretch": 1.001})
    with pytest.raises(ComputationError, match=r"cannot be pulled out of negative-\d-a: at x = .*release_stretch"):
        plan_silicone(body, tight, 1.0)


def test_a_tube_that_is_thicker_than_the_chamber_is_refused():
    thick = MakeSpec.model_validate({"tube": "10 mm"})
    with pytest.raises(ComputationError, match=r"chamber A, z = 3 mm: .*port of 9 mm.*make\.tube"):
        plan_silicone(tube((("A", 4, (0, 0), (3, 27)),)), thick, 2.0)


def test_the_sag_is_that_of_the_space_around_the_part(bodies):
    planned = plan_silicone(bodies("plain"), THIN, 1.0)
    slab = planned.slabs[1]
    found = grids(planned, slab)
    size, body = size_of(planned), planned.body
    across, tall = 2.0 * size.half, size.high - size.low
    flange = np.pi * planned.flange**2 * planned.spec.flange.thickness
    rubber = (enclosed_volume(body.exterior) + flange) / 2.0
    chamber = enclosed_volume(body.chambers[0]) / 2.0
    exact = {"a": across * tall * planned.deep[0] - rubber, "b": across * tall * planned.deep[1] + chamber}
    for side, grid in found.items():
        assert grid.filled.mean() * np.prod(grid.high - grid.low) == pytest.approx(exact[side], rel=0.05)
    # Silicone that moves by 1 % of its height along z changes the length by 1 %, and the walls not.
    nodes = {side: np.random.default_rng(0).uniform(each.low, each.high, (4000, 3)) for side, each in found.items()}
    sag = sag_of(planned, slab, {side: (at, at * [0.0, 0.0, 0.01]) for side, at in nodes.items()})
    assert sag.length == pytest.approx(0.3, rel=0.1)
    assert sag.largest == pytest.approx(0.3, rel=0.1)
    assert isinstance(sag.check(0.2), Check) and not sag.check(0.2).passed and sag.check(0.4).passed


def test_all_files_are_written_and_large_pieces_split(tmp_path):
    changes = {"tube": "2 mm", "method": "silicone mould", "printer": {"volume": ["60 mm", "46 mm", "46 mm"]}}
    problem = load("examples/small.toml").with_changes({"make": changes, "limits.wall": "1 mm"})
    body = tube((("A", 3, (0, 0), (3, 17)),), length=20, radius=6, ends="pole")
    files, checks = make_silicone_mould(body, problem, tmp_path, 0.04)
    assert not failed(checks)
    names = {path.name for path in files}
    assert {"assembly.step", "assembly.pdf", "bill.csv", "wall.png", "part-1.3mf", "master-1-2.step"} <= names
    bill = (tmp_path / "bill.csv").read_text(encoding="utf-8")
    assert "silicone for negatives, Elastosil M4601" in bill and "Elastosil M4601 part B" in bill


def test_bad_values_are_answered_in_one_line():
    small = load("examples/small.toml")
    with pytest.raises(ProblemError, match=r"make\.method.*'split mould'"):
        small.with_changes({"make.method": "lost wax"})
    with pytest.raises(ProblemError, match=r"make\.silicone.*not a rubber of the library.*Elastosil"):
        small.with_changes({"make.silicone": "putty"})
