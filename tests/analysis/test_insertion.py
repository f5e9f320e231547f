"""Where a further chamber helps: a part of a body beside the whole, and which places are told."""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial import KDTree
from texts import problem_text

import pneumorph as pm
from pneumorph.analysis.insertion import Insertions, best_insertions, find_insertions
from pneumorph.output.insertion import cut
from pneumorph.problem import loads

BEND = """
[[task]]
name = "bend"
pressure = { A = "60 kPa" }
objective = { motion = "-bending_y" }
[limits]
wall = "1 mm"
[mesh]
size = "3 mm"
"""
AROUND = 2.0
"""Distance from a place within which voids are compared, mm: meshes differ."""


def found(symmetry):
    text = problem_text(BEND, length=20, chambers=(("A", 2.5, "4 mm", "0 mm"),), body=symmetry)
    near = pm.starting_design(loads(text))._near
    return find_insertions(near.problem, near.disc, near.analysis), near.disc


def test_a_void_in_half_a_body_does_what_it_does_in_the_whole():
    (half, disc), (whole, _) = found('symmetry = { mirror = ["xz"] }'), found("")
    assert disc.model.copies == 2
    places = ((-2.0, 4.0, 8.0), (4.0, 5.5, 12.0), (-5.0, 3.0, 14.0), (4.0, 5.5, 4.0))
    values = []
    for each in (half, whole):
        near = [KDTree(each.places).query_ball_point(place, AROUND) for place in places]
        values.append([each.gain[own].mean() for own in near])
    assert values[0] == pytest.approx(values[1], abs=0.05 * np.abs(values[1]).max())
    assert np.ptp(values[1]) > 0.5 * np.abs(values[1]).max()


def test_the_gain_is_the_motion_that_is_maximised():
    half, _ = found('symmetry = { mirror = ["xz"] }')
    assert half.gain == pytest.approx(-half.motions["bend"][4], rel=1e-6, abs=1e-12)
    assert set(half.pressures["bend"]) <= {0.0, 0.06}


def test_places_have_room_and_are_apart():
    places = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [9.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    room, gain = np.array([4.0, 4.0, 4.0, 1.5]), np.array([1.0, 0.9, 0.5, 9.0])
    known = Insertions(places, room, gain, {"t": np.full(4, 0.06)}, {"t": np.ones((6, 4))})
    told = list(best_insertions(known, wall=1.0, least=1.0, count=5))
    assert [each.place[0] for each in told] == [0.0, 9.0]
    assert told[0].radius == 3.0
    assert told[0].gain == pytest.approx(36.0 * np.pi)
    assert not list(best_insertions(known, wall=1.0, least=5.0, count=5))


def test_an_image_has_the_pressures_that_are_best_there():
    # Of half a body: the image in its mirror plane has the same state, that in the other plane has not.
    places, pressures = np.array([[-5.0, 3.0, 8.0], [5.0, 3.0, 8.0]]), {"t": np.array([0.06, 0.0])}
    known = Insertions(places, np.full(2, 4.0), np.ones(2), pressures, {"t": np.ones((6, 2))}, ("xz",))
    assert [known.pressures_at(np.array([x, y, 8.0]))["t"] for x in (-5.1, 5.1) for y in (3.0, -3.0)] == [
        *(0.06, 0.06),
        *(0.0, 0.0),
    ]


def test_the_cut_of_tetrahedra_has_their_area_and_is_in_the_plane():
    # Of a cube of six tetrahedra around its diagonal, cut at some height, and along a diagonal plane.
    paths = [np.eye(3)[list(order)].cumsum(axis=0) for order in permutations(range(3))]
    cube = np.array([np.vstack([np.zeros(3), path]) for path in paths])

    def area(polygon):
        spokes = polygon[1:] - polygon[0]
        return 0.5 * np.linalg.norm(np.cross(spokes[:-1], spokes[1:]).sum(axis=0))

    for normal, origin, whole in (((0, 0, 1), (0, 0, 0.3), 1.0), ((1, 1, 0), (0.5, 0.5, 0), np.sqrt(2.0))):
        unit = np.array(normal) / np.linalg.norm(normal)
        polygons, owners = cut(cube, unit, np.array(origin))
        assert len(polygons) == len(owners) == len(set(owners))
        assert sum(map(area, polygons)) == pytest.approx(whole)
        assert np.abs(np.concatenate(polygons) @ unit - np.dot(origin, unit)).max() < 1e-12


def test_the_picture_shows_the_whole_body_and_the_places(tmp_path):
    text = problem_text(BEND, length=20, chambers=(("A", 2.5, "4 mm", "0 mm"),), body='symmetry = { mirror = ["xz"] }')
    design = pm.starting_design(loads(text).with_changes({"limits.curvature": "4 /mm^2", "limits.wall": "0.6 mm"}))
    figure = design.plot_further_chambers(tmp_path / "field.png")
    along, across = figure.axes[:2]
    assert (tmp_path / "field.png").stat().st_size > 10_000
    assert across.dataLim.height == pytest.approx(16.0, rel=0.03) and along.dataLim.width == pytest.approx(
        20.0, rel=0.02
    )
    assert across.patches
